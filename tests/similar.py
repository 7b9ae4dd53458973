"""Scenes in other units: lengths, times and masses times a number, and nothing else.

Every field and every output says its unit; a power of two as the number leaves all bits but the
exponent, so that an engine without a length, a time or a force of its own gives the same digits.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from pydantic import BaseModel

from ringsim.scene import Scene, scene_from_table
from ringsim.units import unit_of


class Scale(NamedTuple):
    """By what each unit is multiplied."""

    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0

    def of(self, unit: str) -> float:
        """Factor of numbers of a unit, such as "N m s/rad".

        >>> Scale(4.0, 2.0, 1.0).of("N/m"), Scale(4.0, 2.0, 1.0).of("kg m^2")
        (0.25, 16.0)
        """
        force = self.mass * self.length / self.time**2
        known = {
            "m": self.length, "s": self.time, "kg": self.mass, "N": force,
            "Pa": force / self.length**2, "J": force * self.length,
            "W": force * self.length / self.time, "Hz": 1.0 / self.time,
        }  # fmt: skip
        over, _, under = unit.partition("/")
        found = 1.0
        for words, sign in ((over, 1), (under.strip("()"), -1)):
            for word, power in re.findall(r"([A-Za-z]+)(?:\^(\d))?", words):
                found *= known.get(word, 1.0) ** (sign * int(power or 1))
        return found


def scaled(scene: Scene, scale: Scale) -> Scene:
    """A scene with every value in other units."""
    return scene_from_table(_scaled(scene, scene.to_table(), scale), source="scaled")


def _scaled(record: BaseModel, table: dict[str, Any], scale: Scale) -> dict[str, Any]:
    found = dict(table)
    for name, field in type(record).model_fields.items():
        if name not in table:
            continue
        inner, value = getattr(record, name), table[name]
        if isinstance(inner, BaseModel) and isinstance(value, dict):
            found[name] = _scaled(inner, value, scale)
        elif isinstance(inner, (list, tuple)) and inner and isinstance(inner[0], BaseModel):
            pairs = zip(inner, value, strict=True)
            found[name] = [_scaled(one, each, scale) for one, each in pairs]
        else:
            found[name] = _times(value, scale.of(unit_of(field)))
    return found


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, dict):
        return {key: _times(each, factor) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_times(each, factor) for each in value]
    if isinstance(value, float):
        return value * factor
    return value
