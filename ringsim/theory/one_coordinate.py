"""Any structure with rigid rods as one coordinate q: inertia, work, and its release from rest.

With rigid rods every point is a function of q, so

    I(q) q'' + I'(q) q'^2 / 2 = dW/dq,

I = sum m |dr/dq|^2 over all masses with the rigid-body motion taken out, W the work of the loads
less the energy of the net.  A free structure keeps momentum and angular momentum at zero (its loads
turn with it here; ringsim.theory.ideal_motion keeps them vertical); a support holds its body.  The
end assemblies of an open arc are held upright, as they are at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import OnBody
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.layout import Layout
from ringsim.layout.of_scene import layout_of
from ringsim.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
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
        self._layout = lru_cache(maxsize=4)(self._build)

    def motion(self, q: float) -> Motion:
        """Inertia and rigid-body part of the motion at ``q`` (rad)."""
        layout = self._layout(q)
        matrix, held = layout.inertia(), layout.supports
        if held and isinstance(held[0].second, OnBody):
            pose = layout.bodies[held[0].second.body].pose
            rigid = -np.concatenate([pose.rate - np.cross(pose.turn, pose.place), pose.turn])
        else:
            rigid = -np.linalg.solve(matrix[:6, :6], matrix[:6, 6])
        rates = np.append(rigid, 1.0)
        return Motion(float(rates @ matrix @ rates), -rigid[:3], -rigid[3:])

    def work(self, q: float) -> float:
        """Work function W(q) in J, up to a constant."""
        layout, net = self._layout(q), self._scene.net
        done = sum(
            float(force @ layout.pose(layout.joints[joint].first).place)
            for joint, force in layout.forces
        )
        if net is None:
            return done
        places, rates = _upper_corners(layout)
        hub = FreeHub(net, len(places))
        return done - hub.forces(places, rates[:, :, None], np.zeros(1)).energy

    def work_rate(self, q: float) -> float:
        """Generalised force dW/dq, J/rad."""
        layout, net = self._layout(q), self._scene.net
        force = sum(
            float(force @ layout.pose(layout.joints[joint].first).rate)
            for joint, force in layout.forces
        )
        if net is None:
            return force
        places, rates = _upper_corners(layout)
        hub = FreeHub(net, len(places))
        return force + float(hub.forces(places, rates[:, :, None], np.zeros(1)).force[0])

    def acceleration_from_rest(self, q: float) -> float:
        """Q'' in rad/s^2 when released at rest."""
        return self.work_rate(q) / self.motion(q).inertia

    def _build(self, q: float) -> Layout:
        return layout_of(self._scene, q)


def _upper_corners(layout: Layout) -> tuple[Array, Array]:
    poses = [layout.bodies[number].pose for number in layout.corners[0]]
    return np.array([p.place for p in poses]), np.array([p.rate for p in poses])
