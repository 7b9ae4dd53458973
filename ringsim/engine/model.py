"""A layout assembled in exudyn: bodies, rods, joints and loads."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.assembly import Assembly
from ringsim.engine.rods import FORMULATIONS, BuiltRod, add_rod
from ringsim.engine.rotations import Array
from ringsim.layout import joints as parts
from ringsim.layout.bodies import InSpace, Mount, OnBody, OnRod
from ringsim.layout.layout import layout_of
from ringsim.layout.pose import Pose
from ringsim.scene import Scene
from ringsim.theory.assembled import assembled
from ringsim.theory.first_reaction import Acceleration, first_acceleration
from ringsim.theory.one_coordinate import OneCoordinate

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
