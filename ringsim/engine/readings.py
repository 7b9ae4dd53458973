"""Reading a model's state with numpy: opening angles, joint rates and joint gaps."""

from __future__ import annotations

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.pantograph_ring import Joint, RingModel
from ringsim.engine.rotations import axes_of, spin

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class State:
    """Total coordinates and rates of a model, copied from exudyn by ``refresh``."""

    def __init__(self, model: RingModel) -> None:
        self._data = model.assembly.system.systemData
        self.reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self.position = self.reference
        self.velocity = np.zeros_like(self.reference)

    def refresh(self) -> None:
        """Copy exudyn's current state."""
        self.position = np.asarray(self._data.GetODE2Coordinates()) + self.reference
        self.velocity = np.asarray(self._data.GetODE2Coordinates_t())

    def finite(self) -> bool:
        """Whether the state holds no NaN and no infinity."""
        return bool(np.isfinite(self.position).all() and np.isfinite(self.velocity).all())


class JointGroup:
    """Joints of one family, read together."""

    def __init__(self, model: RingModel, joints: list[Joint]) -> None:
        assembly = model.assembly
        self._read = model.formulation.read
        self.sections = np.array([joint.section for joint in joints])
        self._first = np.array([assembly.coordinates_of(joint.gap[0]) for joint in joints])
        self._second = np.array([assembly.coordinates_of(joint.gap[1]) for joint in joints])
        arms = [joint.gap[2] for joint in joints if joint.gap[2] is not None]
        self._arms = np.array(arms) if arms else None

    def turn(self, state: State) -> tuple[Array, Array]:
        """Angle in (-pi, pi] from the first rods' frames to the second's about z, and its rate."""
        first = self._read(state.position[self._first], state.velocity[self._first])
        second = self._read(state.position[self._second], state.velocity[self._second])
        sine = np.sum(np.cross(first.y, second.y) * first.z, axis=1)
        angle = np.arctan2(sine, np.sum(first.y * second.y, axis=1))
        return angle, second.spin - first.spin

    def rate(self, state: State) -> Array:
        """Relative angular rate about the joint axis, rad/s."""
        if self._arms is None:
            return self.turn(state)[1]
        rod = self._read(state.position[self._first], state.velocity[self._first])
        place, moving = state.position[self._second], state.velocity[self._second]
        hinge = spin(place[:, 3:7], moving[:, 3:7])
        return np.asarray(rod.spin - np.sum(hinge * rod.z, axis=1))

    def gaps(self, state: State) -> Array:
        """Distances of the points that the joints hold together, m."""
        first = state.position[self._first][:, :3]
        second = state.position[self._second]
        place = second[:, :3]
        if self._arms is not None:
            axes = axes_of(second[:, 3:7])
            place = place + np.einsum("nij,nj->ni", axes, self._arms)
        return np.asarray(np.linalg.norm(first - place, axis=1))


class Openings:
    """Opening angles of all V-joints."""

    def __init__(self, model: RingModel) -> None:
        self._planes = [JointGroup(model, joints) for joints in model.vjoints]

    def read(self, state: State) -> tuple[Array, Array]:
        """Opening angles and their rates, shape (2, sections), rad and rad/s.

        The folded angle pi - delta is followed from -pi/2 to 3 pi/2, so that neither the
        deployed nor the stowed end lies on the jump of the arc tangent.
        """
        angles, rates = [], []
        for group, sense in zip(self._planes, (1.0, -1.0), strict=True):
            turned, rate = group.turn(state)
            folded = sense * turned
            angles.append(np.pi - np.where(folded < -0.5 * np.pi, folded + 2.0 * np.pi, folded))
            rates.append(-sense * rate)
        return np.array(angles), np.array(rates)
