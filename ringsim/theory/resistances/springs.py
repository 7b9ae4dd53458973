"""Springs in the V-joints."""

import math

from ringsim.theory.resistances.family import Opening, Resistance
from ringsim.theory.spring_energy import SpringEnergy


class SpringResistance(Resistance):
    """Torque of those that are whole, which drives where it opens the joints."""

    kind = "springs"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.hinge_spring is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        springs = SpringEnergy(self.scene)
        springs.alive = springs.alive * opening.sprung
        # One radian of every joint's angle for one of the opening angle.
        return -springs.springs(math.pi - opening.angle)[0]
