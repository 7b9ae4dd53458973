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
        found, now = 0.0, opening.now
        for law, turning in self._joints:
            turn = 0.5 * np.abs(turning.slopes(now) @ now.rate)
            found += float(np.sum(law.resistance(turn * opening.rate) * turn))
        return found
