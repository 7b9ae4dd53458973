"""Axial + bending stress at the ends of the rods, and bending strain along one of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly
from ringsim.engine.model import Multibody
from ringsim.layout.layout import Half

Array = NDArray[np.float64]
_KINDS = exu.OutputVariableType.ForceLocal, exu.OutputVariableType.TorqueLocal


class StressMeter:
    """Stress |N| / A + |M| r / I of every rod half: the larger of its two ends.

    exudyn gives the elastic moment in the middle of an element, the rods' dampers add what damping
    carries there; along it the moment follows the shear force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
    """

    def __init__(self, model: Multibody) -> None:
        self._assembly = model.assembly
        rows = [*model.layout.halves().values()]
        ends = [end for row in rows for half in row for end in _ends(model, half)]
        self._shape = len(rows), len(rows[0]), 2
        self._elements, *numbers = zip(*ends, strict=True)
        self._outside, self._area, self._per_moment = np.array(numbers)
        dampers = model.assembly.dampers.numbers
        self._damped = [dampers[int(e)] for e in self._elements] if dampers else None

    def read(self) -> Array:
        """Stresses at the current state, shape (rod halves, sections), Pa."""
        force, torque = _in_the_middle(self._assembly, self._elements)
        if self._damped is not None:
            carried = self._assembly.dampers.latest[self._damped].T
            force, torque = force + carried[:3], torque + carried[3:]
        x = self._outside
        moment = np.hypot(torque[1] + force[2] * x, torque[2] - force[1] * x)
        stress = np.abs(force[0]) / self._area + moment * self._per_moment
        return np.asarray(stress.reshape(self._shape).max(axis=2))


class BendingMeter:
    """Bending strain of a rod's outer fibre at its nodes, on the side of its y axis's negative.

    Where two elements meet their moments differ by what turns the node alone; their mean counts.
    ``stations`` are the nodes' distances from the rod's first end, m.
    """

    def __init__(self, model: Multibody, name: str) -> None:
        number = next(k for k, rod in enumerate(model.layout.rods) if rod.name == name)
        rod, self._elements = model.layout.rods[number], model.rods[number].elements
        self._lengths = rod.lengths
        self.stations = np.array(rod.stations) * rod.length
        self._assembly = model.assembly
        self._per_moment = (
            0.5 * rod.tube.outer_diameter / (rod.young_modulus * rod.tube.second_moment)
        )

    def read(self) -> Array:
        """Strains at the current state, shape (nodes,)."""
        force, torque = _in_the_middle(self._assembly, self._elements)
        change = 0.5 * force[1] * self._lengths
        first, last = torque[2] + change, torque[2] - change
        at_nodes = np.concatenate([first[:1], 0.5 * (first[1:] + last[:-1]), last[-1:]])
        return np.asarray(-self._per_moment * at_nodes)


def _in_the_middle(assembly: Assembly, elements: Sequence[Any]) -> list[Array]:
    """Force (N) and moment (N m) of elements in their axes, shape (3, elements) each."""
    output = assembly.system.GetObjectOutputBody
    return [np.array([output(e, kind, [0.0] * 3) for e in elements]).T for kind in _KINDS]


def _ends(model: Multibody, half: Half) -> list[tuple[Any, float, float, float]]:
    """First and last element of a half, the place (m) of its outer end from the element's middle,
    and by what force and moment are divided and multiplied to give stress (m^2, 1/m^3).
    """
    part, elements = model.layout.rods[half.rod], model.rods[half.rod].elements
    per_moment = 0.5 * part.tube.outer_diameter / part.tube.second_moment
    ends = (half.first, -0.5), (half.last - 1, 0.5)
    return [(elements[k], s * part.lengths[k], part.tube.area, per_moment) for k, s in ends]
