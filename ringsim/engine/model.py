"""A layout assembled in exudyn: bodies, rods, joints and what acts between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly, Frame
from ringsim.engine.contact import add_contact
from ringsim.engine.rods import Formulation, Rod, add_rod
from ringsim.layout.bodies import InSpace, Mount, OnBody
from ringsim.layout.joints import JointOpening
from ringsim.layout.layout import Layout
from ringsim.layout.of_scene import layout_of
from ringsim.layout.pose import Pose, cross
from ringsim.scene import Scene
from ringsim.theory.one_coordinate import OneCoordinate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A joint as built: its markers, and the node and arm (m, in its frame) of either side.

    A side in space has no node.
    """

    family: str
    section: int
    markers: tuple[Any, Any]
    nodes: tuple[Any, Any]
    arms: tuple[Array, Array]


@dataclass
class Model:
    """What was built, for the parts that come after and for reading results.

    Attributes
    ----------
    layout
        What it was built from, at the start of the run.
    bodies
        Body and node of every rigid body.
    rods, joints
        In the order of the layout.
    """

    scene: Scene
    layout: Layout
    formulation: Formulation
    assembly: Assembly = field(default_factory=Assembly)
    bodies: list[tuple[Any, Any]] = field(default_factory=list)
    rods: list[Rod] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)

    def openings(self) -> list[list[tuple[Joint, float]]]:
        """Joints that open, with their senses, by plane and section; empty for other angles."""
        return [
            [(self.joints[o.joint], o.sense) for o in plane if isinstance(o, JointOpening)]
            for plane in self.layout.openings
        ]


class _Start:
    """Accelerations of the structure with rigid rods, released at rest.

    One with springs of its own starts without: it rests against them on its cables.
    """

    def __init__(self, scene: Scene, layout: Layout) -> None:
        self._pull, self._velocity, self._rotation = 0.0, np.zeros(3), np.zeros(3)
        if not layout.springs:
            ideal, q = OneCoordinate(scene), scene.structure.coordinate
            motion = ideal.motion(q)
            self._pull = ideal.work_rate(q) / motion.inertia
            self._velocity, self._rotation = motion.velocity, motion.rotation

    def frame(self, pose: Pose) -> Frame:
        """A frame with its acceleration."""
        moving = pose.rate - self._velocity - cross(self._rotation, pose.place)
        turning = pose.turn - self._rotation
        return Frame(pose.place, pose.axes, self._pull * moving, self._pull * turning)


def assemble(scene: Scene, formulation: Formulation) -> Model:
    """Build bodies, rods, joints and springs of a scene's layout in its initial state."""
    layout = layout_of(scene)
    model, start = Model(scene, layout, formulation), _Start(scene, layout)
    assembly = model.assembly
    for body in layout.bodies:
        node = assembly.add_rigid_node(start.frame(body.pose))
        number = assembly.add_body(node, body.mass, body.inertia, body.centre)
        model.bodies.append((number, node))
    for part in layout.rods:
        ends = start.frame(part.start), start.frame(part.end)
        rod = add_rod(
            assembly, formulation, ends, part.stations, scene.rods, part.tube, part.young_modulus
        )
        model.rods.append(rod)
        for station, mass in part.masses:
            formulation.add_mass(assembly, rod.nodes[station], mass)
    for joint in layout.joints:
        sides = [_side(model, mount) for mount in (joint.first, joint.second)]
        markers, nodes, arms = zip(*sides, strict=True)
        _ADD[joint.kind](assembly, markers)
        model.joints.append(Joint(joint.family, joint.section, markers, nodes, arms))
    _add_springs(model)
    for joint_number, force in layout.forces:
        # Constant in space, not in the ring: bodyFixed is not set.
        marker = model.joints[joint_number].markers[0]
        assembly.system.AddLoad(item.LoadForceVector(markerNumber=marker, loadVector=list(force)))
    return model


def side_of(model: Model, mount: Mount) -> tuple[Any, Array]:
    """Node of a mount, None in space, and the arm from it in the node's axes, m."""
    if isinstance(mount, InSpace):
        return None, mount.place
    if isinstance(mount, OnBody):
        return model.bodies[mount.body][1], mount.arm
    return model.rods[mount.rod].nodes[mount.station], np.zeros(3)


def _side(model: Model, mount: Mount) -> tuple[Any, Any, Array]:
    node, arm = side_of(model, mount)
    if isinstance(mount, InSpace):
        marker = model.assembly.ground_marker(mount.place)
    elif isinstance(mount, OnBody):
        marker = model.assembly.body_marker(model.bodies[mount.body][0], mount.arm, mount.axes)
    else:
        marker = model.assembly.node_marker(node)
    return marker, node, arm


_ADD = {
    "revolute": lambda assembly, markers: assembly.revolute(*markers),
    "prismatic": lambda assembly, markers: assembly.prismatic(*markers),
    "sleeve": lambda assembly, markers: assembly.generic_joint(*markers, [1, 1, 0, 0, 0, 0]),
    "weld": lambda assembly, markers: assembly.generic_joint(*markers, [1, 1, 1, 1, 1, 1]),
}
"""exudyn's joint of each kind; flags hold translations and rotations."""


def _add_springs(model: Model) -> None:
    assembly, here = model.assembly, np.zeros(3)
    for spring in model.layout.springs:
        ends = [model.bodies[number][0] for number in (spring.first, spring.second)]
        assembly.system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=[assembly.body_marker(body, here) for body in ends],
                referenceLength=spring.law.free_length,
                stiffness=spring.law.stiffness,
                damping=spring.law.damping,
            )
        )
    for contact in model.layout.contacts:
        node = model.bodies[contact.body][1]
        start = float(model.layout.bodies[contact.body].pose.place[contact.axis])
        add_contact(assembly, node, contact.axis, contact.law, start - contact.room)
