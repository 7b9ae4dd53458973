"""The winches of a batch: rope wound by prescribed laws and by laws with feedback."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Winch
from ringsim.cable.section_path import path_slope
from ringsim.cable.winding.family import WinchState
from ringsim.theory.ideal_batch import Batch

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Winches:
    """All winches of a batch; a feedback law chooses its speed for every step, as in the engine.

    Attributes
    ----------
    feedback
        Whether any winch has such a law.
    """

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._cables = len(batch.planes)
        self._winches: list[list[tuple[int, int, Winch]]] = [
            [(k, end, w) for k, cable in enumerate(own) for end, w in enumerate(cable.winches)]
            for own in batch.cables
        ]
        self._states = [[WinchState() for _ in own] for own in self._winches]
        self.feedback = any(w.feedback for own in self._winches for _, _, w in own)

    def breaks(self, sample: int) -> list[float]:
        """Times at which a winch is switched on or off, s."""
        found = set()
        for _, _, winch in self._winches[sample]:
            found.add(winch.start_time)
            if winch.stop_time is not None:
                found.add(winch.stop_time)
        return sorted(time for time in found if time > 0.0)

    def at(self, samples: Indices, times: Array) -> tuple[Array, Array]:
        """Rope wound and its rate, shape (samples, instants, cables, 2), m and m/s."""
        wound = np.zeros((*times.shape, self._cables, 2))
        speed = np.zeros_like(wound)
        for row, sample in enumerate(samples):
            seen: dict[int, list[WinchState]] = {}
            own = zip(self._winches[sample], self._states[sample], strict=True)
            for (cable, end, winch), held in own:
                if winch.feedback or id(winch) not in seen:
                    seen[id(winch)] = [winch.at(float(t), held) for t in times[row]]
                states = seen[id(winch)]
                wound[row, :, cable, end] = [state.wound for state in states]
                speed[row, :, cable, end] = [state.speed for state in states]
        return wound, speed

    def choose(self, sample: int, time: float, step: float, phi: float, rate: float) -> None:
        """Let the feedback laws of a sample choose their speed for a step from ``time``."""
        own = self._winches[sample]
        if not any(winch.feedback for _, _, winch in own):
            return
        wound, speed = self.at(np.array([sample]), np.array([[time]]))
        state = self._batch.chain_state(sample, phi, rate, wound[0, 0], speed[0, 0])
        structure = self._batch.scenes[sample].structure
        opening = math.pi - 2.0 * phi
        chosen = []
        for (number, end, winch), held in zip(own, self._states[sample], strict=True):
            reading = None
            if winch.feedback:
                offset = self._batch.cables[sample][number].block_offset
                slope = structure.sections * float(path_slope(structure.half_bar, offset, opening))
                reading = state.reading(number, end, slope)
            chosen.append(winch.advance(time, step, reading, held))
        self._states[sample] = chosen
