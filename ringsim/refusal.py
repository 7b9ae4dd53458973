"""Refusing bad input: one clear line, naming field, value, bound and cure."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ringsim.choice import leaves_of
from ringsim.parts.persection import EACH, ONE
from ringsim.units import Model, unit_of

MOST_NAMED = 3
"""So many further faults are named beside the one that is described."""

LONGEST_VALUE = 60
"""Characters of a refused value that are shown."""


class InputError(ValueError):
    """Input that is refused; its text is one line meant for the user."""

    def __init__(self, text: str) -> None:
        line = " ".join(text.split())
        super().__init__("".join(c if c.isprintable() else ascii(c)[1:-1] for c in line))


def explain(error: ValidationError, model: type[BaseModel], source: str) -> str:
    """One line: the first fault in full, then where the others are.

    Parameters
    ----------
    error
        What pydantic found.
    model
        The model that was validated; its fields give units and known names.
    source
        File or scene name that starts the line.
    """
    faults = error.errors(include_url=False)
    line = f"{source}: {_describe(faults[0], model)}"
    others = list(dict.fromkeys(_place(fault, model) for fault in faults[1:]))
    if others:
        left = len(others) - MOST_NAMED
        more = f" and {left} more" if left > 0 else ""
        line += f"; also at fault: {', '.join(others[:MOST_NAMED])}{more}"
    return line


def known_or_nearest(key: str, known: Iterable[str]) -> str:
    """The hint behind a refused name: the nearest known one, or all of them.

    >>> known_or_nearest("densty", ["density", "damping"])
    'did you mean density?'
    """
    names = list(known)
    if not names:
        return "it has no keys"
    close = difflib.get_close_matches(key.lower(), names, n=1, cutoff=0.6)
    return f"did you mean {close[0]}?" if close else f"known: {', '.join(names)}"


def show(value: Any) -> str:
    """A value as TOML would write it, shortened."""
    text = " ".join(_toml(value).split())
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def _place(fault: Any, model: type[BaseModel]) -> str:
    path = _walk(fault["loc"], model)[0]
    if path:
        return ".".join(path)
    return str(fault.get("ctx", {}).get("error", fault["msg"])).split(" ", 1)[0]


def _describe(fault: Any, model: type[BaseModel]) -> str:
    path, owner, field = _walk(fault["loc"], model)
    where = ".".join(path)
    kind, value = fault["type"], fault["input"]
    symbol = unit_of(field) if field is not None else "1"
    unit = f" {symbol}" if symbol != "1" else ""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    shown = f"{where} = {show(value)}{unit if number else ''}"
    limits = fault.get("ctx", {})
    match kind:
        case "extra_forbidden":
            # A model may tell of the keys that it once had.
            hint = getattr(owner, "gone", {}).get(path[-1])
            hint = hint or known_or_nearest(path[-1], owner.model_fields if owner else ())
            return f"{where} is not a known key ({hint})"
        case "missing":
            return f"{where} is missing: give it a value{unit and f' in{unit}'}"
        case "greater_than":
            return f"{shown} must be above {limits['gt']:g}{unit}"
        case "greater_than_equal":
            return f"{shown} must be at least {limits['ge']:g}{unit}"
        case "less_than":
            return f"{shown} must be below {limits['lt']:g}{unit}"
        case "less_than_equal":
            return f"{shown} must be at most {limits['le']:g}{unit}"
        case "int_type" | "int_from_float" | "int_parsing" | "int_parsing_size":
            return f"{shown} must be a whole number, without quotes or decimal point"
        case "float_type" | "finite_number" | "float_parsing":
            return f"{shown} must be a finite number{unit and f' in{unit}'}, without quotes"
        case "bool_type":
            return f"{shown} must be true or false, without quotes"
        case "string_type" | "string_unicode" | "string_sub_type":
            return f'{shown} must be text in quotes, for example {path[-1]} = "a-word"'
        case "string_pattern_mismatch":
            return (
                f"{shown} must start with a letter or digit and hold only letters, digits, "
                "dots, dashes and underscores"
            )
        case "string_too_long":
            return f"{shown} must have at most {limits['max_length']} characters"
        case "union_tag_invalid":
            given = value.get("kind") if isinstance(value, dict) else limits["tag"]
            hint = known_or_nearest(str(given), _kinds(field))
            return f"{where}.kind = {show(given)} is not a kind of it ({hint})"
        case "union_tag_not_found":
            choices = " or ".join(f'"{kind}"' for kind in _kinds(field))
            return f"{where}.kind is missing: say which kind it is with kind = {choices}"
        case "literal_error":
            return f"{shown} must be {limits['expected']}"
        case "model_type" | "model_attributes_type":
            return f"{shown} must be a table: write [{where}], and its keys on the lines below"
        case "tuple_type":
            return f"{shown} must be one value, or a list with a value for each section"
        case "value_error":
            text = str(limits["error"])
            return f"{where}.{text}" if where and not text.startswith(where) else text
        case _:
            message = fault["msg"]
            return f"{shown}: {message[0].lower()}{message[1:]}"


def _walk(
    loc: tuple[int | str, ...], model: type[BaseModel]
) -> tuple[list[str], type[BaseModel] | None, FieldInfo | None]:
    """Follow a location through the models; leaves out the tags of unions."""
    path: list[str] = []
    owner: type[BaseModel] | None = model
    field: FieldInfo | None = None
    inside: list[type[BaseModel]] = [model]
    for step in loc:
        named = [m for m in inside if isinstance(step, str) and step in m.model_fields]
        tagged = [m for m in inside if _tag(m) == step]
        if tagged and path and len(inside) > 1:
            inside, owner = tagged, tagged[0]
        elif named:
            owner, field = named[0], named[0].model_fields[str(step)]
            inside = _models_in(field.annotation)
            path.append(str(step))
        elif isinstance(step, int):
            path[-1:] = [f"{path[-1]}[{step + 1}]"] if path else [f"[{step + 1}]"]
        elif step in (ONE, EACH):
            continue
        else:
            owner = inside[0] if inside else None
            field = field if field and typing.get_origin(field.annotation) is dict else None
            path.append(str(step))
    return path, owner, field


def _kinds(field: FieldInfo | None) -> list[str]:
    models = _models_in(field.annotation) if field is not None else []
    return [str(_tag(model)) for model in models if _tag(model) is not None]


def _tag(model: type[BaseModel]) -> Any:
    kind = model.model_fields.get("kind")
    return kind.default if kind is not None else None


_NESTING = (typing.Union, types.UnionType, typing.Annotated, tuple, list, dict)


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, Model):
        return [*leaves_of(annotation)]
    if typing.get_origin(annotation) in _NESTING:
        return [m for part in typing.get_args(annotation) for m in _models_in(part)]
    return []


def _toml(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return f'"{value}"'
        case int() if abs(value) > 10**30:
            return f"{'-' if value < 0 else ''}an integer of {value.bit_length()} bits"
        case dict():
            return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(_toml(each) for each in value) + "]"
        case _:
            return str(value)
