"""States stored on the way of a run, and going on from one."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ringsim.outputs.recorder import Recorder
from ringsim.parts.faults.family import AT_ONCE, Fault
from ringsim.refusal import InputError, show
from ringsim.scene import Scene
from ringsim.stepping.instant import Array
from ringsim.stepping.memory import Memory, pack, unpack
from ringsim.stepping.run_control import RunControl
from ringsim.variables import Status

FORMAT = 4
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
        What ``ringsim.stepping.memory.pack`` has made of ``memory`` and ``history``.
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
        """Whether a scene moves in another way."""
        return any(path.split(".")[0] not in _BESIDE for path in self.changes_in(scene))

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
