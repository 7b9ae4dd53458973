"""Recording a run step by step, reducing it to its outcome, and storing its states."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.layout import Layout
from ringsim.outputs.base import jerked, unresolved
from ringsim.outputs.family import (
    COORDINATES,
    OUTPUTS,
    VARIABLES,
    Array,
    Output,
    Reading,
    Run,
    Series,
    Values,
    axes,
    holds,
    output_times,
    top_of,
)
from ringsim.outputs.joints import missed
from ringsim.outputs.meters import together
from ringsim.outputs.rods_and_cables import slackened
from ringsim.parts.faults import AT_ONCE, Fault
from ringsim.refusal import InputError, show
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.stepping.control import RunControl
from ringsim.stepping.instant import Energies, Memory, Remembering, pack, unpack
from ringsim.stepping.locks import lock_times
from ringsim.tables import with_unit
from ringsim.variables import Fate, Outcome, Reason, Status

# Recording a run step by step, and reducing it to its outcome at the end.


_MOST_LATE = 256
"""Steps that are read at once at most: what is kept of each is as much as what outputs keep."""


class Recorder(Remembering):
    """A run of a scene: ``times``, ``angles``, ... of all accepted steps (see ``Instant``).

    An engine sets ``status``, ``fate`` and ``reason``, how and why it has ended, which latches have
    ``caught``, what its solver took, and which energy is ``slight``.  ``readings`` are those of
    every output at these steps.
    """

    changing = ("newton_iterations", "jacobians", "_lost", "_driven")

    def __init__(
        self, scene: Scene, coordinates: Mapping[str, NDArray[Any]] | None = None,
        layout: Layout | None = None,
    ) -> None:  # fmt: skip
        """Begin a run; ``coordinates`` are those that its outputs declare themselves."""
        self._scene, self._coordinates = scene, coordinates or {}
        self._readings: dict[Output, list[Any]] = {output: [] for output in outputs_of(scene)}
        self._late: list[tuple[Reading, Energies]] = []
        self._before: list[tuple[float, Scene]] = []
        self._lost = self._driven = 0.0
        self.times: list[float] = []
        self.angles: list[Array] = []
        self.rates: list[Array] = []
        self.energies: list[Energies] = []
        self.gaps: list[float] = []
        self.status, self.fate, self.reason = Status.OK, Fate.NONE, Reason()
        self.caught: NDArray[np.bool_] | None = None
        self.slight, self.layout = 0.0, layout
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
        self._late.append((now, told))
        for output, readings in self._readings.items():
            if not output.late:
                readings.append(output.read(replace(now, energies=told)))
        if len(self._late) == _MOST_LATE:
            self._read_late()

    @property
    def readings(self) -> dict[Output, list[Any]]:
        """What outputs have read of all steps."""
        self._read_late()
        return self._readings

    def _read_late(self) -> None:
        """Let outputs read that can read many steps at once: as long as the ropes are the same."""
        for _, own in itertools.groupby(
            self._late, lambda one: id(getattr(one[0].chain, "ropes", 0))
        ):
            steps = list(own)
            whole = together(*zip(*steps, strict=True))
            for output, readings in self._readings.items():
                if output.late:
                    values = output.read(whole)
                    readings += [None] * len(steps) if values is None else list(np.asarray(values))
        self._late.clear()

    def memory(self) -> Memory:
        """See ``Remembering``; of the steps their number, see ``history``."""
        return super().memory() | {"steps": len(self.times)}

    def history(self) -> Memory:
        """All steps so far, as arrays along the first axis; None of outputs that could not tell."""
        readings: Memory = {}
        for output, values in self.readings.items():
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
        for output, readings in self.readings.items():
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
            own[:] = values.tolist() if values.ndim == 1 else list(np.asarray(values))
        self.energies[:] = [Energies(*row.tolist()) for row in history["energies"][:steps]]
        # What a scene was made of decides about readings that were made with it, ever after.
        self._before = list(before)
        # Nothing has changed since.
        while self._before and substituted(self._before[-1][1]) == substituted(self._scene):
            self._before.pop()

    def _lists(self) -> dict[str, list[Any]]:
        return {name: getattr(self, name) for name in ("times", "angles", "rates", "gaps")}

    def outcome(self) -> Outcome:
        """Put the run on the output grid; what lies after its end is NaN."""
        every, grid = np.array(self.times), output_times(self._scene)
        # Where forces jump there are two readings of one time, between which nothing moves.
        steps = np.flatnonzero(np.diff(every, append=math.inf) > 0.0)
        times, angles, rates = (
            every[steps],
            np.array(self.angles)[steps],
            np.array(self.rates)[steps],
        )
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
            self.slight, self.layout,
        )  # fmt: skip

        @cache
        def series_of(output: Output) -> Series | None:
            readings = self.readings[output]
            unknown = any(reading is None for reading in readings)
            return None if unknown else Series(every, np.array(readings, dtype=float), grid)

        values = reduced(run, self.readings, series_of)
        coordinates = spanned(values, known)
        passed = overloads(self._scene, self.readings, series_of)
        loose = slackened(self._scene, values)
        found = ended(self.status, self.fate, self.reason, passed, loose, coordinates, values)
        shaken = [shock for output in self.readings for shock in output.shocks]
        times_of = {name: float(values.get(f"{peak.name}_time", np.nan)) for name, peak in shaken}
        shocks = {name: time for name, time in times_of.items() if np.isfinite(time)}
        told = "" if self.status.failed else unresolved(run, shocks) + jerked(run)
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
        if series is None or most is None:
            continue
        top = top_of(series.times, series.values)
        if top.value > most:
            unit = output.variables[0].units
            found += (
                f"; {with_unit(f'{top.value:.4g}', unit)} at {top.time:.6g} s, "
                f"more than limits.{output.limit} = {with_unit(f'{most:g}', unit)}"
            )
    return found


def against_limits(scene: Scene, values: Values) -> Iterator[str]:
    """The margin of each load for which the scene has a limit; nothing of others."""
    for output in OUTPUTS:
        most = getattr(scene.limits, output.limit) if output.limit else None
        series, *others = output.variables
        if most is None or series.name not in values:
            continue
        (peak,) = (one for one in others if one.largest_of == series.name)
        # A peak may count up to the last lock, a limit holds for the whole run.
        largest = max(float(values[peak.name]), float(np.nanmax(values[series.name])))
        if largest > 0.0 and peak.summary is not None:
            yield (
                f"{peak.summary[0]}: margin {most / largest - 1.0:+.3g} (limit / value - 1) to "
                f"limits.{output.limit} = {with_unit(f'{most:g}', peak.units)}"
            )
    most, longest = scene.limits.slack_duration, float(values.get("longest_slack", np.nan))
    if most is not None and longest > 0.0:
        yield (
            f"longest slack: margin {most / longest - 1.0:+.3g} (limit / value - 1) to "
            f"limits.slack_duration = {most:g} s"
        )


def ended(
    status: Status, fate: Fate, reason: Reason, passed: str, loose: str,
    coordinates: dict[str, NDArray[Any]], values: dict[str, NDArray[Any]],
) -> Outcome:  # fmt: skip
    """The outcome of a run that ended so; ``passed`` are the limits of loads that it went over,
    ``loose`` that of slack ropes.
    """
    unlatched = fate is Fate.NOT_LATCHED
    if not status.failed and fate is not Fate.OVERLOADED:
        fate = Fate.OVERLOADED if passed else Fate.SLACKENED if loose else fate
    passed += loose
    lost = missed(values, coordinates.get("plane", np.array([])).tolist())
    # What a ring that is not latched lacks comes before how it came to rest.
    parts = [lost, str(reason) + passed] if unlatched else [str(reason) + passed, lost]
    values["outcome"] = np.array(int(fate))
    return Outcome(status, "; ".join(filter(None, parts)), coordinates, values, reason.cause)


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


# States stored on the way of a run, and going on from one.


FORMAT = 8
"""Of what is stored; a state of another format is refused."""


@dataclass(frozen=True)
class StoredState:
    """A state that a run can go on from, read from a file.

    Attributes
    ----------
    source, time, engine
        File, time (s) and which engine has stored it ("frame").
    scene
        The scene of the run that it was.
    packed, packed_history
        What ``ringsim.stepping.instant.pack`` has made of ``memory`` and ``history``.
    """

    source: str
    time: float
    engine: str
    scene: Scene
    packed: tuple[str, Array] = field(repr=False)
    packed_history: tuple[str, Array] = field(repr=False)

    @property
    def memory(self) -> Memory:
        """What the engine remembers, in arrays of its own."""
        return dict(unpack(*self.packed))

    @property
    def history(self) -> Memory:
        """The steps of the run, also those behind the state."""
        return dict(unpack(*self.packed_history))

    @property
    def scenes(self) -> list[tuple[float, Scene]]:
        """What the run was made of up to here: scenes, each with the time up to which it had it, s;
        its own is the last.
        """
        told = self.history.get("before", [])
        older = [(time, Scene.model_validate(table)) for time, table in told if time < self.time]
        return [*older, (self.time, self.scene)]

    def changes_in(self, scene: Scene) -> dict[str, tuple[Any, Any]]:
        """Paths at which a scene differs, with the values before and now; None where one is left
        out.
        """
        return dict(_changes(self.scene.to_table(), scene.to_table()))

    def changed_to(self, scene: Scene) -> bool:
        """Whether a scene moves in another way, at whatever temperatures."""
        before, now = (substituted(each).to_table() for each in (self.scene, scene))
        return any(path.split(".")[0] not in _BESIDE for path, _ in _changes(before, now))

    def told(self, scene: Scene) -> str:
        """From where a scene goes on, and what is another than before."""
        changes = ", ".join(
            f"{path} = {'none' if now is None else show(now)}"
            for path, (_, now) in self.changes_in(scene).items()
        )
        return f"went on from {self.name}" + (f" with {changes}" if changes else ", unchanged")

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"the state of {self.source} at {self.time:.9g} s"


_BESIDE = ("name", "title", "record", "solver", "limits", "margin")
"""Parts of a scene that do not move anything."""


def _changes(
    before: Any, now: Any, path: tuple[str, ...] = ()
) -> Iterator[tuple[str, tuple[Any, Any]]]:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*before, *now]):
            yield from _changes(before.get(key), now.get(key), (*path, key))
    elif before != now:
        yield ".".join(path), (before, now)


class States:
    """Collects states at the multiples of an interval (s) and at the end of a run."""

    def __init__(self, interval: float) -> None:
        self._interval, self._count = interval, 1
        self._times: list[float] = []
        self._forms: list[str] = []
        self._numbers: list[Array] = []

    @property
    def next_time(self) -> float:
        """When the next one is due, s."""
        return self._count * self._interval

    def skip(self, time: float) -> None:
        """Begin behind a time (s)."""
        self._count = max(1, math.floor((time + AT_ONCE) / self._interval) + 1)

    def due(self, control: RunControl) -> bool:
        """Whether the step that was accepted last is to be stored."""
        ended = not control.goes_on and control.status == Status.OK
        return ended or control.now.time >= self.next_time - AT_ONCE

    def keep(self, control: RunControl, recorder: Recorder, memory: Memory) -> None:
        """Store a state with what an engine remembers."""
        self.skip(control.now.time)
        stepping = {"stepping": control.memory(), "recorder": recorder.memory()}
        form, numbers = pack(memory | stepping)
        self._times.append(control.now.time)
        self._forms.append(form)
        self._numbers.append(numbers)

    def arrays(self, recorder: Recorder, engine: str) -> dict[str, np.ndarray[Any, Any]]:
        """See ``ringsim.variables.Outcome.states``."""
        if not self._times:
            return {}
        form, numbers = pack(recorder.history())
        lengths = [len(each) for each in (numbers, *self._numbers)]
        return {
            "state_time": np.array(self._times),
            "state_begin": np.cumsum(lengths)[:-1],
            "state_form": np.array(self._forms, dtype=object),
            "state": np.concatenate([numbers, *self._numbers]),
            "history_form": np.array(form),
            "state_format": np.array(FORMAT),
            "state_engine": np.array(engine),
        }


def struck_by(faults: tuple[Fault, ...], time: float) -> list[Fault]:
    """Faults that have struck up to a time (s), in their order."""
    found = [fault for fault in faults if fault.time <= time + AT_ONCE]
    return sorted(found, key=lambda fault: fault.time)


def cleared(scene: Scene, start: StoredState) -> list[Fault]:
    """Faults that have struck in a stored state and that a scene no longer has.

    Raises
    ------
    InputError
        If the scene has a fault that ought to have struck before, but has not.
    """
    before = struck_by(start.scene.faults, start.time)
    own = struck_by(scene.faults, start.time)
    for fault in own:
        if fault not in before:
            number = scene.faults.index(fault)
            raise InputError(
                f"faults[{number}].time = {show(fault.time)} s: has not struck in {start.name}: "
                "give a time after that, or start without --from"
            )
    return [fault for fault in before if fault not in own]
