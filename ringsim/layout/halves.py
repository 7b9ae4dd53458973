"""Rods as rows of results: a rod with a joint inside is two, left and right of it."""

from __future__ import annotations

from typing import NamedTuple

from ringsim.layout.bodies import OnRod
from ringsim.layout.layout import Layout


class Half(NamedTuple):
    """Elements ``first`` to ``last`` - 1 of a rod."""

    rod: int
    first: int
    last: int


def halves(layout: Layout) -> dict[str, list[Half]]:
    """Row of every rod or half of one by name, in the order of the layout; a value a section."""
    inside = {
        mount.rod: mount.station
        for joint in layout.joints
        for mount in (joint.first, joint.second)
        if isinstance(mount, OnRod) and 0 < mount.station < len(layout.rods[mount.rod].stations) - 1
    }
    rows: dict[str, list[Half]] = {}
    for number, rod in enumerate(layout.rods):
        last, middle = len(rod.stations) - 1, inside.get(number)
        if middle is None:
            rows.setdefault(rod.name, []).append(Half(number, 0, last))
        else:
            rows.setdefault(f"{rod.name}_left", []).append(Half(number, 0, middle))
            rows.setdefault(f"{rod.name}_right", []).append(Half(number, middle, last))
    return rows
