"""The straight lines that make up a drawing of a structure."""

from itertools import chain
from typing import Any

import numpy as np

from ringsim.layout.bodies import OnBody, OnRod
from ringsim.layout.joints import JointOpening
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array


def lines_of(layout: Layout, openings: Array, *, taut_beyond: float = 0.0) -> dict[str, Array]:
    """End points of lines, shape (lines, 2, 3), m, by group: those of the rods, "hinge assemblies",
    "boom", "net, taut" (springs longer than ``taut_beyond``, m) and "net, slack".  Lines of
    "V-joints" are points, one for each of ``openings``, in their order.

    Everything stands as the layout, at the mean opening angle, says, centred on the vertical axis,
    but for the joints that open: each stands at the depth of its own opening angle (``openings``,
    shape (planes, sections), rad), aside of the line between the far ends of its two rods.
    """
    ends = {
        (number, station): rod.station(share).place
        for number, rod in enumerate(layout.rods)
        for station, share in enumerate(rod.stations)
    }
    found: dict[str, list[Any]] = {}
    for plane, angles in zip(layout.openings, openings, strict=True):
        for opening, angle in zip(plane, angles, strict=True):
            if isinstance(opening, JointOpening):
                at = _open(layout, ends, opening, float(angle))
                found.setdefault("V-joints", []).append((at, at))
    for half in chain.from_iterable(layout.halves().values()):
        line = ends[half.rod, half.first], ends[half.rod, half.last]
        found.setdefault(layout.rods[half.rod].group, []).append(line)
    corners, pins = {number for plane in layout.corners for number in plane}, {}
    for joint in layout.joints:
        for mount in (joint.first, joint.second):
            if isinstance(mount, OnBody) and mount.body in corners and joint.family:
                place = layout.pose(mount).place
                # Two rods share a pin.
                pins[mount.body, *np.round(place, 9)] = layout.bodies[mount.body].pose.place, place
    found["hinge assemblies"] = list(pins.values())
    lumps = [(body.pose, lump) for body in layout.bodies for lump in body.lumps]
    if layout.boom is not None:
        lumps.append((layout.pose(layout.boom.top), layout.boom.lump))
    for pose, lump in lumps:
        if lump.group == "boom":
            found["boom"] = [(pose.place, pose.at(2.0 * lump.centre)[0])]
    if layout.net is not None:
        for number in layout.net.bodies:
            line = layout.bodies[number].pose.place, layout.net.hub
            taut = np.linalg.norm(line[0] - line[1]) > taut_beyond
            found.setdefault("net, taut" if taut else "net, slack", []).append(line)
    places = np.array([body.pose.place for body in layout.bodies])
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0)) * [1.0, 1.0, 0.0]
    return {name: np.array(lines) - middle for name, lines in found.items() if lines}


def _open(
    layout: Layout, ends: dict[tuple[int, int], Array], opening: JointOpening, angle: float
) -> Array:
    """Move a joint between two rods of one length to where its opening angle puts it: (3,), m."""
    joint = layout.joints[opening.joint]
    first, second = joint.first, joint.second
    assert isinstance(first, OnRod)
    assert isinstance(second, OnRod)
    rod = layout.rods[first.rod]
    start, end = ends[first.rod, 0], ends[second.rod, len(layout.rods[second.rod].stations) - 1]
    chord = (end - start) / np.linalg.norm(end - start)
    aside = -opening.sense * np.cross(rod.start.axes[:, 2], chord)
    at: Array = 0.5 * (start + end) + rod.length * np.cos(0.5 * angle) * aside
    ends[first.rod, first.station] = ends[second.rod, second.station] = at
    return at
