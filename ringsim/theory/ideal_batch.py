"""The equation of motion of many ideal rings with cables.

    I(phi) phi'' + I'(phi) phi'^2 / 2 = Q(phi, phi', t),

Q the generalised force of V-joint loads, net, joints and stops (ringsim.theory.ring_batch) and of
the cables, -sum T dL/dphi (ringsim.theory.batched_chain).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.chain import Chain
from ringsim.cable.records import Cable
from ringsim.cable.ropes import Ropes
from ringsim.cable.state import ChainState
from ringsim.scene import Scene
from ringsim.theory.batched_chain import BatchedChain
from ringsim.theory.cable_batch import CableBatch, stack
from ringsim.theory.ideal_path import PathShape, path_point_rates, path_points
from ringsim.theory.ideal_ring import IdealRing
from ringsim.theory.ring_batch import RingBatch, inertia_series, stack_rings

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Equation:
    """Q and I of a batch; shapes are (samples, instants) unless said otherwise.

    Attributes
    ----------
    ring
        All but the cables.
    cables, chain, ropes
        The cables, and which spans form one rope; None without cables.
    planes
        Planes of each cable: two where both planes have equal cables.
    """

    ring: RingBatch
    cables: CableBatch | None
    chain: BatchedChain | None
    ropes: Ropes | None
    planes: tuple[tuple[int, ...], ...]

    @property
    def copies(self) -> Array:
        """How many cables each one stands for."""
        return np.array([float(len(planes)) for planes in self.planes])

    def take(self, samples: Indices) -> Equation:
        """The same of some samples."""
        cables = None if self.cables is None else self.cables.take(samples)
        return replace(self, ring=self.ring.take(samples), cables=cables)

    def acceleration(
        self, phi: Array, rate: Array, wound: Array, speed: Array, latched: NDArray[np.bool_]
    ) -> Array:
        """Acceleration phi'' in rad/s^2.

        ``wound`` and ``speed`` have the shape (samples, instants, cables, 2).
        """
        inertia, inertia_rate = self.ring.inertias(phi)
        total = self.ring.torque(phi, rate, latched) - 0.5 * inertia_rate * rate**2
        if self.chain is not None and self.cables is not None and self.ropes is not None:
            pull = self.chain.torque(self.cables, self.ropes, phi, rate, wound, speed)
            total += pull @ self.copies
        return np.asarray(total / inertia)

    def paths(self, phi: Array, rate: Array) -> tuple[Array, Array]:
        """Path of each rope and its rate, shape (samples, instants, ropes), m and m/s."""
        if self.chain is None or self.cables is None or self.ropes is None:
            return np.zeros((*phi.shape, 0)), np.zeros((*phi.shape, 0))
        lengths, slopes, _ = self.chain.lengths(self.cables, phi)
        starts = self.ropes.starts
        return (
            np.add.reduceat(lengths, starts, axis=-1),
            np.add.reduceat(slopes * rate[..., None], starts, axis=-1),
        )

    def nudges(self) -> tuple[Array, Array]:
        """Increments of angle and rate over which Q is as good as linear, shape (samples,).

        The tension of a slack rope becomes taut within slack_width / EA of strain, and friction
        turns within the slip speed: a thousandth of that, seen from the ring's coordinate.
        """
        regular = self.ring.joints[:, 0, :, 2].min(axis=-1)
        count = len(regular)
        angle, rate = np.full(count, 1e-6), np.minimum(1e-3 * regular, 1e-4)
        if self.cables is not None:
            c = self.cables
            soft = (c.slack_width / c.axial_stiffness)[:, 0].min(axis=-1)
            angle = np.clip(1e-2 * soft, 1e-9, 1e-6)
            rate = np.minimum(rate, 1e-2 * c.slip_speed[:, 0].min(axis=-1))
        return angle, rate


class Batch:
    """Scenes of one structure, and their equation of motion.

    Attributes
    ----------
    scenes
        The samples.
    cables
        Cables of each scene, one for both planes where they are equal.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.scenes = list(scenes)
        self.planes, self.cables = _distinct(self.scenes)
        known: dict[str, tuple[IdealRing, Array]] = {}
        rings, series = [], []
        for scene in self.scenes:
            key = repr((scene.structure, scene.rods, scene.boom))
            if key not in known:
                ring = IdealRing.of(scene)
                known[key] = ring, inertia_series(ring)
            rings.append(replace(IdealRing.of(scene), geometry=known[key][0].geometry))
            series.append(known[key][1])
        self._geometries = [ring.geometry for ring in rings]
        self._ring = stack_rings(self.scenes, rings, series)
        self._cable_batch: CableBatch | None = None
        self._chain: BatchedChain | None = None
        self._chains: list[Chain] = []
        self.ropes: list[Ropes] = []
        if self.planes:
            shapes = [
                [PathShape.of(g, cable, _distance(s)) for cable in own]
                for g, s, own in zip(self._geometries, self.scenes, self.cables, strict=True)
            ]
            self._cable_batch = stack(
                shapes, self.cables, [s.structure.half_bar for s in self.scenes]
            )
            self._chain = BatchedChain(shapes[0], [cable.friction for cable in self.cables[0]])
            per_cable = self._chain.points_per_cable
            self._chains = [Chain(own, per_cable) for own in self.cables]
            for number, scene in enumerate(self.scenes):
                points = self._points(number, scene.structure.initial_phi)
                self.ropes.append(self._chains[number].start(points))

    def equation(self) -> Equation:
        """The equation with the ropes as they are now."""
        cables = self._cable_batch
        if cables is None:
            return Equation(self._ring, None, None, None, ())
        content = np.array([ropes.content for ropes in self.ropes])
        alive = np.array([ropes.alive for ropes in self.ropes])
        return Equation(
            self._ring,
            cables.with_ropes(content, alive),
            self._chain,
            self.ropes[0],
            self.planes,
        )

    def chain_state(
        self, sample: int, phi: float, rate: float, wound: Array, speed: Array
    ) -> ChainState:
        """One sample's cables as ``ringsim.cable`` describes them; for faults and feedback."""
        geometry = self._geometries[sample]
        turning = geometry.fold_rate(phi)
        velocities = np.concatenate(
            [
                rate * path_point_rates(geometry, turning, planes[0], cable, phi)
                for planes, cable in zip(self.planes, self.cables[sample], strict=True)
            ]
        )
        return self._chains[sample].state(
            self.ropes[sample], self._points(sample, phi), velocities, wound, speed
        )

    def _points(self, sample: int, phi: float) -> Array:
        geometry, distance = self._geometries[sample], _distance(self.scenes[sample])
        fold = geometry.fold(phi)
        return np.concatenate(
            [
                path_points(geometry, fold, planes[0], cable, distance, phi)
                for planes, cable in zip(self.planes, self.cables[sample], strict=True)
            ]
        )


def _distance(scene: Scene) -> float:
    return 0.0 if scene.cables is None else scene.cables.winch_distance


def equal_cables(scene: Scene) -> bool:
    """Whether both planes have cables that pull alike all the time."""
    cables = scene.cables
    alike = cables is not None and cables.upper is not None and cables.upper == cables.lower
    return alike and not scene.faults


def _distinct(
    scenes: Sequence[Scene],
) -> tuple[tuple[tuple[int, ...], ...], list[list[Cable]]]:
    """Planes of each cable that has to be evaluated, and these cables for each scene."""
    if scenes[0].cables is None:
        return (), [[] for _ in scenes]
    present = [[] if s.cables is None else s.cables.present() for s in scenes]
    if all(equal_cables(scene) for scene in scenes):
        return ((0, 1),), [[own[0][1]] for own in present]
    planes = tuple((plane,) for plane, _ in present[0])
    return planes, [[cable for _, cable in own] for own in present]
