"""How stiff an element of a rod is."""

import numpy as np

from ringsim.layout.bodies import Rod
from ringsim.layout.pose import Array
from ringsim.parts.rods.family import Rods


def stiffness_of(rod: Rod, rods: Rods, length: float) -> Array:
    """Stiffness of u and psi of an element of a length (m), shape (6,), N/m and N m.

    See ``ringsim.frame.element`` for the strains; the shear carries the flexibility of bending
    that constant curvature lacks.
    """
    young, area, second = rod.young_modulus, rod.tube.area, rod.tube.second_moment
    shear, bending = young * rods.shear_modulus_ratio, young * second
    direct = rod.tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + length**2 / (12.0 * bending))
    return np.array([young * area, across, across, 2.0 * shear * second, bending, bending]) / length
