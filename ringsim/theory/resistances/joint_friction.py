"""Friction in the joints."""

import numpy as np

from ringsim.scene import Scene
from ringsim.theory.ideal_forces import friction_joints
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.resistances.family import Opening, Resistance


class JointFrictionResistance(Resistance):
    """Torque times how far a joint turns, dry friction in full at any rate."""

    kind = "joint friction"
    category = "friction"

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        super().__init__(scene, mechanism)
        laws = scene.joints.present()
        self._joints = [friction_joints(mechanism.points, *item) for item in laws.items()]

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return bool(self._joints)

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        found, (places, rates) = 0.0, (opening.now.values, opening.now.functions[:, -2])
        for law, sides in self._joints:
            first, second = (
                np.einsum("ja,ja->j", ahead @ places, along @ rates) for ahead, along in sides
            )
            turn = 0.5 * np.abs(second - first)
            found += float(np.sum(law.resistance(turn * opening.rate) * turn))
        return found
