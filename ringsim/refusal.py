"""Refusing bad input: one clear line per fault, naming field, value, bound and cure."""

from __future__ import annotations

import difflib
import types
import typing
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ringsim.parts.persection import EACH, ONE
from ringsim.units import Unit


MOST_FAULTS = 4


class InputError(ValueError):
    """Input that is refused; its text is meant for the user."""


def explain(error: ValidationError, model: type[BaseModel], source: str) -> str:
    """One line per fault of a validation error.

    Parameters
    ----------
    error
        What pydantic found.
    model
        The model that was validated; its fields give units and known names.
    source
        File or scene name that starts every line.
    """
    faults = error.errors(include_url=False)
    lines = [f"{source}: {_describe(fault, model)}" for fault in faults[:MOST_FAULTS]]
    if len(faults) > MOST_FAULTS:
        lines.append(f"{source}: and {len(faults) - MOST_FAULTS} more faults of this kind")
    return "\n".join(lines)


def _describe(fault: Any, model: type[BaseModel]) -> str:
    path, owner, field = _walk(fault["loc"], model)
    where = ".".join(path)
    kind, value = fault["type"], fault["input"]
    unit = _unit(field)
    shown = f"{where} = {_show(value)}{unit}"
    limits = fault.get("ctx", {})
    match kind:
        case "extra_forbidden":
            return f"{where} is not a known key{_nearest(path[-1], owner)}"
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
        case "float_type" | "int_type" | "finite_number":
            wanted = "a whole number" if kind == "int_type" else "a finite number"
            return f"{shown} must be {wanted}{unit and f' in{unit}'}"
        case "bool_type":
            return f"{shown} must be true or false"
        case "union_tag_invalid":
            return f"{where}.kind = {_show(limits['tag'])} must be one of {limits['expected_tags']}"
        case "union_tag_not_found":
            return f'{where} needs a line kind = "...", to say which kind it is'
        case "literal_error":
            return f"{shown} must be one of {limits['expected']}"
        case "model_type" | "model_attributes_type":
            return f"{shown} must be a table ([{where}]) with keys of its own"
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
        if named:
            owner, field = named[0], named[0].model_fields[str(step)]
            inside = _models_in(field.annotation)
            path.append(str(step))
        elif tagged and path:
            inside, owner = tagged, tagged[0]
        elif isinstance(step, int):
            path[-1:] = [f"{path[-1]}[{step + 1}]"] if path else [f"[{step + 1}]"]
        elif step in (ONE, EACH):
            continue
        else:
            owner = inside[0] if inside else None
            field = None
            path.append(str(step))
    return path, owner, field


def _tag(model: type[BaseModel]) -> Any:
    kind = model.model_fields.get("kind")
    return kind.default if kind is not None else None


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType, typing.Annotated):
        return [m for part in typing.get_args(annotation) for m in _models_in(part)]
    return []


def _unit(field: FieldInfo | None) -> str:
    if field is None:
        return ""
    found = [m.symbol for m in field.metadata if isinstance(m, Unit)]
    found += _units_in(field.annotation)
    return f" {found[0]}" if found and found[0] != "1" else ""


def _units_in(annotation: Any) -> list[str]:
    found = [m.symbol for m in getattr(annotation, "__metadata__", ()) if isinstance(m, Unit)]
    for part in typing.get_args(annotation):
        if not isinstance(part, Unit):
            found += _units_in(part)
    return found


def _nearest(key: str, owner: type[BaseModel] | None) -> str:
    if owner is None:
        return ""
    known = list(owner.model_fields)
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f" (did you mean {close[0]}?)" if close else f" (known: {', '.join(known)})"


def _show(value: Any) -> str:
    text = f'"{value}"' if isinstance(value, str) else repr(value)
    text = {"True": "true", "False": "false"}.get(text, text).replace("\n", " ")
    return text if len(text) <= 60 else text[:57] + "..."
