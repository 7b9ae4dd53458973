"""Recording a run step by step, and reducing it to its outcome at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs.family import COORDINATES, OUTPUTS, VARIABLES, Array, Output, axes, holds
from ringsim.outputs.instant import Energies, Instant
from ringsim.outputs.series import Run, Series, lock_times, output_times
from ringsim.scene import Scene
from ringsim.variables import Cause, Outcome, Reason, Status


@dataclass
class History:
    """What the control of a run needs of its steps so far; lists of equal length.

    Attributes
    ----------
    angles, rates
        Opening angles and rates, rad and rad/s, shape (planes, sections) each.
    gaps
        Largest joint gap, m.
    tensions
        Tension of every span of all cables behind one another, N; empty without cables.
    """

    times: list[float] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    rates: list[Array] = field(default_factory=list)
    energies: list[Energies] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    tensions: list[Array] = field(default_factory=list)
    status: Status = Status.UNFINISHED
    reason: str = ""
    cause: Cause = Cause.NONE
    newton_iterations: int = 0
    jacobians: int = 0
    halvings: int = 0

    def end(self, status: Status, reason: Reason) -> None:
        """Note how the run ended and why."""
        self.status, self.reason, self.cause = status, str(reason), reason.cause


class Recorder:
    """The outputs of one run of a scene, and the ``history`` that its control needs."""

    def __init__(self, scene: Scene, coordinates: Mapping[str, NDArray[Any]] | None = None) -> None:
        """Begin a run; ``coordinates`` are those that its outputs declare themselves."""
        self.history = History()
        self._scene, self._coordinates = scene, coordinates or {}
        self._readings: dict[Output, list[Any]] = {output: [] for output in outputs_of(scene)}
        self._lost = self._driven = 0.0

    def note(self, now: Instant) -> None:
        """Keep an accepted step; its energies lost and driven are those since the step before."""
        history, energies = self.history, now.energies
        history.times.append(now.time)
        history.angles.append(now.angles)
        history.rates.append(now.rates)
        history.energies.append(energies)
        history.gaps.append(now.gap)
        if now.chain is not None:
            history.tensions.append(now.chain.tensions)
        self._lost += energies.lost
        self._driven += energies.driven
        work = energies.work + self._driven
        now = replace(now, energies=energies._replace(work=work, lost=self._lost, driven=0.0))
        for output, readings in self._readings.items():
            readings.append(output.read(now))

    def outcome(self) -> Outcome:
        """Put the run on the output grid; what lies after its end is NaN."""
        history, grid = self.history, output_times(self._scene)
        times, rates = np.array(history.times), np.array(history.rates)
        angles = Series(times, np.array(history.angles), grid)
        counts = {
            "steps": len(times) - 1,
            "repeated_steps": history.halvings,
            "newton_iterations": history.newton_iterations,
            "jacobians": history.jacobians,
        }
        locks = lock_times(times, angles.values, rates)
        ending = (history.status, history.cause)
        run = Run(self._scene, angles, Series(times, rates, grid), locks, counts, *ending)

        def series_of(output: Output) -> Series | None:
            readings = self._readings[output]
            unknown = any(reading is None for reading in readings)
            return None if unknown else Series(times, np.array(readings, dtype=float), grid)

        values = reduced(run, self._readings, series_of)
        coordinates = spanned(values, axes(self._scene) | dict(self._coordinates))
        return Outcome(history.status, history.reason, coordinates, values, history.cause)


def outputs_of(scene: Scene) -> list[Output]:
    """The outputs that a scene holds everything for."""
    return [output() for output in OUTPUTS if set(output.needs) <= holds(scene)]


def reduced(
    run: Run, outputs: Iterable[Output], series_of: Callable[[Output], Series | None]
) -> dict[str, NDArray[Any]]:
    """Values of the outputs of a run; ``series_of`` gives what one has read, if this run can."""
    values: dict[str, Any] = {}
    for output in outputs:
        series = series_of(output)
        values |= {} if series is None else output.reduce(run, series)
    return {name: np.asarray(value) for name, value in values.items()}


def spanned(values: Iterable[str], known: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Those of the known coordinates that the named variables have."""
    dims = {dim for name in values for dim in VARIABLES[name].dims}
    return {dim: known[dim] for dim in COORDINATES if dim in dims}
