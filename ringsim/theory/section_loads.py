"""The loads on the V-joints of a ring of rigid rods, section by section."""

import numpy as np

from ringsim.layout.pose import Array
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism


class SectionLoads:
    """Virtual work of the pair of forces in each section; along z in the ring's own axes, as the
    loads of the rigid ring are.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        layout = mechanism.points.layout
        self._forces, self._places = mechanism.points.forces
        self._sections = np.array([layout.joints[one].section for one, _ in layout.forces], int)

    def at(self, now: Configuration) -> Array:
        """Generalised forces on the opening angle, N m, shape (sections + 1,), positive where they
        open.
        """
        if not len(self._sections):
            return np.zeros(1)
        # The angle opens by two for one that the coordinate falls.
        power = -0.5 * np.sum(self._forces * now.velocities(self._places), axis=1)
        return np.asarray(np.bincount(self._sections, power), dtype=float)
