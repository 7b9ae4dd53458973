"""What outputs read of a state: one instant of a run, and what an engine tells of it when asked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.chain import ChainState
from ringsim.layout.layout import Layout
from ringsim.layout.points import points_of
from ringsim.parts.laws import Switches
from ringsim.scene import Scene
from ringsim.scene.substituted import strained
from ringsim.stepping.instant import Array, Energies, Instant

Places = tuple[tuple[int, int], ...]
"""Elements of rods, each told by its rod and its place in the rod."""


class Bodies(NamedTuple):
    """Bodies of a layout in a state: places of their origins (m) and their velocities (m/s), shape
    (bodies, 3), and their axes, rotation matrices of shape (bodies, 3, 3).
    """

    places: Array
    velocities: Array
    axes: Array


class Meters:
    """Measures the state that a run goes on from.

    An engine gives the methods that raise here; the others follow from these.  Nothing is measured
    unless an output asks for it, so that a run pays for what its scene records alone.  What is told
    is of the state that was read last, ``now``.
    """

    now: Instant

    def __init__(self, scene: Scene, layout: Layout) -> None:
        self.scene, self.layout = scene, layout

    # What an engine gives.

    @property
    def switches(self) -> Switches:
        """Which laws act on V-joints."""
        raise NotImplementedError

    def bodies(self) -> Bodies:
        """Of the whole layout."""
        raise NotImplementedError

    def accelerations(self) -> Array:
        """Of the bodies' origins, shape (bodies, 3), m/s^2; asked for if a scene records them."""
        raise NotImplementedError

    def points(self) -> Array:
        """Places (m) and velocities (m/s) of ``points_of`` the layout, shape (points, 2, 3)."""
        raise NotImplementedError

    def section_forces(self, places: Places, *, damped: bool) -> tuple[Array, Array]:
        """Forces (N) and moments (N m) in the middle of elements, in their axes, shape (3,
        elements) each; with those of damping or without.
        """
        raise NotImplementedError

    def rod_energy(self) -> float:
        """Elastic energy of the rods, J."""
        raise NotImplementedError

    def reaction(self) -> Array | None:
        """Force (N) and torque (N m) of the base on the structure about the base's origin, shape
        (2, 3); None of a base that floats alone.
        """
        raise NotImplementedError

    def spin(self) -> Array:
        """Angular velocity of the spacecraft, shape (3,), rad/s, in axes that do not turn."""
        raise NotImplementedError

    # What follows.

    def coordinates(self) -> dict[str, NDArray[Any]]:
        """Values of the dimensions that outputs declare themselves."""
        record, corners = self.scene.record, self.layout.corners
        found: dict[str, NDArray[Any]] = {"rod": np.array(list(self.layout.halves()))}
        if record.positions:
            found |= points_of(self.layout, self.scene.structure.planes).coordinates
        if record.accelerations or record.shape or strained(self.scene):
            found["corner"] = np.arange(1, len(corners[0]) + 1)
        if self._gauge is not None:
            rod = self.layout.rods[self._gauge]
            found["station"] = np.array(rod.stations) * rod.length
        return found

    def corners(self, of_bodies: Array) -> Array:
        """Values of bodies for the corners, shape (planes, corners, ...)."""
        return np.asarray(of_bodies[np.array(self.layout.corners)])

    def stress(self) -> Array:
        """Stress |N| / A + |M| r / I of every rod half, shape (rod halves, sections), Pa: the
        larger of its two ends.

        Elements tell force and moment of their middle; along them the moment follows the shear
        force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
        """
        shape, places, (x, area, per_moment) = self._ends
        force, torque = self.section_forces(places, damped=True)
        moment = np.hypot(torque[1] + force[2] * x, torque[2] - force[1] * x)
        stress = np.abs(force[0]) / area + moment * per_moment
        return np.asarray(stress.reshape(shape).max(axis=2))

    def strain(self) -> Array:
        """Bending strain of the outer fibre of the rod with the gauge at its nodes, on the side of
        its y axis's negative, shape (nodes,).

        Where two elements meet their moments differ by what turns the node alone; their mean
        counts.
        """
        assert self._gauge is not None
        rod = self.layout.rods[self._gauge]
        places = tuple((self._gauge, k) for k in range(len(rod.lengths)))
        force, torque = self.section_forces(places, damped=False)
        change = 0.5 * force[1] * rod.lengths
        first, last = torque[2] + change, torque[2] - change
        at_nodes = np.concatenate([first[:1], 0.5 * (first[1:] + last[:-1]), last[-1:]])
        bending = rod.young_modulus * rod.tube.second_moment
        return np.asarray(-0.5 * rod.tube.outer_diameter / bending * at_nodes)

    def turn(self) -> Array | None:
        """Rotation matrix of the base since the start; None without a base."""
        base = self.layout.base
        if base is None:
            return None
        return np.asarray(self.bodies().axes[base] @ self.layout.bodies[base].pose.axes.T)

    def net(self) -> Array:
        """Tension of the cables along a net's edge, shape (planes, sections), N; NaN in planes
        without.
        """
        law = next(law for law in self.layout.pair_laws if law.places)
        places, velocities, _ = self.bodies()
        openings = self.layout.openings
        return law.tensions(places, velocities, (len(openings), len(openings[0])))

    def reading(self, now: Instant, chain: ChainState | None, cables: Any) -> "Reading":
        """What outputs read of an instant in this state, with its ropes and the model's cables."""
        self.now = now
        planes = () if cables is None else tuple((plane,) for plane, _ in cables.present)
        told = None if cables is None else cables.winches.commands
        return Reading(**vars(now), meters=self, chain=chain, planes=planes, commands=told)

    @cached_property
    def _gauge(self) -> int | None:
        """Number of the rod with the gauge, None without."""
        name, rods = self.scene.structure.gauge, self.layout.rods
        return next(k for k, rod in enumerate(rods) if rod.name == name) if name else None

    @cached_property
    def _ends(self) -> tuple[tuple[int, int, int], Places, Array]:
        """Shape and elements of the ends of rod halves; of each the distance of the end from the
        element's middle (m), by what force is divided (m^2) and moment multiplied (1/m^3).
        """
        rows: Sequence[Sequence[Any]] = [*self.layout.halves().values()]
        places, numbers = [], []
        for half in (half for row in rows for half in row):
            rod = self.layout.rods[half.rod]
            per_moment = 0.5 * rod.tube.outer_diameter / rod.tube.second_moment
            for k, end in ((half.first, -0.5), (half.last - 1, 0.5)):
                places.append((half.rod, k))
                numbers.append((end * rod.lengths[k], rod.tube.area, per_moment))
        return (len(rows), len(rows[0]), 2), tuple(places), np.array(numbers).T


@dataclass(frozen=True, kw_only=True)
class Reading(Instant):
    """An instant with all that outputs read; to them its energies tell ``work`` with what the
    winches put in, and ``lost``, since the start.
    """

    meters: Meters
    """What else there is to tell of the state."""
    chain: ChainState | None = None
    """All cables; None if the scene has none."""
    planes: tuple[tuple[int, ...], ...] = ()
    """Planes of each cable of the chain: one may stand for two cables that pull alike."""
    commands: Array | None = None
    """Speeds that winches are told, m/s, shape (cables, 2), NaN of those that take no commands;
    None without cables."""

    def by_plane(self, of_cables: NDArray[Any], behind: int = 0) -> Array:
        """Numbers for each plane, from those of each cable, an axis with so many behind it; NaN
        where a plane has no cable.
        """
        own = np.moveaxis(of_cables, -1 - behind, 0)
        found = np.full((self.angles.shape[-2], *own.shape[1:]), np.nan)
        for planes, value in zip(self.planes, own, strict=True):
            found[list(planes)] = value
        return np.moveaxis(found, 0, -1 - behind)

    def by_place(self, of_cables: Array, edges: Sequence[int]) -> Array:
        """Values for each plane, shape (..., planes, places), from those of all cables behind one
        another, shape (..., places), which begin at the ``edges``; NaN where a plane has no cable
        or one of fewer places.
        """
        most = max(b - a for a, b in pairwise(edges))
        found = np.full((*of_cables.shape[:-1], self.angles.shape[-2], most), np.nan)
        for planes, (first, last) in zip(self.planes, pairwise(edges), strict=True):
            for plane in planes:
                found[..., plane, : last - first] = of_cables[..., first:last]
        return found

    def stop_torques(self) -> Array | None:
        """Torque of the stop on every V-joint, shape (planes, sections), N m; None without."""
        return self.meters.switches.torques("stop", np.pi - self.angles, -self.rates)


def together(steps: Sequence[Reading], energies: Sequence[Energies]) -> Reading:
    """What was read at many instants with the same ropes, with energies since the start, as one
    reading: what changes stands along the first axis; ``meters`` look at another state by now.
    """
    first, changed = steps[0], dict[str, Any]()
    for name in ("time", "angles", "rates", "gap", "commands"):
        if getattr(first, name) is not None:
            changed[name] = np.array([getattr(one, name) for one in steps])
    changed["energies"] = Energies(*np.array(energies).T)
    if first.chain is not None:
        numbers = np.array([one.chain.numbers for one in steps if one.chain is not None])
        changed["chain"] = replace(first.chain, numbers=numbers)
    return replace(first, **changed)
