"""The ideal ring: rigid rods, one coordinate phi, exact inertia and potential.

With rigid rods every point is a function of the bar angle phi (see ringsim.geometry.ring), so

    I(phi) phi'' + I'(phi) phi'^2 / 2 = dW/dphi,

I = sum m |dr/dphi|^2 over all masses with the rigid-body motion taken out, W the work of the
V-joint forces less the energy of the net.  A free ring keeps momentum and angular momentum at
zero: the rates r' are reduced by the rigid motion V + Omega x r that does so.  A ring whose boom
is fixed has the rates relative to the boom's hinge assembly instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.geometry.ring import Fold, RingGeometry
from ringsim.parts.net import Net
from ringsim.parts.persection import spread
from ringsim.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Rates after phi of one fold state.

    Attributes
    ----------
    inertia
        I(phi) in kg m^2.
    velocity, rotation
        Rigid motion to be subtracted from the rates of ``RingGeometry.fold_rate``: a point at r
        moves with r' - velocity - rotation x r.  Shapes (3,); m/rad and rad/rad.

    """

    inertia: float
    velocity: Array
    rotation: Array


@dataclass(frozen=True)
class IdealRing:
    """Masses, forces and net of a ring with rigid rods."""

    geometry: RingGeometry
    corner_mass: float
    corner_inertia: float
    vjoint_mass: float
    diagonal: tuple[float, float]
    """Mass per length (kg/m) and transverse rotary inertia per length (kg m) of a diagonal."""
    bar: tuple[float, float]
    """The same of a bar half."""
    boom: tuple[float, float] | None
    """Mass and length of the boom, if any."""
    fixed: bool
    force: Array
    """Force on the V-joints of each section, shape (sections,)."""
    net: Net | None

    @classmethod
    def of(cls, scene: Scene) -> IdealRing:
        """The ideal ring of a scene; joint friction and stops are left out."""
        ring, rods, boom = scene.structure, scene.rods, scene.boom
        force = 0.0 if scene.loads is None else scene.loads.force
        return cls(
            geometry=ring.geometry(),
            corner_mass=ring.corner_mass,
            corner_inertia=ring.corner_mass * ring.hinge_size**2 / 6.0,
            vjoint_mass=ring.vjoint_mass,
            diagonal=(
                rods.density * rods.diagonal.area,
                rods.density * rods.diagonal.second_moment,
            ),
            bar=(rods.density * rods.bar.area, rods.density * rods.bar.second_moment),
            boom=None if boom is None else (boom.mass, boom.length),
            fixed=boom is not None and boom.base == "fixed",
            force=spread(force, ring.sections),
            net=scene.net,
        )

    def motion(self, phi: float) -> Motion:
        """Inertia and rigid-body part of the motion at the bar angle ``phi`` (rad)."""
        fold, rate = self.geometry.fold(phi), self.geometry.fold_rate(phi)
        masses, points, rates = self._point_masses(fold, rate)
        spin_energy, spin_momentum, spin_tensor = self._spin(phi, fold)
        if self.fixed:
            anchor = rate.corners[0, 0]
            moving = rates - anchor
            inertia = float(np.sum(masses * np.sum(moving**2, axis=1))) + spin_energy
            return Motion(inertia, anchor, np.zeros(3))
        total = masses.sum()
        momentum = masses @ rates
        centre = masses @ points / total
        arms = points - centre
        angular = np.cross(arms, masses[:, None] * rates).sum(axis=0) + spin_momentum
        square = np.sum(arms**2, axis=1)
        tensor = (
            np.sum(masses * square) * np.eye(3)
            - np.einsum("i,ij,ik->jk", masses, arms, arms)
            + spin_tensor
        )
        rotation = np.linalg.solve(tensor, angular)
        inertia = float(
            np.sum(masses * np.sum(rates**2, axis=1))
            + spin_energy
            - momentum @ momentum / total
            - angular @ rotation
        )
        velocity = momentum / total - np.cross(rotation, centre)
        return Motion(inertia, velocity, rotation)

    def work(self, phi: float) -> float:
        """Work function W(phi) in J, up to a constant."""
        fold = self.geometry.fold(phi)
        height = fold.vjoints[0, :, 2] - fold.vjoints[1, :, 2]
        return float(self.force @ height) - self._net_energy(fold)

    def work_rate(self, phi: float) -> float:
        """Generalised force dW/dphi in J/rad."""
        fold, rate = self.geometry.fold(phi), self.geometry.fold_rate(phi)
        height = rate.vjoints[0, :, 2] - rate.vjoints[1, :, 2]
        return float(self.force @ height) - self._net_energy_rate(fold, rate)

    def acceleration_from_rest(self, phi: float) -> float:
        """Phi'' in rad/s^2 of the ring released at rest."""
        return self.work_rate(phi) / self.motion(phi).inertia

    def _point_masses(self, fold: Fold, rate: Fold) -> tuple[Array, Array, Array]:
        """Masses, positions and rates; Simpson's rule is exact for the rods."""
        masses: list[Array] = []
        points: list[Array] = []
        rates: list[Array] = []

        def add(mass: float, place: Array, speed: Array) -> None:
            place, speed = place.reshape(-1, 3), speed.reshape(-1, 3)
            masses.append(np.full(len(place), mass))
            points.append(place)
            rates.append(speed)

        def rod(mass: float, ends: tuple[Array, Array], speeds: tuple[Array, Array]) -> None:
            add(mass / 6.0, ends[0], speeds[0])
            add(mass / 6.0, ends[1], speeds[1])
            add(4.0 * mass / 6.0, 0.5 * (ends[0] + ends[1]), 0.5 * (speeds[0] + speeds[1]))

        add(self.corner_mass, fold.corners, rate.corners)
        add(self.vjoint_mass, fold.vjoints, rate.vjoints)
        diagonal = self.diagonal[0] * 2.0 * self.geometry.half_diagonal
        bar = self.bar[0] * self.geometry.half_bar
        rod(diagonal, (fold.left[0], fold.right[1]), (rate.left[0], rate.right[1]))
        rod(diagonal, (fold.left[1], fold.right[0]), (rate.left[1], rate.right[0]))
        rod(bar, (fold.left, fold.vjoints), (rate.left, rate.vjoints))
        rod(bar, (fold.vjoints, fold.right), (rate.vjoints, rate.right))
        if self.boom is not None:
            mass, length = self.boom
            top, speed = fold.corners[0, 0], rate.corners[0, 0]
            rod(mass, (top, top - [0.0, 0.0, length]), (speed, speed))
        return np.concatenate(masses), np.concatenate(points), np.concatenate(rates)

    def _spin(self, phi: float, fold: Fold) -> tuple[float, Array, Array]:
        """Energy, momentum and tensor of the cross-sections' own rotation, per unit rate.

        All rods of a section turn about its normal, mirrored pairs against each other, so their
        spin momenta cancel.
        """
        ring = self.geometry
        turn = -2.0 * ring.half_bar * np.sin(phi) / ring.height(phi)
        length = {"diagonal": 2.0 * ring.half_diagonal, "bar": ring.half_bar}
        energy = ring.sections * (
            4.0 * self.bar[1] * length["bar"]
            + 2.0 * self.diagonal[1] * length["diagonal"] * turn**2
        )
        tensor = np.eye(3) * self.corner_inertia * fold.corners.shape[1] * 2.0
        for inertia, start, end in (
            (self.diagonal[1], fold.left[0], fold.right[1]),
            (self.diagonal[1], fold.left[1], fold.right[0]),
            (self.bar[1], fold.left.reshape(-1, 3), fold.vjoints.reshape(-1, 3)),
            (self.bar[1], fold.vjoints.reshape(-1, 3), fold.right.reshape(-1, 3)),
        ):
            axis = end - start
            reach = np.linalg.norm(axis, axis=1)
            unit = axis / reach[:, None]
            tensor += inertia * (
                reach.sum() * np.eye(3) + np.einsum("i,ij,ik->jk", reach, unit, unit)
            )
        return float(energy), np.zeros(3), tensor

    def _net_stretch(self, fold: Fold, net: Net) -> tuple[Array, Array, Array]:
        corners = fold.corners[0]
        arms = corners - corners.mean(axis=0)
        lengths = np.linalg.norm(arms, axis=1)
        stretch = lengths - net.neutral_length
        if not net.two_sided:
            stretch = np.maximum(stretch, 0.0)
        return spread(net.stiffness, len(corners)), stretch, arms / lengths[:, None]

    def _net_energy(self, fold: Fold) -> float:
        if self.net is None:
            return 0.0
        rates, stretch, _ = self._net_stretch(fold, self.net)
        return 0.5 * float(rates @ stretch**2)

    def _net_energy_rate(self, fold: Fold, rate: Fold) -> float:
        if self.net is None:
            return 0.0
        rates, stretch, units = self._net_stretch(fold, self.net)
        corners = rate.corners[0]
        speed = np.sum(units * (corners - corners.mean(axis=0)), axis=1)
        return float(rates @ (stretch * speed))
