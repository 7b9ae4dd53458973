"""The ideal ring as one coordinate phi: inertia, potential, and its release from rest.

With rigid rods every point is a function of the bar angle phi, so

    I(phi) phi'' + I'(phi) phi'^2 / 2 = dW/dphi,

I = sum m |dr/dphi|^2 over all masses with the rigid-body motion taken out, W the work of the
V-joint forces less the energy of the net.  A free ring keeps momentum and angular momentum at
zero (its loads turn with it here; ringsim.theory.ideal_motion keeps them vertical); a fixed boom
holds its hinge assembly.  The end assemblies of an open arc are held upright, as they are at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.geometry.ring import RingGeometry
from ringsim.scene import Scene
from ringsim.theory.ideal_forces import Acting, Forces
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import UP

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

    mechanism: Mechanism
    forces: Forces

    @classmethod
    def of(cls, scene: Scene) -> IdealRing:
        """The ideal ring of a scene; joint friction, stops and cables are left out."""
        mechanism = Mechanism(scene)
        return cls(mechanism, Forces(scene, mechanism))

    @property
    def geometry(self) -> RingGeometry:
        """Its fold states."""
        return self.mechanism.geometry

    def motion(self, phi: float) -> Motion:
        """Inertia and rigid-body part of the motion at the bar angle ``phi`` (rad)."""
        first = np.eye(self.mechanism.freedom)[0]
        pose = self.mechanism.pose(phi * first, first)
        matrix = self.mechanism.mass(pose)
        rigid = self.mechanism.rigid_rates(pose, matrix)
        rates = np.concatenate([rigid, pose.rate])
        return Motion(float(rates @ matrix @ rates), -rigid[:3], -rigid[3:])

    def work(self, phi: float) -> float:
        """Work function W(phi) in J, up to a constant."""
        acting = self._at_rest(phi)
        return acting.work - acting.elastic

    def work_rate(self, phi: float) -> float:
        """Generalised force dW/dphi in J/rad."""
        return float(self._at_rest(phi).force[0])

    def acceleration_from_rest(self, phi: float) -> float:
        """Acceleration phi'' in rad/s^2 of the ring released at rest."""
        return self.work_rate(phi) / self.motion(phi).inertia

    def _at_rest(self, phi: float) -> Acting:
        free = phi * np.eye(self.mechanism.freedom)[0]
        return self.forces.act(self.mechanism.pose(free, 0.0 * free), UP, latched=False)
