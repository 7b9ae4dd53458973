"""A layout assembled in exudyn, and what its states are read by."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.exudyn.assembly import Array, Assembly, Indices, axes_of, spin
from ringsim.exudyn.rods import FORMULATIONS, BuiltRod, GeometricallyExact, NodeFrames, add_rod
from ringsim.layout import bodies as parts
from ringsim.layout.bodies import ChordOpening, InSpace, Mount, OnBody, OnRod, Pose
from ringsim.layout.layout import layout_of
from ringsim.rigid.assembling import assembled
from ringsim.rigid.statics import Acceleration, OneCoordinate, first_acceleration
from ringsim.scene import Scene

# A layout assembled in exudyn: bodies, rods, joints and loads.


_JOINTS: dict[str, Any] = {
    "revolute": item.ObjectJointRevoluteZ,
    "prismatic": item.ObjectJointPrismaticX,
    "sleeve": partial(item.ObjectJointGeneric, constrainedAxes=[1, 1, 0, 0, 0, 0]),
    "weld": partial(item.ObjectJointGeneric, constrainedAxes=[1, 1, 1, 1, 1, 1]),
}
"""exudyn's joint of each kind; flags hold translations and rotations."""


class BuiltJoint(NamedTuple):
    """A joint as built: exudyn's object, markers, nodes (None in space) and arms (m, in the nodes'
    axes) by side.
    """

    part: parts.Joint
    holder: Any
    markers: tuple[Any, Any]
    nodes: tuple[Any, Any]
    arms: tuple[Array, Array]


class Multibody:
    """Bodies (each with its node), rods, joints and loads of a scene's layout at the start, in the
    layout's order; ``loose`` are nodes of neither, by the names of ``ringsim.layout.points``;
    ``forces`` are those of the loads as they act now, N, shape (loads, 3); ``prestress`` is what
    putting the bodies together has left in the rods, J.
    """

    def __init__(self, scene: Scene) -> None:
        drawn = layout_of(scene)
        self.scene = scene
        self.layout, self.prestress = assembled(drawn, scene.rods)
        self.formulation = formulation = FORMULATIONS[type(scene.rods)]
        self.assembly = assembly = Assembly()
        self.ideal = OneCoordinate(scene, drawn)
        self.moving = first_acceleration(self.layout, self.ideal, scene.structure.coordinate)
        started = _started(self.moving)
        self.bodies: list[tuple[Any, Any]] = []
        for body in self.layout.bodies:
            node = assembly.add_rigid_node(started(body.pose))
            self.bodies.append(
                (assembly.add_body(node, body.mass, body.inertia, body.centre), node)
            )
        self.rods: list[BuiltRod] = []
        self.loose: dict[str, Any] = {}
        for part in self.layout.rods:
            poses = [started(part.node(station)) for station in range(len(part.stations))]
            rod = add_rod(assembly, formulation, part, poses, scene.rods)
            self.rods.append(rod)
            for station, mass, _ in part.masses:
                formulation.add_mass(assembly, rod.nodes[station], mass)
        self.joints = [self._joint(joint) for joint in self.layout.joints]
        self.forces = np.array([force for _, force in self.layout.forces])
        self._loads = []
        for number, force in self.layout.forces:
            # Constant in space, not in the ring: bodyFixed is not set.
            load = partial(item.LoadForceVector, loadVector=list(force))
            made = assembly.system.AddLoad(load(markerNumber=self.joints[number].markers[0]))
            self._loads.append(made)

    def turn_loads(self) -> None:
        """Let the forces of ``Loads`` act the other way round."""
        self.forces *= -1.0
        for load, force in zip(self._loads, self.forces.tolist(), strict=True):
            self.assembly.system.SetLoadParameter(load, "loadVector", force)

    def openings(self) -> list[list[tuple[BuiltJoint, float]]]:
        """Joints that open, with their senses, by plane and section; empty for other angles."""
        return [
            [(self.joints[o.joint], o.sense) for o in plane if isinstance(o, parts.JointOpening)]
            for plane in self.layout.openings
        ]

    def side_of(self, mount: Mount) -> tuple[Any, Array]:
        """Node of a mount, None in space, and the arm from it in the node's axes, m."""
        if isinstance(mount, InSpace):
            return None, mount.place
        if isinstance(mount, OnBody):
            return self.bodies[mount.body][1], mount.arm
        return self.rods[mount.rod].nodes[mount.station], np.zeros(3)

    def _joint(self, joint: parts.Joint) -> BuiltJoint:
        nodes, arms = zip(*map(self.side_of, (joint.first, joint.second)), strict=True)
        markers = self._marker(joint.first), self._marker(joint.second)
        # exudyn holds rotations along the axes of the first marker: those of a body are orthonormal
        # whatever the rods are made of, and Newton's iterations depend on the choice.
        pinned = isinstance(joint.first, OnRod) and isinstance(joint.second, OnBody)
        ordered = markers[::-1] if pinned else markers
        made = _JOINTS[joint.kind](markerNumbers=list(ordered))
        holder = self.assembly.system.AddObject(made)
        return BuiltJoint(joint, holder, markers, nodes, arms)

    def _marker(self, mount: Mount) -> Any:
        node, arm = self.side_of(mount)
        if isinstance(mount, InSpace):
            ground = self.assembly.system.AddObject(item.ObjectGround())
            return self.assembly.body_marker(ground, arm, mount.axes)
        if isinstance(mount, OnBody):
            return self.assembly.body_marker(self.bodies[mount.body][0], arm, mount.axes)
        return self.assembly.node_marker(node)


def _started(moving: Acceleration) -> Callable[[Pose], Pose]:
    """Gives poses accelerations, those of the structure released at rest, in place of their
    derivatives.
    """

    def started(pose: Pose) -> Pose:
        first, turning = moving.at(pose.place, pose.rate), moving.turning(pose.turn)
        return Pose(pose.place, pose.axes, first, turning)

    return started


# Reading a model's state with numpy: opening angles, joint rates and joint gaps.


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
        mounts = [(joint.part.first, joint.part.second)[side] for joint in joints]
        bodies = any(isinstance(mount, OnBody) for mount in mounts)
        own = [mount.axes if isinstance(mount, OnBody) else np.eye(3) for mount in mounts]
        self._axes = np.array(own) if bodies else None
        """Of joints on bodies, in the axes of these; nodes of rods stand as their joints do."""

    def frames(self, state: State) -> NodeFrames:
        """Frames of the mounts."""
        place, rates = state.position[self._where], state.velocity[self._where]
        if self._axes is None:
            return self._read(place, rates)
        axes = axes_of(place[:, 3:7]) @ self._axes
        turning = np.sum(spin(place[:, 3:7], rates[:, 3:7]) * axes[:, :, 2], axis=1)
        return NodeFrames(axes[:, :, 1], axes[:, :, 2], turning)

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
        return np.asarray(self._second.frames(state).spin - self._first.frames(state).spin)

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
