"""The springs of all V-joints of a ring of rigid rods, whose joints open alike."""

import numpy as np

from ringsim.scene import Scene


class SpringEnergy:
    """Springs of a scene; ``alive`` are those that have not failed, shape (planes, sections)."""

    def __init__(self, scene: Scene) -> None:
        sections = scene.structure.sections
        self._planes = scene.structure.planes
        self.alive = np.ones((len(self._planes), sections))
        spring = scene.hinge_spring
        self._law = None if spring is None else spring.at(np.arange(sections))

    def at(self, folded: float) -> tuple[float, float]:
        """Sum of the torques that open (N m) and energy (J) at the folded angle (rad) of all."""
        if self._law is None:
            return 0.0, 0.0
        reaction = self._law.torque(np.full(self.alive.shape, folded))
        torque = float(np.sum(self.alive * reaction.elastic))
        return torque, float(np.sum(self.alive * reaction.stored))

    def fail(self, plane: str, section: int) -> None:
        """Remove the spring of a V-joint; sections count from 1."""
        self.alive = self.alive.copy()  # what has happened before is read with the old one
        self.alive[self._planes.index(plane), section - 1] = 0.0
