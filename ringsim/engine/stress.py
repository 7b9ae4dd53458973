"""Axial + bending stress at the ends of the rods."""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.pantograph_ring import RingModel
from ringsim.variables import RODS

Array = NDArray[np.float64]
_FORCE = exu.OutputVariableType.ForceLocal
_TORQUE = exu.OutputVariableType.TorqueLocal
_MIDDLE = [0.0, 0.0, 0.0]


class StressMeter:
    """Stress |N| / A + |M| r / I of every rod half: the larger of its two ends.

    exudyn gives the elastic moment in the middle of an element, the rods' dampers add what damping
    carries there; along it the moment follows the shear force, dM_z/dx = -Q_y and dM_y/dx = Q_z.
    """

    def __init__(self, model: RingModel) -> None:
        self._system, self._dampers = model.assembly.system, model.assembly.dampers
        self._output = self._system.GetObjectOutputBody
        self._places = [self._rows(model, name) for name in RODS]

    def read(self) -> Array:
        """Stresses at the current state, shape (8, sections), Pa."""
        damping = self._dampers.latest
        return np.array(
            [[self._worst(ends, tube, damping) for ends, tube in row] for row in self._places]
        )

    def _rows(self, model: RingModel, name: str) -> list[Any]:
        whole = name if name.startswith("bar") else name.rsplit("_", 1)[0]
        rows = []
        for rod in model.rods[whole]:
            elements = rod.elements
            if whole != name:
                middle = len(elements) // 2
                elements = elements[:middle] if name.endswith("left") else elements[middle:]
            ends = [(elements[0], -0.5 * rod.length), (elements[-1], 0.5 * rod.length)]
            rows.append((ends, rod.tube))
        return rows

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
