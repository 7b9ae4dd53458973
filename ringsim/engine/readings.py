"""Reading a model's state with numpy: opening angles, joint rates and joint gaps."""

from collections.abc import Callable
from functools import partial
from typing import Any

import exudyn as exu
import numpy as np

from ringsim.engine.model import BuiltJoint, Multibody
from ringsim.engine.rods import GeometricallyExact, NodeFrames
from ringsim.engine.rotations import Array, Indices, axes_of, spin
from ringsim.layout.joints import ChordOpening


class State:
    """Total coordinates and rates of a model, copied from exudyn by ``refresh``; ``begun`` are
    those from which a run starts.
    """

    def __init__(self, model: Multibody) -> None:
        self._data = model.assembly.system.systemData
        self.reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self.refresh()
        self.begun = self.position.copy()

    def refresh(self) -> None:
        """Copy exudyn's current state."""
        self.position = np.asarray(self._data.GetODE2Coordinates()) + self.reference
        self.velocity = np.asarray(self._data.GetODE2Coordinates_t())

    def finite(self) -> bool:
        """Whether the state holds no NaN and no infinity."""
        return bool(np.isfinite(self.position).all() and np.isfinite(self.velocity).all())


class _Side:
    """One side of joints whose mounts there are on nodes of one kind."""

    def __init__(self, model: Multibody, joints: list[BuiltJoint], side: int) -> None:
        found = [model.assembly.coordinates_of(joint.nodes[side]) for joint in joints]
        arms = np.array([joint.arms[side] for joint in joints])
        self._where = np.array(found)
        rigid = len(found[0]) == 7
        self._read = GeometricallyExact().read if rigid else model.formulation.read
        self.arms = arms if rigid and arms.any() else None

    def frames(self, state: State) -> NodeFrames:
        """Frames of the nodes."""
        return self._read(state.position[self._where], state.velocity[self._where])

    def spin_about(self, state: State, axes: Array) -> Array:
        """Angular rate about axes, shape (n, 3), rad/s; of nodes with Euler parameters."""
        place, rates = state.position[self._where], state.velocity[self._where]
        return np.asarray(np.sum(spin(place[:, 3:7], rates[:, 3:7]) * axes, axis=1))

    def points(self, state: State) -> Array:
        """Places of the mounts, shape (n, 3), m."""
        nodes = state.position[self._where]
        if self.arms is None:
            return np.array(nodes[:, :3])
        turned = np.einsum("nij,nj->ni", axes_of(nodes[:, 3:7]), self.arms)
        return np.asarray(nodes[:, :3] + turned)


class JointGroup:
    """Joints of one family, read together."""

    def __init__(self, model: Multibody, joints: list[BuiltJoint]) -> None:
        self._first, self._second = (_Side(model, joints, side) for side in (0, 1))

    def turn(self, state: State) -> tuple[Array, Array]:
        """Angle in (-pi, pi] from the first rods' frames to the second's about z, and its rate."""
        first, second = self._first.frames(state), self._second.frames(state)
        sine = np.sum(np.cross(first.y, second.y) * first.z, axis=1)
        angle = np.arctan2(sine, np.sum(first.y * second.y, axis=1))
        return angle, second.spin - first.spin

    def rate(self, state: State) -> Array:
        """Relative angular rate about the joint axis, rad/s."""
        rod, second = self._first.frames(state), self._second
        # A second side with arms is on bodies, whose own z is not the joint's axis.
        bodies = second.arms is not None
        other = second.spin_about(state, rod.z) if bodies else second.frames(state).spin
        return np.asarray(other - rod.spin)

    def gaps(self, state: State) -> Array:
        """Distances of the points that the joints hold together, m."""
        apart = self._first.points(state) - self._second.points(state)
        return np.asarray(np.linalg.norm(apart, axis=1))


def joint_groups(model: Multibody) -> list[JointGroup]:
    """All revolutes, by what they join, so that each group reads nodes of one kind."""
    groups: dict[Any, list[BuiltJoint]] = {}
    size = model.assembly.coordinates_of
    for joint in model.joints:
        if joint.part.kind == "revolute":
            key = (joint.part.family, *(len(size(node)) for node in joint.nodes))
            groups.setdefault(key, []).append(joint)
    return [JointGroup(model, joints) for joints in groups.values()]


class Openings:
    """Opening angles of a structure."""

    def __init__(self, model: Multibody) -> None:
        self._planes: list[Callable[[State], tuple[Array, Array]]] = []
        for plane, joints in zip(model.layout.openings, model.openings(), strict=True):
            if joints:
                group = JointGroup(model, [joint for joint, _ in joints])
                self._planes.append(partial(_of_joints, group, np.array([s for _, s in joints])))
            else:
                chords = [one for one in plane if isinstance(one, ChordOpening)]
                nodes = [model.bodies[one.body][1] for one in chords]
                where = np.array([model.assembly.coordinates_of(node)[:3] for node in nodes])
                centres = np.array([one.centre for one in chords])
                self._planes.append(partial(_of_chords, where, centres))

    def read(self, state: State) -> tuple[Array, Array]:
        """Opening angles and their rates, shape (planes, sections), rad and rad/s."""
        angles, rates = zip(*(plane(state) for plane in self._planes), strict=True)
        return np.array(angles), np.array(rates)


def _of_joints(group: JointGroup, senses: Array, state: State) -> tuple[Array, Array]:
    """The folded angle pi - delta is followed from -pi/2 to 3 pi/2, so that neither the deployed
    nor the stowed end lies on the jump of the arc tangent.
    """
    turned, rate = group.turn(state)
    folded = senses * turned
    angle = np.pi - np.where(folded < -0.5 * np.pi, folded + 2.0 * np.pi, folded)
    return angle, -senses * rate


def _of_chords(where: Indices, centres: Array, state: State) -> tuple[Array, Array]:
    x, y, _ = (state.position[where] - centres).T
    x_rate, y_rate, _ = state.velocity[where].T
    return np.arctan2(x, -y), (x * y_rate - y * x_rate) / (x * x + y * y)
