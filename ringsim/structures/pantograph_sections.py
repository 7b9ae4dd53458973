"""Pantograph sections between hinge assemblies: rods, joints and the tracks of their cables."""

from typing import Any

import numpy as np

from ringsim.layout.draft import BodyRef, Draft, Track
from ringsim.parts.persection import spread
from ringsim.parts.rods.length_error import errors_of
from ringsim.structures.hinge_error import HingeError
from ringsim.structures.ring_geometry import Array, Fold, RingGeometry


def add_sections(
    draft: Draft,
    geometry: RingGeometry,
    fold: Fold,
    corners: list[list[BodyRef]],
    vjoint_mass: float,
    *,
    plane: int = 0,
    prefix: str = "",
    errors: HingeError | None = None,
) -> None:
    """Add the sections of a closed ring or an arc, with V-joints of ``vjoint_mass`` (kg) each.

    ``fold`` tells where their points are at a complex coordinate (ringsim.layout.pose), ``corners``
    the hinge assemblies by plane (upper, lower) and corner.  Where a structure has several rings,
    ``plane`` is the number of the upper plane, which the lower one follows, and ``prefix`` that of
    the rods' names.  ``errors`` are those of the pins.
    """
    rods = draft.scene.rods
    young, young_bar = (
        spread(rods.young_of(group), geometry.sections).tolist() for group in ("diagonal", "bar")
    )
    strains = errors_of(rods, geometry.sections)
    whole, half = (np.arange(n + 1) / n for n in (2 * rods.elements, rods.elements))
    middle = ((rods.elements, vjoint_mass, "V-joints"),) if vjoint_mass > 0.0 else ()
    tracks: tuple[list[Any], list[Any]] = ([], [])
    for section, normal in enumerate(geometry.normals):
        pins = fold.left[:, section], fold.right[:, section]
        wrong = [_shifts(errors, end, section, geometry) for end in (0, 1)]
        held = [[plane[(section + end) % len(plane)] for plane in corners] for end in (0, 1)]
        diagonals = []
        for name, sides in (("rising", (1, 0)), ("falling", (0, 1))):
            ends = [pins[end][side] for end, side in enumerate(sides)]
            diagonals.append(
                draft.rod(f"{prefix}diagonal_{name}", section, "diagonals", ends, normal,
                          rods.diagonal, whole, young[section],
                          strain=strains[f"diagonal_{name}"][section])
            )  # fmt: skip
            for end, side in enumerate(sides):
                parts = diagonals[-1], held[end][side]
                draft.joint("revolute", "hinge", section, parts, ends[end], error=wrong[end][side])
        draft.joint("revolute", "pivot", section, diagonals, fold.pivots[section])
        for side, (name, sense) in enumerate((("upper", 1.0), ("lower", -1.0))):
            at, bars, track = fold.vjoints[side, section], [], tracks[side]
            for end, name_of_half in enumerate(("left", "right")):
                pin, body = pins[end][side], held[end][side]
                bars.append(
                    draft.rod(f"{prefix}bar_{name}_{name_of_half}", section, "bars",
                              (at, pin) if end else (pin, at), normal, rods.bar, half,
                              young_bar[section], () if end else middle,
                              strains[f"bar_{name}_{name_of_half}"][section])
                )  # fmt: skip
                draft.joint(
                    "revolute", "hinge", section, (bars[end], body), pin, error=wrong[end][side]
                )
                track.append(draft.on(body, pin))
            track.insert(-1, section)
            joint = draft.joint("revolute", "vjoint", section, bars, at)
            draft.opening(plane + side, joint, sense, [0.0, 0.0, sense])
    for side, sense in enumerate((1.0, -1.0)):
        draft.tracks[plane + side] = Track(tracks[side], np.array([0.0, 0.0, -sense]))


def _shifts(
    errors: HingeError | None, end: int, section: int, geometry: RingGeometry
) -> list[Array] | list[None]:
    """By how much the upper and the lower pin at an end of a section stand off, m."""
    if errors is None:
        return [None, None]
    away = geometry.directions[section] * (1.0 - 2.0 * end)
    sides = (getattr(errors, f"{plane}_{('left', 'right')[end]}") for plane in ("upper", "lower"))
    return [spread(value, geometry.sections)[section] * away for value in sides]
