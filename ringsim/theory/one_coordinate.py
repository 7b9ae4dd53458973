"""Any structure with rigid rods as one coordinate q: inertia, work, and its release from rest.

With rigid rods every point is a function of q, so

    I(q) q'' + I'(q) q'^2 / 2 = dW/dq,

I = sum m |dr/dq|^2 over all masses with the rigid-body motion taken out, W the work of the loads
less the energy of the net.  A free structure keeps momentum and angular momentum at zero (its loads
turn with it here; ringsim.theory.ideal_motion keeps them vertical); a support holds its body.  The
end assemblies of an open arc are held upright, as they are at rest.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.free_hub import FreeHub, NetForces
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Configuration, Mechanism

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """Rates after q at one value of it.

    Attributes
    ----------
    inertia
        I(q), kg m^2.
    velocity, rotation
        Rigid motion to be subtracted from the layout's rates: a point at r moves with
        r' - velocity - rotation x r.  Shapes (3,); m/rad and rad/rad.
    """

    inertia: float
    velocity: Array
    rotation: Array


class OneCoordinate:
    """Masses, loads and net of a scene; joint friction, stops, springs and cables are left out."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        known = scene.structure.basis(scene.structure.coordinate).size
        everywhere = Mechanism(scene) if known else None
        self._mechanism = lru_cache(maxsize=4)(lambda q: everywhere or Mechanism(scene, q))

    def motion(self, q: float) -> Motion:
        """Inertia and rigid-body part of the motion at ``q`` (rad)."""
        mechanism, now = self._at(q)
        rigid = mechanism.rigid_rates(now)
        rates = np.concatenate([rigid, now.rate])
        return Motion(float(rates @ now.matrix @ rates), -rigid[:3], -rigid[3:])

    def work(self, q: float) -> float:
        """Work function W(q) in J, up to a constant."""
        mechanism, now = self._at(q)
        return float(mechanism.points.load_work @ now.values) - self._net(q).energy

    def work_rate(self, q: float) -> float:
        """Generalised force dW/dq, J/rad."""
        mechanism, now = self._at(q)
        done = mechanism.points.load_work @ now.by_place[:, 0]
        return float(done + self._net(q).force[0])

    def acceleration_from_rest(self, q: float) -> float:
        """Q'' in rad/s^2 when released at rest."""
        return self.work_rate(q) / self.motion(q).inertia

    def _at(self, q: float) -> tuple[Mechanism, Configuration]:
        """The mechanism, folding at rate 1 without swings."""
        mechanism = self._mechanism(q)
        folding = np.eye(mechanism.freedom)[0]
        return mechanism, mechanism.configuration(q * folding, folding)

    def _net(self, q: float) -> NetForces:
        """What the net does, nothing where there is none."""
        if self._scene.net is None:
            return NetForces(np.zeros(1), 0.0, 0.0)
        mechanism, now = self._at(q)
        places, slopes, _ = now.moved(mechanism.upper_corners)
        net = FreeHub(self._scene.net, len(places))
        return net.forces(places, slopes, 0.0 * now.rate)
