"""The winches of a batch: rope wound by prescribed laws and by laws with feedback."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.cable import winches
from ringsim.cable.records import Winch
from ringsim.cable.section_path import path_slope
from ringsim.cable.state import ChainState
from ringsim.cable.winding.family import WinchState
from ringsim.theory import radau
from ringsim.theory.ideal_batch import Batch, Equation

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Winches:
    """All winches of a batch; laws with feedback answer at every stage, as in the full model.

    Attributes
    ----------
    answering
        Whether each sample has a law with feedback, shape (samples,).
    """

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._cables = len(batch.planes)
        self._winches: list[list[tuple[int, int, Winch]]] = [
            [(k, end, w) for k, cable in enumerate(own) for end, w in enumerate(cable.winches)]
            for own in batch.cables
        ]
        self.answering = np.array([any(w.feedback for _, _, w in own) for own in self._winches])
        self._answers = {
            int(sample): winches.Winches(batch.cables[sample])
            for sample in np.flatnonzero(self.answering)
        }

    def breaks(self, sample: int) -> list[float]:
        """Times at which a winch is switched on or off, s."""
        found = set()
        for _, _, winch in self._winches[sample]:
            found.add(winch.start_time)
            if winch.stop_time is not None:
                found.add(winch.stop_time)
        return sorted(time for time in found if time > 0.0)

    def prescribed(self, samples: Indices, times: Array) -> tuple[Array, Array]:
        """Rope wound and its rate, shape (samples, instants, cables, 2), m and m/s.

        Zero for the samples whose winches answer to the motion.
        """
        wound = np.zeros((*times.shape, self._cables, 2))
        speed = np.zeros_like(wound)
        nothing = WinchState()
        for row in np.flatnonzero(~self.answering[samples]):
            seen: dict[int, list[WinchState]] = {}
            for cable, end, winch in self._winches[samples[row]]:
                if id(winch) not in seen:
                    seen[id(winch)] = [winch.at(float(t), nothing) for t in times[row]]
                states = seen[id(winch)]
                wound[row, :, cable, end] = [state.wound for state in states]
                speed[row, :, cable, end] = [state.speed for state in states]
        return wound, speed

    def answer(self, sample: int, times: Array, paths: Array, rates: Array) -> tuple[Array, Array]:
        """Rope wound and its rate of a sample with feedback, shape (instants, cables, 2).

        Parameters
        ----------
        times
            Within the present step, s, shape (instants,).
        paths, rates
            Path of each rope and its rate there, m and m/s, shape (instants, ropes).
        """
        ropes, own = self._batch.ropes[sample], self._answers[sample]
        found = [
            own.at(float(time), ropes, path, rate)
            for time, path, rate in zip(times, paths, rates, strict=True)
        ]
        return np.array([wound for wound, _ in found]), np.array([speed for _, speed in found])

    def chain_now(
        self, equation: Equation, sample: int, time: float, phi: float, rate: float
    ) -> ChainState:
        """A sample's cables at a time, by the equation of that sample alone."""
        here = np.array([[phi]]), np.array([[rate]])
        winding = Winding(self, equation, np.array([sample]), np.array([[time]]))
        wound, speed = winding.at(*here, [0])
        return self._batch.chain_state(sample, phi, rate, wound[0, 0], speed[0, 0])

    def begin(self, equation: Equation, who: Indices, time: Array, phi: Array, rate: Array) -> None:
        """Let the winches with feedback of some samples begin a step; arrays of their length."""
        for row in np.flatnonzero(self.answering[who]).tolist():
            sample = int(who[row])
            own = equation.take(np.array([row]))
            place = float(time[row]), float(phi[row]), float(rate[row])
            state = self.chain_now(own, sample, *place)
            ring = self._batch.scenes[sample].structure
            opening = math.pi - 2.0 * place[1]
            slopes = [
                ring.sections * float(path_slope(ring.half_bar, cable.block_offset, opening))
                for cable in self._batch.cables[sample]
            ]
            self._answers[sample].advance(place[0], state, np.array(slopes))


class Winding:
    """Rope wound at the instants of one step of some samples.

    Parameters
    ----------
    times
        The beginning of the step and its stages, s, shape (samples, instants).
    """

    def __init__(self, winches: Winches, equation: Equation, who: Indices, times: Array) -> None:
        self._winches, self._equation, self._who, self._times = winches, equation, who, times
        self._wound, self._speed = winches.prescribed(who, times)
        self._answering = np.flatnonzero(winches.answering[who]).tolist()

    def at(self, phi: Array, rate: Array, instants: list[int]) -> tuple[Array, Array]:
        """Rope wound and its rate, shape (samples, instants, cables, 2), m and m/s.

        Parameters
        ----------
        phi, rate
            The motion at ``instants`` (numbers of times), rad and rad/s.
        """
        wound, speed = self._wound[:, instants], self._speed[:, instants]
        if self._answering:
            paths, rates = self._equation.paths(phi, rate)
            for row in self._answering:
                wound[row], speed[row] = self._winches.answer(
                    int(self._who[row]), self._times[row, instants], paths[row], rates[row]
                )
        return wound, speed

    def taken(self, phi: Array, rate: Array) -> tuple[Array, Array]:
        """The same at all instants of a step that was taken.

        A law with feedback says how much rope it has wound at every stage; its rate is that of
        the polynomial through them, so that energy is counted for the rope that has moved.
        """
        wound, speed = self.at(phi, rate, list(range(self._times.shape[1])))
        for row in self._answering:
            duration = float(self._times[row, -1] - self._times[row, 0])
            speed[row, 1:] = radau.stage_rates(wound[row, 1:] - wound[row, 0], duration)
        return wound, speed
