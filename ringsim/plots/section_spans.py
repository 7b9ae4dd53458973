"""Spans and pulleys of a cable section by section, on the ideal geometry of a section."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.scene import scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing

Array = NDArray[np.floating[Any]]
NODES = ("first hinge", "V", "second hinge")
"""Where a section has pulleys, from the winch on."""
COMPONENTS = ("along", "inwards", "across")
"""Of forces: away from the winch along the section's bars, from its plane towards the other one,
and to the right of someone who goes that way and has z above (in a ring away from its middle, if it
is run through counter-clockwise)."""


@dataclass(frozen=True)
class SectionSpans:
    """Of one cable, sections in the order from its winch; arrays have the shape (section, time).

    Between its hinge pulleys a section has an entry span to its V pulley and a span behind that.
    """

    cable: Cable
    pulleys: int
    """Of the whole cable."""
    arriving: Array
    entry: Array
    behind: Array
    after: Array
    """Tensions in N: in the span to the first hinge pulley, in both spans of the section, in the
    next span; where the cable ends at the second hinge, again the one behind the V pulley."""
    lengths: tuple[Array, Array]
    """Of the spans before and behind the V pulley, m."""
    level: tuple[Array, Array]
    """The part of each that is along the section, m."""
    drop: Array
    """How far inwards of the hinge pulleys the V pulley stands, m."""
    half_turns: tuple[Array, Array]
    """Angles (rad) by which the spans on the hinge assemblies before and behind a section are
    turned from its direction, to the right positive, shape (section,); NaN where there is none."""


def section_spans(dataset: xr.Dataset, plane: str) -> SectionSpans:
    """What the opening angles and tensions of a recorded run of a ring say of a cable's sections.

    Nothing else is taken from the run: hinge pulleys stand in one line along each section, and its
    V pulley where ``ringsim.cable.bracket`` puts it at the section's opening angle.  ``dataset``
    has ``cable_tension`` and ``opening_angle``; ``plane`` is one with a cable.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    ring = scene.structure
    assert isinstance(ring, PantographRing)
    cable = getattr(scene.cables, plane)
    backwards = cable.end == "last"
    order = slice(None, None, -1 if backwards else 1)
    own = dataset.sel(plane=plane)
    opening = np.radians(own["opening_angle"].transpose("section", "time").values[order])
    pulleys = scene.pulleys_of(cable)
    spans = own["cable_tension"].transpose("span", "time").values[: pulleys + 1]
    arriving, entry, behind = (spans[first::3][: len(opening)] for first in range(3))
    fold = 0.5 * (np.pi - opening)
    aside, inward = cable.bracket.place(fold, cable.block_offset)
    aside = -aside if backwards else aside
    reach = ring.half_bar * np.cos(fold)
    lengths = cable.bracket.spans(ring.half_bar, cable.block_offset, opening)[order]
    directions = ring.geometry().directions[order] * (-1.0 if backwards else 1.0)
    turned = np.array([
        np.arctan2(np.cross(one, other)[2], one @ other)
        for one, other in pairwise(directions)
    ])  # fmt: skip
    # Halfway between both sections' directions: behind the one, before the other.
    return SectionSpans(
        cable, pulleys, arriving, entry, behind, np.concatenate([arriving[1:], spans[-1:]]),
        lengths, (reach + aside, reach - aside), ring.half_bar * np.sin(fold) + inward,
        (np.append(np.nan, 0.5 * turned), np.append(-0.5 * turned, np.nan)),
    )  # fmt: skip


def pulley_forces(dataset: xr.Dataset, plane: str) -> xr.DataArray:
    """Forces of a cable on its pulleys, from measured angles and tensions alone.

    The sum of the two pulls on a pulley, T_behind u_behind - T_before u_before: with the
    inclination gamma of the spans of eq. 20 they are paper 000's eqs 28 to 31 with the signs of
    docs/cables.md.  The rope comes to the first pulley, and goes to a winch at its other end, along
    the boom; where it ends at the last hinge, the force is on its end.

    Returns
    -------
    xr.DataArray
        In N, over (section, node, component, time), sections in the order from the winch; see
        ``NODES`` and ``COMPONENTS``.
    """
    at = section_spans(dataset, plane)
    cos_entry, cos_behind = (np.divide(*each) for each in zip(at.level, at.lengths, strict=True))
    sin_entry, sin_behind = (at.drop / length for length in at.lengths)
    found = np.zeros((len(at.entry), len(NODES), len(COMPONENTS), at.entry.shape[1]))
    found[:, 0, 0], found[:, 0, 1] = at.entry * cos_entry, at.entry * sin_entry
    found[:, 1, 0] = at.behind * cos_behind - at.entry * cos_entry
    found[:, 1, 1] = -at.behind * sin_behind - at.entry * sin_entry
    found[:, 2, 0], found[:, 2, 1] = -at.behind * cos_behind, at.behind * sin_behind
    turn = [angle[:, None] for angle in at.half_turns]
    found[1:, 0, 0] -= (at.arriving * np.cos(turn[0]))[1:]
    found[1:, 0, 2] -= (at.arriving * np.sin(turn[0]))[1:]
    found[:-1, 2, 0] += (at.after * np.cos(turn[1]))[:-1]
    found[:-1, 2, 2] += (at.after * np.sin(turn[1]))[:-1]
    found[0, 0, 1] += at.arriving[0]
    if at.cable.end == "both":
        found[-1, 2, 1] += at.after[-1]
    coordinates = {
        "node": list(NODES), "component": list(COMPONENTS), "time": dataset["time"]
    }  # fmt: skip
    words = {"long_name": "force of the cable on a pulley", "units": "N"}
    dims = ("section", "node", "component", "time")
    return xr.DataArray(found, coordinates, dims, "nodal_force", words)
