"""Recording a run step by step, and reducing it to its outcome at the end."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs.family import COORDINATES, OUTPUTS, VARIABLES, Array, Output, axes, holds
from ringsim.outputs.latching import missed
from ringsim.outputs.longest_slack import slackened
from ringsim.outputs.series import Reading, Run, Series, output_times
from ringsim.outputs.shocks import jerked, unresolved
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.stepping.instant import Energies
from ringsim.stepping.locks import lock_times
from ringsim.stepping.memory import Memory, Remembering
from ringsim.variables import Fate, Outcome, Reason, Status


class Recorder(Remembering):
    """A run of a scene: ``times``, ``angles``, ... of all accepted steps (see ``Instant``).

    An engine sets ``status``, ``fate`` and ``reason``, how and why it has ended, which latches have
    ``caught``, and what its solver took.
    """

    changing = ("newton_iterations", "jacobians", "_lost", "_driven")

    def __init__(self, scene: Scene, coordinates: Mapping[str, NDArray[Any]] | None = None) -> None:
        """Begin a run; ``coordinates`` are those that its outputs declare themselves."""
        self._scene, self._coordinates = scene, coordinates or {}
        self._readings: dict[Output, list[Any]] = {output: [] for output in outputs_of(scene)}
        self._before: list[tuple[float, Scene]] = []
        self._lost = self._driven = 0.0
        self.times: list[float] = []
        self.angles: list[Array] = []
        self.rates: list[Array] = []
        self.energies: list[Energies] = []
        self.gaps: list[float] = []
        self.status, self.fate, self.reason = Status.OK, Fate.NONE, Reason()
        self.caught: NDArray[np.bool_] | None = None
        self.repeats = self.newton_iterations = self.jacobians = 0

    def note(self, now: Reading) -> None:
        """Keep an accepted step."""
        energies = now.energies
        self.times.append(now.time)
        self.angles.append(now.angles)
        self.rates.append(now.rates)
        self.energies.append(energies)
        self.gaps.append(now.gap)
        self._lost += energies.lost
        self._driven += energies.driven
        work = energies.work + self._driven
        told = Energies(energies.kinetic, energies.elastic, work, self._lost, self._driven)
        now = replace(now, energies=told)
        for output, readings in self._readings.items():
            readings.append(output.read(now))

    def forget_last(self) -> None:
        """Take the last step out, to note it anew."""
        last = self.energies[-1]
        self._lost -= last.lost
        self._driven -= last.driven
        for steps in (*self._lists().values(), self.energies, *self._readings.values()):
            steps.pop()

    def memory(self) -> Memory:
        """See ``Remembering``; of the steps their number, see ``history``."""
        return super().memory() | {"steps": len(self.times)}

    def history(self) -> Memory:
        """All steps so far, as arrays along the first axis; None of outputs that could not tell."""
        readings: Memory = {}
        for output, values in self._readings.items():
            untold = any(value is None for value in values)
            readings[type(output).__name__] = None if untold else np.array(values, dtype=float)
        lists: Memory = {name: np.array(steps) for name, steps in self._lists().items()}
        before = [[time, scene.to_table()] for time, scene in self._before]
        return lists | {
            "energies": np.array(self.energies), "readings": readings, "before": before
        }  # fmt: skip

    def take_over(
        self, history: Memory, memory: Memory, before: Sequence[tuple[float, Scene]], where: str
    ) -> None:  # fmt: skip
        """Go on behind the steps of another one, up to where it had the memory; it had scenes
        ``before``, each up to a time (s), and ``where`` is what messages call that.

        Raises
        ------
        InputError
            If outputs need readings that the other one has not made.
        """
        self.recall(memory)
        steps, known = memory["steps"], history["readings"]
        for output, readings in self._readings.items():
            name = type(output).__name__
            if name not in known:
                names = ", ".join(variable.name for variable in output.variables)
                raise InputError(
                    f"record: {where} has no readings of {names}: leave out what asks for them "
                    f"({', '.join(output.needs)}), or record them in the first run, too"
                )
            past = known[name]
            readings[:] = [None] * steps if past is None else list(past[:steps])
        for name, own in self._lists().items():
            values = history[name][:steps]
            own[:] = values.tolist() if values.ndim == 1 else list(values)
        self.energies[:] = [Energies(*row.tolist()) for row in history["energies"][:steps]]
        # What a scene was made of decides about readings that were made with it, ever after.
        self._before = list(before)
        while self._before and self._before[-1][1] == self._scene:  # nothing has changed since
            self._before.pop()

    def _lists(self) -> dict[str, list[Any]]:
        return {name: getattr(self, name) for name in ("times", "angles", "rates", "gaps")}

    def outcome(self) -> Outcome:
        """Put the run on the output grid; what lies after its end is NaN."""
        times, grid = np.array(self.times), output_times(self._scene)
        angles, rates = np.array(self.angles), np.array(self.rates)
        counts = {
            "steps": len(times) - 1,
            "repeated_steps": self.repeats,
            "newton_iterations": self.newton_iterations,
            "jacobians": self.jacobians,
        }
        known = axes(self._scene) | dict(self._coordinates)
        run = Run(
            self._scene, Series(times, angles, grid), Series(times, rates, grid),
            lock_times(times, angles, rates), counts, known, tuple(self._before), self.caught,
        )  # fmt: skip

        def series_of(output: Output) -> Series | None:
            readings = self._readings[output]
            unknown = any(reading is None for reading in readings)
            return None if unknown else Series(times, np.array(readings, dtype=float), grid)

        values = reduced(run, self._readings, series_of)
        coordinates = spanned(values, known)
        passed = overloads(self._scene, self._readings, series_of)
        loose = slackened(self._scene, values)
        found = ended(self.status, self.fate, self.reason, passed, loose, coordinates, values)
        told = "" if self.status.failed else unresolved(run) + jerked(run)
        return replace(found, reason=found.reason + told)


def outputs_of(scene: Scene) -> list[Output]:
    """The outputs that a scene holds everything for."""
    return [output() for output in OUTPUTS if set(output.needs) <= holds(scene)]


def overloads(
    scene: Scene, outputs: Iterable[Output], series_of: Callable[[Output], Series | None]
) -> str:
    """Which limits of the scene the readings of a run have passed, by what and when."""
    found = ""
    for output in outputs:
        most = getattr(scene.limits, output.limit) if output.limit else None
        series = None if most is None else series_of(output)
        if series is None:
            continue
        largest = np.nanmax(series.values.reshape(len(series.times), -1), axis=1)
        if largest.max() > most:
            unit, time = output.variables[0].units, series.times[largest.argmax()]
            found += (
                f"; {largest.max():.4g} {unit} at {time:.6g} s, "
                f"more than limits.{output.limit} = {most:g} {unit}"
            )
    return found


def ended(
    status: Status, fate: Fate, reason: Reason, passed: str, loose: str,
    coordinates: dict[str, NDArray[Any]], values: dict[str, NDArray[Any]],
) -> Outcome:  # fmt: skip
    """The outcome of a run that ended so; ``passed`` are the limits of loads that it went over,
    ``loose`` that of slack ropes.
    """
    if not status.failed and fate is not Fate.OVERLOADED:
        fate = Fate.OVERLOADED if passed else Fate.SLACKENED if loose else fate
    passed += loose
    passed += missed(values, coordinates.get("plane", np.array([])).tolist())
    values["outcome"] = np.array(int(fate))
    return Outcome(status, str(reason) + passed, coordinates, values, reason.cause)


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
