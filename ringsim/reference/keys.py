"""One key of a scene or a campaign: what it takes, in which unit and range, and what it means."""

import ast
import functools
import inspect
import json
import textwrap
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import annotated_types
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from ringsim.cable.ropes import CableFault
from ringsim.refusal import models_in
from ringsim.units import EACH, LEFT_OUT, Model, nested_in, unit_of

# What docstrings say of records and their fields.


def words_of(model: type[Model]) -> str:
    """The docstring of a record without its examples; that of its family if it has none."""
    paragraphs = (inspect.getdoc(model) or "").split("\n\n")
    return "\n\n".join(text for text in paragraphs if not text.lstrip().startswith(">>>"))


@functools.cache
def field_words(model: type[Model]) -> dict[str, str]:
    """Docstrings below the fields of a record, by name; inherited fields have their family's."""
    found: dict[str, str] = {}
    for one in reversed(model.__mro__):
        if issubclass(one, Model) and one is not Model:
            found |= _in_body(one)
    return found


def _in_body(model: type[Model]) -> dict[str, str]:
    """Docstrings in the body of one class; none where it has no file: typed, or of ``runpy``."""
    try:
        source = inspect.getsource(model)
    except (OSError, TypeError):
        return {}
    (body,) = ast.parse(textwrap.dedent(source)).body
    assert isinstance(body, ast.ClassDef)
    return {
        field.target.id: inspect.cleandoc(below.value.value)
        for field, below in pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(below, ast.Expr)
        and isinstance(below.value, ast.Constant)
        and isinstance(below.value.value, str)
    }


# One key of a scene or a campaign: what it takes, in which unit and range, and what it means.


_WORDS = {bool: "true or false", int: "whole number", float: "number", str: "text"}


@dataclass(frozen=True)
class Key:
    """A field of a record, under the name that it has in files."""

    name: str
    owner: type[Model]
    field: FieldInfo

    @property
    def meaning(self) -> str:
        """Its docstring, on one line."""
        return " ".join(field_words(self.owner).get(self.attribute, "").split())

    @property
    def attribute(self) -> str:
        """Its name in the record, which differs where the one in files is a word of Python."""
        fields = self.owner.model_fields
        return next(name for name, field in fields.items() if field is self.field)

    @property
    def unit(self) -> str:
        """Symbol of its SI unit, or "1"."""
        return unit_of(self.field)

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        return self.field.is_required()

    @property
    def models(self) -> list[type[Model]]:
        """Records that it may hold, every kind of a family."""
        return typing.cast(list[type[Model]], models_in(self.field.annotation))

    @property
    def holder(self) -> str:
        """``names`` where names of the user's choice lead to its values, ``list``, or nothing."""
        origins = [typing.get_origin(part) for part in nested_in(self.field.annotation)]
        if dict in origins:
            return "names"
        return "list" if (tuple in origins or list in origins) and not self.each else ""

    @property
    def takes_a_name(self) -> bool:
        """Whether a name may stand for its number, see ``ringsim.cable.records``."""
        return issubclass(self.owner, CableFault) and self.name in ("pulley", "span")

    @property
    def each(self) -> bool:
        """Whether it may be a list with a value for every section, corner or pulley."""
        return any(getattr(part, "tag", None) == EACH for part in nested_in(self.field.annotation))

    @property
    def choices(self) -> list[Any]:
        """The words, or numbers, that it may be, if they are listed."""
        parts = nested_in(self.field.annotation)
        literal = (part for part in parts if typing.get_origin(part) is Literal)
        return [value for part in literal for value in typing.get_args(part)]

    @property
    def form(self) -> str:
        """What it is made of: a number, a table, one of some words."""
        if self.models:
            kinds = dict.fromkeys(filter(None, map(kind_in, self.models)))
            what = f"table with a kind: {', '.join(kinds)}" if kinds else "table"
            many = {"names": "tables by name, each a ", "list": "list of tables, each a "}
            return f"{many.get(self.holder, '')}{what}"
        if self.choices:
            return " or ".join(map(json.dumps, self.choices))
        annotation = self.field.annotation
        if self.takes_a_name:
            return "name, or whole number"
        what = " or ".join(dict.fromkeys(_plain(annotation))) or "any value"
        if self.holder == "names" and typing.get_origin(annotation) is dict:
            return f"{what} by name"
        if self.holder == "names":
            return f"{what}, or a table of them by name"
        return f"list, each {what}" if self.holder == "list" else what

    @property
    def default(self) -> str:
        """Its value if it is not given, as a file would have it; empty if it must be given, and of
        a table whose keys all have their own defaults.
        """
        value = self.field.get_default(call_default_factory=True)
        if value is PydanticUndefined:
            return ""
        if value is None:
            return LEFT_OUT
        if isinstance(value, Model):
            return _table(value)
        short = isinstance(value, float) and float(f"{value:g}") == value
        return f"{value:g}" if short else json.dumps(value)

    @property
    def range(self) -> str:
        """Its bounds, the tightest of all, in its unit; empty if it has none."""
        bounds = list(self._bounds())
        low = max(((value, out) for value, out, below in bounds if below), default=None)
        high = min(((value, not out) for value, out, below in bounds if not below), default=None)
        if low is not None and high is not None and not low[1] and high[1]:
            return f"{low[0]:g} .. {high[0]:g}"
        words = [] if low is None else [f"{'above' if low[1] else 'at least'} {low[0]:g}"]
        words += [] if high is None else [f"{'at most' if high[1] else 'below'} {high[0]:g}"]
        return ", ".join(words)

    def _bounds(self) -> Iterator[tuple[float, bool, bool]]:
        """Bounds with whether they are outside, and whether they are lower ones."""
        for mark in self._marks():
            if isinstance(mark, annotated_types.Ge):
                yield float(mark.ge), False, True  # type: ignore[arg-type]
            elif isinstance(mark, annotated_types.Gt):
                yield float(mark.gt), True, True  # type: ignore[arg-type]
            elif isinstance(mark, annotated_types.Le):
                yield float(mark.le), False, False  # type: ignore[arg-type]
            elif isinstance(mark, annotated_types.Lt):
                yield float(mark.lt), True, False  # type: ignore[arg-type]

    def _marks(self) -> Iterator[Any]:
        yield from self.field.metadata
        for part in nested_in(self.field.annotation):
            yield from part.metadata if isinstance(part, FieldInfo) else (part,)


def keys_of(model: type[Model]) -> list[Key]:
    """Keys of a record in the order of its fields, without its ``kind``."""
    fields = model.model_fields.items()
    return [Key(each.alias or name, model, each) for name, each in fields if name != "kind"]


def kind_in(model: type[Model]) -> str:
    """The word that picks a record of a family; empty for one that is no kind."""
    return str(model.model_fields["kind"].default) if "kind" in model.model_fields else ""


def _table(record: Model) -> str:
    """A default table: its kind, or what it holds."""
    if kind := kind_in(type(record)):
        return f'kind = "{kind}"'
    values = record.model_dump(exclude_defaults=True)
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _plain(annotation: Any) -> Iterator[str]:
    """Words for what an annotation is made of, without the names in tables."""
    if annotation in _WORDS:
        yield _WORDS[annotation]
    parts = typing.get_args(annotation)
    for part in parts[1:] if typing.get_origin(annotation) is dict else parts:
        yield from _plain(part)
