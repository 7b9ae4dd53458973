"""Axial + bending stress at the ends of the rods, and bending strain along one of them."""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.model import Model
from ringsim.layout.halves import Half, halves

Array = NDArray[np.float64]
_FORCE = exu.OutputVariableType.ForceLocal
_TORQUE = exu.OutputVariableType.TorqueLocal
_MIDDLE = [0.0, 0.0, 0.0]


class StressMeter:
    """Stress |N| / A + |M| r / I of every rod half: the larger of its two ends.

    exudyn gives the elastic moment in the middle of an element, the rods' dampers add what damping
    carries there; along it the moment follows the shear force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
    """

    def __init__(self, model: Model) -> None:
        self._system, self._dampers = model.assembly.system, model.assembly.dampers
        self._output = self._system.GetObjectOutputBody
        self._rows = [[_ends(model, half) for half in row] for row in halves(model.layout).values()]

    def read(self) -> Array:
        """Stresses at the current state, shape (rod halves, sections), Pa."""
        damping = self._dampers.latest
        return np.array(
            [[self._worst(ends, tube, damping) for ends, tube in row] for row in self._rows]
        )

    def _worst(self, ends: Any, tube: Any, damping: Array) -> float:
        worst = 0.0
        for element, x in ends:
            force = self._output(element, _FORCE, _MIDDLE)
            torque = self._output(element, _TORQUE, _MIDDLE)
            number = self._dampers.numbers.get(int(element))
            if number is not None:
                force, torque = force + damping[number, :3], torque + damping[number, 3:]
            moment = math.hypot(torque[1] + force[2] * x, torque[2] - force[1] * x)
            bending = moment * 0.5 * tube.outer_diameter
            worst = max(worst, abs(force[0]) / tube.area + bending / tube.second_moment)
        return worst


class BendingMeter:
    """Bending strain of a rod's outer fibre at its nodes, on the side of its y axis's negative.

    Where two elements meet their moments differ by what turns the node alone; their mean counts.
    ``stations`` are the nodes' distances from the rod's first end, m.
    """

    def __init__(self, model: Model, name: str) -> None:
        number = next(k for k, rod in enumerate(model.layout.rods) if rod.name == name)
        rod, self._elements = model.layout.rods[number], model.rods[number].elements
        self._lengths = rod.lengths
        self.stations = np.array(rod.stations) * rod.length
        self._output = model.assembly.system.GetObjectOutputBody
        self._per_moment = (
            0.5 * rod.tube.outer_diameter / (rod.young_modulus * rod.tube.second_moment)
        )

    def read(self) -> Array:
        """Strains at the current state, shape (nodes,)."""
        moments = np.array([self._output(e, _TORQUE, _MIDDLE)[2] for e in self._elements])
        shear = np.array([self._output(e, _FORCE, _MIDDLE)[1] for e in self._elements])
        change = 0.5 * shear * self._lengths
        first, last = moments + change, moments - change
        at_nodes = np.concatenate([first[:1], 0.5 * (first[1:] + last[:-1]), last[-1:]])
        return np.asarray(-self._per_moment * at_nodes)


def _ends(model: Model, half: Half) -> tuple[list[tuple[Any, float]], Any]:
    """First and last element of a half with the place (m) of its outer end from its middle."""
    part, elements = model.layout.rods[half.rod], model.rods[half.rod].elements
    first, last = half.first, half.last - 1
    ends = [
        (elements[first], -0.5 * float(part.lengths[first])),
        (elements[last], 0.5 * float(part.lengths[last])),
    ]
    return ends, part.tube
