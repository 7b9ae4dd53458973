"""Families of choices: each kind is a model in its own file, picked by ``kind = "..."``."""

import functools
import importlib
import pkgutil
from dataclasses import dataclass
from typing import Annotated, Any, Union, get_args

from pydantic import Field, GetCoreSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema, core_schema

from ringsim.units import Model


@dataclass(frozen=True)
class OneOf:
    """Marks a field that holds any kind of its family: ``rods: Annotated[Rods, OneOf()]``.

    Kinds are looked up when a value is read: one that a script defines is a choice from then on.
    """

    default: str | None = None
    """Kind of a table that does not name one; without it the table must."""

    def __get_pydantic_core_schema__(
        self, family: type[Model], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def read(value: Any) -> Any:
            if self.default is not None and isinstance(value, dict):
                value = {"kind": self.default, **value}
            # pydantic passes the errors of this inner reader on with their places and values.
            return _reader(tuple(kinds_of(family).values())).validate_python(value)

        # What writes a schema of files needs to know what a reader hides.
        marks = {"family": family, "one_of": self}
        return core_schema.no_info_plain_validator_function(read, metadata=marks)


def kinds_of(family: type[Model]) -> dict[str, type[Model]]:
    """All kinds of a family by name; ValueError if two have one name, or one has no usable name."""
    found: dict[str, type[Model]] = {}
    for kind in leaves_of(family):
        field = kind.model_fields["kind"]
        word = str(field.default)
        if get_args(field.annotation) != (word,):
            raise ValueError(
                f"kind {word} of {kind.__module__}.{kind.__name__} is not a Literal of this word: "
                f'write kind: Literal["{word}"] = "{word}"'
            )
        if (other := found.setdefault(word, kind)) is not kind:
            raise ValueError(
                f"kind {word} is defined twice, in {other.__module__} and in {kind.__module__}: "
                "rename yours"
            )
    return found


def kind_of(record: Model) -> str:
    """The word that picks the kind of ``record`` in a scene."""
    return str(type(record).model_fields["kind"].default)


def leaves_of(family: type[Model]) -> list[type[Model]]:
    """The kinds of a family in the order of their classes' names; the class itself if none.

    A kind has a ``kind`` of its own, so that one may extend another.
    """
    package, _, file = family.__module__.rpartition(".")
    if file == "family":
        load_package(package)
    own = [family] if "kind" in family.__annotations__ else []
    below = [kind for sub in family.__subclasses__() for kind in leaves_of(sub)]
    # A kind with two parents of the family is found below both.
    return sorted(dict.fromkeys(own + below), key=lambda kind: kind.__name__) or [family]


@functools.cache
def load_package(package: str) -> None:
    """Import every module of a package, so that all kinds that it holds are known."""
    inside = importlib.import_module(package).__path__
    for module in pkgutil.walk_packages(inside, f"{package}."):
        importlib.import_module(module.name)


@functools.cache
def _reader(kinds: tuple[type[Model], ...]) -> TypeAdapter[Any]:
    if len(kinds) == 1:
        return TypeAdapter(kinds[0])
    either: Any = Union[kinds]  # noqa: UP007
    return TypeAdapter(Annotated[either, Field(discriminator="kind")])
