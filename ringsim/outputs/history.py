"""What a recorder remembers of a run, so that another run can go on from it."""

from typing import Any

import numpy as np

from ringsim.outputs.recorder import Recorder
from ringsim.refusal import InputError
from ringsim.stepping.instant import Energies
from ringsim.stepping.memory import Memory

_LISTS = ("times", "angles", "rates", "gaps")


def history_of(recorder: Recorder) -> Memory:
    """All steps so far, as arrays along the first axis; None of an output that could not tell."""
    readings: Memory = {}
    for output, values in recorder._readings.items():
        untold = any(value is None for value in values)
        readings[type(output).__name__] = None if untold else np.array(values, dtype=float)
    lists: dict[str, Any] = {name: np.array(getattr(recorder, name)) for name in _LISTS}
    return lists | {"energies": np.array(recorder.energies), "readings": readings}


def counts_of(recorder: Recorder) -> Memory:
    """What has been summed up by now."""
    return {
        "steps": len(recorder.times),
        "lost": recorder._lost,
        "driven": recorder._driven,
        "newton_iterations": recorder.newton_iterations,
        "jacobians": recorder.jacobians,
    }


def take_over(recorder: Recorder, history: Memory, counts: Memory, where: str) -> None:
    """Let a recorder go on behind the steps of another one.

    Raises
    ------
    InputError
        If its outputs need readings that the other one has not made.
    """
    steps, known = counts["steps"], history["readings"]
    for output, readings in recorder._readings.items():
        name = type(output).__name__
        if name not in known:
            names = ", ".join(variable.name for variable in output.variables)
            raise InputError(
                f"record: {where} has no readings of {names}: leave out what asks for them "
                f"({', '.join(output.needs)}), or record them in the first run, too"
            )
        past = known[name]
        readings[:] = [None] * steps if past is None else list(past[:steps])
    for name in _LISTS:
        values = history[name][:steps]
        setattr(recorder, name, values.tolist() if values.ndim == 1 else list(values))
    recorder.energies = [Energies(*row.tolist()) for row in history["energies"][:steps]]
    recorder._lost, recorder._driven = counts["lost"], counts["driven"]
    recorder.newton_iterations = counts["newton_iterations"]
    recorder.jacobians = counts["jacobians"]


def forget_last(recorder: Recorder) -> None:
    """Take the last step out, to note it anew."""
    last = recorder.energies[-1]
    recorder._lost -= last.lost
    recorder._driven -= last.driven
    lists = (getattr(recorder, name) for name in (*_LISTS, "energies"))
    for values in (*lists, *recorder._readings.values()):
        values.pop()
