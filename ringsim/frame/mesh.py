"""A layout in joint coordinates as arrays, for compiled code."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ringsim.frame.parts import Indices, Parts
from ringsim.frame.skeleton import Element, Skeleton, inertia_of
from ringsim.layout.layout import SPACECRAFT
from ringsim.layout.pose import Array
from ringsim.layout.stiffness import stiffness_of
from ringsim.parts.rods.family import Rods


class Mesh(NamedTuple):
    """Arrays of what does not change in a run; e elements, f frames, a angles, p points.

    Of the ends of elements: frame, angle (-1: none), axes in the frame, number of the point
    there; lengths (m), stiffness of u and psi, shape (e, 6), and masses (``inertia_of``).
    Points with mass: frame, place in it and mass beside that of the elements.  ``home`` and
    ``angle_home`` are the unknowns of frames (the first of six) and angles; ``part`` the front of
    each element, ``local`` its unknowns (x, phi, angle by end) there, -1 for none.
    Fronts (see ``ringsim.frame.elimination``), those of the parts first and then one a block:
    number of unknowns that go, of all, their places in the system (``spots``, -1 behind the last),
    the front that takes the rest and where (``up``).  ``fixed`` unknowns do not move.
    """

    frame: Indices
    angle: Indices
    axes: Array
    point: Indices
    length: Array
    stiffness: Array
    mass: Array
    tau: Array
    point_frame: Indices
    point_arm: Array
    point_mass: Array
    home: Indices
    angle_home: Indices
    part: Indices
    local: Indices
    angle_local: Indices
    """Front of each angle and its place there, shape (a, 2)."""
    frame_local: Indices
    """Front of each frame and the place of its first unknown there, shape (f, 2)."""
    gone: Indices
    size: Indices
    spots: Indices
    parent: Indices
    up: Indices
    fixed: Indices
    craft: Indices
    """Points of the spacecraft, four or none."""
    unknowns: int


def mesh_of(
    skeleton: Skeleton, rods: Rods, boom: Sequence[Element] = (), touching: Sequence[int] = ()
) -> tuple[Mesh, Parts]:
    """The arrays of a skeleton, with elements of a boom, which bodies ``touching`` it hold.

    InputError if the structure is not a chain of corners with parts between neighbours.
    """
    layout, elements = skeleton.layout, []
    for number, rod in enumerate(layout.rods):
        for k, (drawn, length) in enumerate(zip(rod.lengths, rod.natural_lengths, strict=True)):
            ends = skeleton.end(number, k), skeleton.end(number, k + 1)
            mass = inertia_of(rod.density, rod.tube, float(drawn))
            stiffness = stiffness_of(rod, rods, float(length))
            elements.append(Element(*ends, float(length), stiffness, mass))
    elements += boom
    parts, points = Parts(skeleton, elements, touching), _Points()
    pairs = [(element.first, element.second) for element in elements]
    point = np.array([[points.at(end.frame, end.arm) for end in pair] for pair in pairs])
    for number, rod in enumerate(layout.rods):
        for station, own, _ in rod.masses:
            end = skeleton.end(number, station)
            points.add(end.frame, end.arm, own)
    for number, body in enumerate(layout.bodies):
        craft = [lump for lump in body.lumps if lump.group == SPACECRAFT]
        rest = replace(body, lumps=tuple(lump for lump in body.lumps if lump not in craft))
        for arm in tetrahedron(rest.mass, rest.centre, rest.inertia):
            points.add(number, arm, 0.25 * rest.mass)
        # A spacecraft has points of its own: what they weigh is what it feels.
        for lump in craft:
            for arm in tetrahedron(lump.mass, lump.centre, lump.inertia):
                points.craft.append(points.add(number, arm, 0.25 * lump.mass))
    local = [
        parts.local(int(part), [(end.frame, end.angle) for end in pair])
        for part, pair in zip(parts.of_element, pairs, strict=True)
    ]

    def ends_of(name: str, dtype: Any) -> Any:
        return np.array([[getattr(end, name) for end in pair] for pair in pairs], dtype=dtype)

    mesh = Mesh(
        frame=ends_of("frame", np.int64),
        angle=ends_of("angle", np.int64),
        axes=ends_of("axes", float),
        point=point,
        length=np.array([element.length for element in elements]),
        stiffness=np.array([element.stiffness for element in elements]),
        mass=np.array([element.mass for element in elements]),
        # The boom's elements come last, and are not damped.
        tau=np.repeat([rods.damping, 0.0], [len(elements) - len(boom), len(boom)]),
        point_frame=np.array(points.frames),
        point_arm=np.array(points.arms),
        point_mass=np.array(points.masses),
        home=parts.home,
        angle_home=parts.angle_home,
        part=parts.of_element,
        local=np.array(local),
        angle_local=np.array([parts.front_of(int(k)) for k in parts.angle_home]).reshape(-1, 2),
        frame_local=np.array([parts.front_of(int(k)) for k in parts.home]),
        gone=parts.gone,
        size=parts.size,
        spots=parts.spots,
        parent=parts.parent,
        up=parts.up,
        fixed=np.array(
            [int(parts.home[body]) + k for body in skeleton.fixed for k in range(6)], dtype=np.int64
        ),
        craft=np.array(points.craft, dtype=np.int64),
        unknowns=parts.unknowns,
    )
    return mesh, parts


def tetrahedron(mass: float, centre: Array, inertia: Array) -> Array:
    """Places of four equal masses with a body's mass, centre and inertia about its origin: (4, 3).

    They stand at c + sum +- r_k n_k with r_k^2 = e_k / m, e_k and n_k the principal values and
    directions of the second moments about c, and signs of the corners of a tetrahedron in a cube.
    """
    seconds = 0.5 * np.trace(inertia) * np.eye(3) - inertia - mass * np.outer(centre, centre)
    values, axes = np.linalg.eigh(seconds)
    arms = axes * np.sqrt(np.maximum(values, 0.0) / mass)
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return np.asarray(centre + signs @ arms.T)


class _Points:
    """Points with mass; those of one frame at one place are one."""

    def __init__(self) -> None:
        self.frames: list[int] = []
        self.arms: list[Array] = []
        self.masses: list[float] = []
        self._known: dict[tuple[int, ...], int] = {}
        self.craft: list[int] = []

    def at(self, frame: int, arm: Array) -> int:
        key = (frame, *(round(1e9 * x) for x in arm.tolist()))
        if key not in self._known:
            self._known[key] = len(self.frames)
            self.frames.append(frame)
            self.arms.append(np.asarray(arm, dtype=float))
            self.masses.append(0.0)
        return self._known[key]

    def add(self, frame: int, arm: Array, mass: float) -> int:
        self.masses[self.at(frame, arm)] += mass
        return self.at(frame, arm)
