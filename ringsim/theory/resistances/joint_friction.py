"""Friction in the joints."""

import numpy as np

from ringsim.layout.pose import Array
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import Points
from ringsim.theory.resistances.family import Opening, Resistance


class JointFrictionResistance(Resistance):
    """Torque times how far a joint turns, dry friction in full at any rate."""

    kind = "joint friction"
    category = "friction"

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        super().__init__(scene, mechanism)
        laws = scene.joints.present()
        self._joints = [_joints(mechanism.points, *item) for item in laws.items()]

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return bool(self._joints)

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        found, now = 0.0, opening.now
        for law, products in self._joints:
            # The angle opens by two for one that the coordinate falls.
            turn = 0.5 * np.abs(now.values @ products @ now.slopes)
            found += float(np.sum(law.resistance(turn * opening.rate) * turn))
        return found


def _joints(points: Points, family: str, law: JointFriction) -> tuple[JointFriction, Array]:
    """The law at the joints of a family; and how fast these turn, as a product of s and s' with
    constants, shape (joints, functions, functions): z . (x x x') of their second parts less that of
    their first, with z the joint's axis and x a direction of the part square to it.
    """
    joints = [joint for joint in points.layout.joints if joint.family == family]
    axes = np.array([points.layout.pose(joint.first).axes[:, 2] for joint in joints])
    sides = [joint.first for joint in joints], [joint.second for joint in joints]
    alongs = map(points.directions, sides)
    first, second = (
        np.einsum("jaf,jag->jfg", np.cross(axes[:, :, None], along, axis=1), along)
        for along in alongs
    )
    sections = np.array([joint.section for joint in joints])
    return at_section(law, sections), second - first
