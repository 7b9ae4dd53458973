"""Stress at the ends of rods, from the strains of their elements."""

import numpy as np

from ringsim.frame.kernels import Strains
from ringsim.frame.mesh import Mesh
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array


class StressMeter:
    """Stress |N| / A + |M| r / I of every rod half: the larger of its two ends.

    Force and moment, elastic and viscous, are those of an element's middle; along it the moment
    follows the shear force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
    """

    def __init__(self, mesh: Mesh, layout: Layout) -> None:
        self._mesh = mesh
        rows = [*layout.halves().values()]
        self._shape = len(rows), len(rows[0]), 2
        first = np.cumsum([0, *(len(rod.lengths) for rod in layout.rods)])
        elements, numbers = [], []
        for half in (half for row in rows for half in row):
            rod = layout.rods[half.rod]
            per_moment = 0.5 * rod.tube.outer_diameter / rod.tube.second_moment
            for k, end in ((half.first, -0.5), (half.last - 1, 0.5)):
                elements.append(first[half.rod] + k)
                numbers.append((end * rod.lengths[k], rod.tube.area, per_moment))
        self._elements = np.array(elements)
        self._outside, self._area, self._per_moment = np.array(numbers).T

    def read(self, strains: Strains) -> Array:
        """Stresses, shape (rod halves, sections), Pa."""
        own, mesh = self._elements, self._mesh
        now, before = strains.now[own], strains.before[own]
        carried = mesh.stiffness[own] * (now + mesh.tau[own, None] * (strains.lead * now + before))
        force, torque = carried[:, :3].T, carried[:, 3:].T
        x = self._outside
        moment = np.hypot(torque[1] + force[2] * x, torque[2] - force[1] * x)
        stress = np.abs(force[0]) / self._area + moment * self._per_moment
        return np.asarray(stress.reshape(self._shape).max(axis=2))
