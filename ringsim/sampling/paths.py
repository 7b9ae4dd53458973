"""Scene paths as inputs: their unit, and which of them a campaign may vary."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from ringsim.overrides import section_of
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.units import unit_of

FIXED = (
    "name", "title", "structure.kind", "structure.sections", "structure.closed", "solver.end_time",
    "record",
)  # fmt: skip
"""Paths that give a result its shape or its name: all samples of a campaign share them."""


def refuse_fixed(scene: Scene, path: str) -> None:
    """Refuse (InputError) a path whose value all samples of a campaign must share."""
    for fixed in (*FIXED, *scene.structure.shaping):
        if path == fixed or path.startswith((f"{fixed}.", f"{fixed}[")):
            raise InputError(
                f"inputs: {path} must be the same for all samples, because it shapes the result: "
                "give it under [set], and run a campaign for each value"
            )


def field_at(scene: Scene, path: str) -> Any:
    """The value of a scene at a dotted path, one entry of a list at ``name[k]``."""
    inner, section = section_of(path)
    value: Any = scene
    for step in inner.split("."):
        value = getattr(value, step)
    return value[section - 1] if section is not None and isinstance(value, tuple) else value


def unit_at(scene: Scene, path: str) -> str:
    """Symbol of the SI unit of the field at a path, "1" if it has none."""
    inner, _, last = section_of(path)[0].rpartition(".")
    owner = field_at(scene, inner) if inner else scene
    if not isinstance(owner, BaseModel) or last not in type(owner).model_fields:
        return "1"
    return unit_of(type(owner).model_fields[last])


def each_of(scene: Scene, path: str, value: Any) -> int:
    """How many values the list at a path has; InputError if it is one value for all sections."""
    if section_of(path)[1] is not None:
        raise InputError(f"inputs: {path} is one section already: leave out each_section")
    scene.with_values({path: value})
    try:
        each = field_at(scene.with_values({path: value, f"{path}[1]": value}), path)
    except InputError:
        each = None
    if not isinstance(each, tuple):
        raise InputError(f"inputs: {path} is one value for all sections: leave out each_section")
    return len(each)
