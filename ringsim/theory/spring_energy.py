"""Springs and latches of all V-joints of a ring of rigid rods, whose joints open alike."""

import numpy as np

from ringsim.scene import Scene


class SpringEnergy:
    """Springs and latches of a scene; ``alive`` are springs that have not failed, shape (planes,
    sections).
    """

    def __init__(self, scene: Scene) -> None:
        sections = scene.structure.sections
        self._planes = scene.structure.planes
        self.alive = np.ones((len(self._planes), sections))
        spring = scene.hinge_spring
        self._law = None if spring is None else spring.at(np.arange(sections))
        latch = scene.latch
        self._pawl = None if latch is None else latch.at(np.arange(sections))

    def at(self, folded: float) -> tuple[float, float]:
        """Sum of all torques that open (N m) and energy (J) at the folded angle (rad) of all."""
        torque, stored = self.springs(folded)
        if self._pawl is None:
            return torque, stored
        more, lifted = self.pawls(folded)
        return torque + more, stored + lifted

    def pawls(self, folded: float) -> tuple[float, float]:
        """Those of the latches alone."""
        if self._pawl is None:
            return 0.0, 0.0
        reaction = self._pawl.torque(np.full(self.alive.shape, folded))
        return float(np.sum(reaction.elastic)), float(np.sum(reaction.stored))

    def springs(self, folded: float) -> tuple[float, float]:
        """Those of the springs alone."""
        if self._law is None:
            return 0.0, 0.0
        reaction = self._law.torque(np.full(self.alive.shape, folded))
        torque = float(np.sum(self.alive * reaction.elastic))
        return torque, float(np.sum(self.alive * reaction.stored))
