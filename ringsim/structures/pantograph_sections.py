"""Pantograph sections between hinge assemblies: rods, joints and the tracks of their cables."""

from __future__ import annotations

from typing import Any

import numpy as np

from ringsim.layout.draft import BodyRef, Draft, RodRef, Track
from ringsim.parts.persection import spread
from ringsim.structures.ring_geometry import Fold, RingGeometry


def add_sections(
    draft: Draft,
    geometry: RingGeometry,
    fold: Fold,
    corners: list[list[BodyRef]],
    vjoint_mass: float,
    *,
    plane: int = 0,
    prefix: str = "",
) -> None:
    """Add the sections of a closed ring or an arc.

    Parameters
    ----------
    fold
        Where their points are, at a complex coordinate (ringsim.layout.pose).
    corners
        Hinge assemblies by plane (upper, lower) and corner.
    vjoint_mass
        Of each V-joint, kg.
    plane
        Number of the upper plane; the lower one follows it.
    prefix
        Of the rods' names, where a structure has several rings.
    """
    rods = draft.scene.rods
    young = spread(rods.young_modulus, geometry.sections)
    tracks: tuple[list[Any], list[Any]] = ([], [])
    for section, normal in enumerate(geometry.normals):
        left, right = fold.left[:, section], fold.right[:, section]
        ends = (section, (section + 1) % len(corners[0]))

        def rod(name: str, start: Any, end: Any, halves: int) -> RodRef:
            stations = [k / (halves * rods.elements) for k in range(halves * rods.elements + 1)]
            group, tube = ("diagonals", rods.diagonal) if halves == 2 else ("bars", rods.bar)
            return draft.rod(
                prefix + name, section, group, (start, end), normal, tube, stations,  # noqa: B023
                float(young[section]),  # noqa: B023
            )  # fmt: skip

        def hinge(part: RodRef, side: int, end: int, at: Any) -> None:
            body = corners[side][ends[end]]  # noqa: B023
            draft.joint("revolute", "hinge", section, (part, body), at)  # noqa: B023

        rising = rod("diagonal_rising", left[1], right[0], 2)
        falling = rod("diagonal_falling", left[0], right[1], 2)
        hinge(rising, 1, 0, left[1])
        hinge(rising, 0, 1, right[0])
        hinge(falling, 0, 0, left[0])
        hinge(falling, 1, 1, right[1])
        draft.joint("revolute", "pivot", section, (rising, falling), fold.pivots[section])
        for side, (name, sense) in enumerate((("upper", 1.0), ("lower", -1.0))):
            at = fold.vjoints[side, section]
            first = rod(f"bar_{name}_left", left[side], at, 1)
            second = rod(f"bar_{name}_right", at, right[side], 1)
            hinge(first, side, 0, left[side])
            hinge(second, side, 1, right[side])
            joint = draft.joint("revolute", "vjoint", section, (first, second), at)
            draft.opening(plane + side, joint, sense, [0.0, 0.0, sense])
            if vjoint_mass > 0.0:
                draft.add_mass(first, -1, vjoint_mass)
            pins = [draft.on(corners[side][ends[k]], (left, right)[k][side]) for k in (0, 1)]
            tracks[side].extend([pins[0], section, pins[1]])
    for side, sense in enumerate((1.0, -1.0)):
        draft.tracks[plane + side] = Track(tracks[side], np.array([0.0, 0.0, -sense]))
