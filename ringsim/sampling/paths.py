"""Scene paths as inputs: their values, and which of them a campaign may vary."""

import operator
from typing import Any

from ringsim.overrides import section_of
from ringsim.refusal import InputError
from ringsim.scene import Scene

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
    value = operator.attrgetter(inner)(scene)
    return value[section - 1] if section is not None and isinstance(value, tuple) else value


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
