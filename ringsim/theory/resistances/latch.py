"""Ramps of the latches."""

import math

from ringsim.theory.resistances.family import Opening, Resistance
from ringsim.theory.spring_energy import SpringEnergy


class LatchResistance(Resistance):
    """Torque that lifts the pawls of all V-joints."""

    kind = "latches"
    category = "latch"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.latch is not None and self.scene.latch.pushes

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        # A difference, not a negative: no resistance is 0, not -0.
        return 0.0 - SpringEnergy(self.scene).pawls(math.pi - opening.angle)[0]
