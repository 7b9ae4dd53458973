"""The points between which a drawing of a structure has its lines: corners, pins, joints, hub."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import Array, InSpace, Joint, JointOpening, Mount, OnBody, OnRod
from ringsim.layout.layout import Layout
from ringsim.parts.laws import FREE_HUB

HUB, BOOM_TIP = "hub", "boom tip"
"""Points that stand on no body and no rod: the net's hub, the free end of a flexible boom."""
Where = Mount | str
_Key = tuple[Any, ...]
_NEAR = 9
"""Decimals of a metre to which two arms of a body are one place."""


@dataclass(frozen=True)
class Points:
    """Named points of a layout, those of joints that open last, and the lines between them.

    ``mounts`` say what carries each point; ``lines`` are pairs of numbers of points, shape (n, 2),
    by what they are part of; ``openings`` are the numbers of the joints that open, shape (planes,
    sections), or (planes, 0) of a structure that opens otherwise.
    """

    names: tuple[str, ...]
    mounts: tuple[Where, ...]
    lines: dict[str, NDArray[np.int_]]
    openings: NDArray[np.int_]

    @property
    def coordinates(self) -> dict[str, NDArray[np.str_]]:
        """Of the dimensions of ``ringsim.outputs.corners``."""
        return {"point": np.array(self.names), "axis": np.array(["x", "y", "z"])}

    def drawn(self, places: Array, taut_beyond: float | Array = 0.0) -> dict[str, Array]:
        """Ends of lines, shape (lines, 2, 3), m, for points at some places, shape (points, 3), m.

        The net's strings are "net, taut" where longer than ``taut_beyond`` (m, of all or of each),
        or "net, slack"; joints that open are points, lines without a length, "V-joints".
        """
        found = {name: places[pairs] for name, pairs in self.lines.items()}
        if (net := found.pop("net", None)) is not None:
            taut = np.linalg.norm(net[:, 1] - net[:, 0], axis=1) > taut_beyond
            found |= {"net, taut": net[taut], "net, slack": net[~taut]}
        found["V-joints"] = places[np.repeat(self.openings.reshape(-1, 1), 2, axis=1)]
        return {name: ends for name, ends in found.items() if len(ends)}

    def of_body(self, body: int) -> int:
        """The number of the point at the origin of a body, by the body's number."""
        return next(
            number for number, at in enumerate(self.mounts)
            if isinstance(at, OnBody) and at.body == body and not at.arm.any()
        )  # fmt: skip

    def places(self, layout: Layout, openings: Array | None = None) -> Array:
        """Where they stand in a layout, shape (points, 3), m.

        With ``openings``, shape (planes, sections), rad, each joint that opens stands at the depth
        of its own angle, aside of the line between the far ends of its two rods.
        """
        found = np.array([_place(layout, where) for where in self.mounts])
        if openings is None:
            return found
        for (plane, section), number in np.ndenumerate(self.openings):
            opening = layout.openings[plane][section]
            assert isinstance(opening, JointOpening)
            found[number] = _opened(layout, opening, float(openings[plane, section]))
        return found


def points_of(layout: Layout, planes: Sequence[str] = ("upper", "lower")) -> Points:
    """The points of a layout; ``planes`` are the names of its planes.

    Parts that a revolute joins have their point in common.
    """
    root = _roots(layout)
    mounts: dict[_Key, Where] = {}
    for where in _ends(layout):
        mounts.setdefault(root(where), where)
    opening = [
        [root(layout.joints[one.joint].second) for one in plane if isinstance(one, JointOpening)]
        for plane in layout.openings
    ]
    joints = {root(mount): joint for joint in reversed(layout.joints) for mount in _held(joint)}
    bodies, names = _names_of_bodies(layout, planes), dict[_Key, str]()
    for key, where in mounts.items():
        names[key] = _name(layout, bodies, where, joints.get(key))
    for plane, keys in zip(planes, opening, strict=False):
        for section, key in enumerate(keys, 1):
            names[key] = f"{plane} V-joint {section}"
    last = [key for keys in opening for key in keys]
    order = [*(key for key in mounts if key not in set(last)), *last]
    number = {key: k for k, key in enumerate(order)}
    lines: dict[str, list[tuple[int, int]]] = {}
    for group, *ends in _lines(layout):
        first, second = (number[root(end)] for end in ends)
        pairs = lines.setdefault(group, [])
        # Two rods share a pin.
        if first != second and (first, second) not in pairs:
            pairs.append((first, second))
    return Points(
        tuple(_distinct([names[key] for key in order])), tuple(mounts[key] for key in order),
        {group: np.array(pairs) for group, pairs in lines.items() if pairs},
        np.array([[number[key] for key in keys] for keys in opening], dtype=np.int_),
    )  # fmt: skip


def _key(where: Where) -> _Key:
    if isinstance(where, OnBody):
        return ("body", where.body, *(np.round(where.arm, _NEAR) + 0.0).tolist())
    return ("rod", *where) if isinstance(where, OnRod) else (where,)


def _roots(layout: Layout) -> Any:
    """What gives every place the same key as those that revolutes join it to."""
    same: dict[_Key, _Key] = {}

    def root(where: Where) -> _Key:
        key = _key(where)
        while key in same:
            key = same[key]
        return key

    for joint in layout.joints:
        first, *others = dict.fromkeys(root(mount) for mount in _held(joint))
        same |= dict.fromkeys(others, first) if joint.kind == "revolute" else {}
    return root


def _held(joint: Joint) -> list[Mount]:
    return [side for side in (joint.first, joint.second) if not isinstance(side, InSpace)]


def _ends(layout: Layout) -> Iterator[Where]:
    """All places that are points, those first that carry one best."""
    corners = [number for plane in layout.corners for number in plane]
    for number in dict.fromkeys([*corners, *range(len(layout.bodies))]):
        yield OnBody(number)
    for _, *ends in _lines(layout):
        yield from (end for end in ends if isinstance(end, OnRod))
    for _, *ends in _lines(layout):
        yield from ends


def _lines(layout: Layout) -> Iterator[tuple[str, Where, Where]]:
    """Every line with its group: halves of rods, bodies to what hangs on them, boom, net, and pairs
    of other laws.
    """
    for row in layout.halves().values():
        for half in row:
            ends = OnRod(half.rod, half.first), OnRod(half.rod, half.last)
            yield layout.rods[half.rod].group, *ends
    corners = {number for plane in layout.corners for number in plane}
    for joint in layout.joints:
        for side in _held(joint):
            if isinstance(side, OnBody):
                group = "hinge assemblies" if side.body in corners else _group(layout, side.body)
                yield group, OnBody(side.body), side
        # Along a boom there is a line already.
        if (
            joint.kind == "prismatic"
            and isinstance(joint.first, OnBody)
            and joint.first.body not in corners
        ):
            yield _group(layout, joint.first.body), joint.first, joint.second
    for number, body in enumerate(layout.bodies):
        for lump in body.lumps:
            if lump.group == "boom":
                yield "boom", OnBody(number), OnBody(number, 2.0 * lump.centre)
    if layout.boom is not None:
        yield "boom", layout.boom.top, BOOM_TIP
    for law in layout.pair_laws:
        for first, second in law.bodies.tolist():
            yield law.group, OnBody(second), HUB if first == FREE_HUB else OnBody(first)


def _group(layout: Layout, body: int) -> str:
    return next((lump.group for lump in layout.bodies[body].lumps), "body")


def _names_of_bodies(layout: Layout, planes: Sequence[str]) -> list[str]:
    """Hinge assemblies by plane and corner, other bodies by their part."""
    names = [_group(layout, number) for number in range(len(layout.bodies))]
    for plane, row in zip(planes, layout.corners, strict=False):
        for corner, number in enumerate(row, 1):
            names[number] = f"{plane} corner {corner}"
    return names


def _name(layout: Layout, bodies: list[str], where: Where, joint: Joint | None) -> str:
    """As "upper corner 3", "upper corner 3 pin 2" (of section 2), "pivot 2", "hub"."""
    if isinstance(where, str):
        return where
    if isinstance(where, OnBody) and not where.arm.any():
        return bodies[where.body]
    held = [] if joint is None else [side for side in _held(joint) if isinstance(side, OnBody)]
    if joint is not None and held:
        return f"{bodies[held[0].body]} pin {joint.section + 1}"
    if joint is not None:
        return f"{joint.family or 'joint'} {joint.section + 1}"
    if isinstance(where, OnBody):
        return f"{bodies[where.body]} tip"
    assert isinstance(where, OnRod)
    rod = layout.rods[where.rod]
    return f"{rod.name} {rod.section + 1} {'start' if where.station == 0 else 'end'}"


def _distinct(names: Sequence[str]) -> Iterator[str]:
    """Names with a number behind those that are there already."""
    seen: dict[str, int] = {}
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        yield name if seen[name] == 1 else f"{name} ({seen[name]})"


def _place(layout: Layout, where: Where) -> Array:
    if where == HUB:
        assert layout.hub is not None
        return layout.hub.place
    if where == BOOM_TIP:
        assert layout.boom is not None
        return layout.pose(layout.boom.top).at(2.0 * layout.boom.lump.centre)[0]
    assert not isinstance(where, str)
    return layout.pose(where).place


def _opened(layout: Layout, opening: JointOpening, angle: float) -> Array:
    """Where a joint between two rods of one length stands at an opening angle (rad): (3,), m; one
    on a body as the body does.
    """
    joint = layout.joints[opening.joint]
    first, second = joint.first, joint.second
    if not isinstance(first, OnRod) or not isinstance(second, OnRod):
        return layout.pose(second).place
    rod, other = layout.rods[first.rod], layout.rods[second.rod]
    start, end = rod.start.place, other.end.place
    chord = (end - start) / np.linalg.norm(end - start)
    aside = -opening.sense * np.cross(rod.start.axes[:, 2], chord)
    return np.asarray(0.5 * (start + end) + rod.length * np.cos(0.5 * angle) * aside)
