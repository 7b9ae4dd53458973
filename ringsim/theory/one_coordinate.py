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
from ringsim.layout.layout import Layout
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import MassSums
from ringsim.theory.ideal_points import Pairs, Points, body_of

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
        known = scene.structure.basis(scene.structure.coordinate) is not None
        everywhere = _Parts(scene, None) if known else None
        self._parts = lru_cache(maxsize=4)(lambda q: everywhere or _Parts(scene, q))

    def motion(self, q: float) -> Motion:
        """Inertia and rigid-body part of the motion at ``q`` (rad)."""
        parts, functions = self._at(q)
        matrix = parts.sums.at(functions).matrix[:7, :7]
        if len(parts.held):
            place, *axes = parts.held @ functions[:, 0]
            rate, *turning = parts.held @ functions[:, 1]
            turn = 0.5 * np.cross(axes, turning).sum(axis=0)
            rigid = -np.concatenate([rate - np.cross(turn, place), turn])
        else:
            rigid = -np.linalg.solve(matrix[:6, :6], matrix[:6, 6])
        rates = np.append(rigid, 1.0)
        return Motion(float(rates @ matrix @ rates), -rigid[:3], -rigid[3:])

    def work(self, q: float) -> float:
        """Work function W(q) in J, up to a constant."""
        parts, functions = self._at(q)
        return float(parts.lift @ functions[:, 0]) - parts.net_forces(functions).energy

    def work_rate(self, q: float) -> float:
        """Generalised force dW/dq, J/rad."""
        parts, functions = self._at(q)
        return float(parts.lift @ functions[:, 1] + parts.net_forces(functions).force[0])

    def acceleration_from_rest(self, q: float) -> float:
        """Q'' in rad/s^2 when released at rest."""
        return self.work_rate(q) / self.motion(q).inertia

    def _at(self, q: float) -> tuple[_Parts, Array]:
        """What acts and ``Points.functions`` at a coordinate."""
        parts = self._parts(q)
        rest = np.zeros(len(parts.points.swinging))
        return parts, parts.points.functions([q, *rest], [1.0, *rest])


class _Parts:
    """What moves and acts, good at all coordinates or at one."""

    def __init__(self, scene: Scene, at: float | None) -> None:
        self.points = points = Points(scene, at)
        self.sums = MassSums(*points.masses())
        self.lift = np.tensordot(*points.forces(), 2)
        self._net, self._corners = None, np.zeros(0)
        if scene.net is not None:
            self._corners = points.upper_corners()
            self._net = FreeHub(scene.net, len(self._corners))
        self.held = np.zeros(0)
        held = [body_of(support.second) for support in points.layout.supports]
        if held and held[0] >= 0:
            self.held = points.swung(lambda layout: _frame(layout, held[0]), [-1] * 4)

    def net_forces(self, functions: Array) -> NetForces:
        """What the net does, nothing where there is none."""
        if self._net is None:
            return NetForces(np.zeros(1), 0.0, 0.0)
        places, slopes = self._corners @ functions[:, 0], self._corners @ functions[:, 1:2]
        return self._net.forces(places, slopes, np.zeros(1))


def _frame(layout: Layout, body: int) -> Pairs:
    """Origin and axes of a body, shape (4, 3)."""
    pose = layout.bodies[body].pose
    turned = np.cross(pose.turn, pose.axes.T)
    return np.vstack([pose.place, pose.axes.T]), np.vstack([pose.rate, turned])
