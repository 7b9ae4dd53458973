"""One run, whatever happens in it: a result with a status, never an exception."""

import importlib
import time
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from ringsim.outputs import VARIABLES
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.storage.result import Result, pack, plain
from ringsim.variables import Cause, Fate, Outcome, Status

Run = Callable[[Scene], Outcome]
LOG_CHARACTERS = 4000
"""So much of what a failed run printed is kept."""

_ALWAYS_THERE = ("final_time", "energy_error", "constraint_error", "asynchrony_max")
"""Numbers that every run has that went well."""


def load_solver(name: str) -> Run:
    """The function ``module:function``; InputError if there is none."""
    module, _, function = name.partition(":")
    try:
        solver: Run = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InputError(f"solver {name} cannot be loaded: {error}") from None
    return solver


def prepare(name: str, base: Scene) -> None:
    """Let ``module:prepare_FUNCTION``, if there is one, load and compile; InputError if it refuses
    the scene.
    """
    module, _, function = name.partition(":")
    ready = getattr(importlib.import_module(module), f"prepare_{function}", None)
    if ready is not None:
        ready(base)


def solve(solver: Run, base: Scene, sample: int, values: dict[str, Any]) -> Result:
    """Run one sample of the scene ``base``, with its values by scene path."""
    begin, log, form, body, fate = time.monotonic(), "", "", b"", Fate.NONE
    try:
        outcome = solver(base.with_values(values))
        form, body = pack(outcome.coordinates | outcome.values)
        status, reason, cause = Status(outcome.status), str(outcome.reason), outcome.cause
        fate = outcome.fate
        if not status.failed and (fault := _not_finite(outcome)):
            status, reason, cause = Status.DIVERGED, fault, Cause.NOT_FINITE
    except MemoryError:
        status, reason = Status.MEMORY, "the run needed more memory than allowed"
        log, cause = traceback.format_exc(), Cause.MEMORY
    except (Exception, SystemExit) as error:
        status, log = Status.ERROR, traceback.format_exc()
        reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        cause = Cause.REFUSED if isinstance(error, InputError) else Cause.EXCEPTION
    reason, log = plain(" ".join(reason.split())[:1000]), plain(log[-LOG_CHARACTERS:])
    seconds = time.monotonic() - begin
    return Result(
        sample, status, reason, cause, log, seconds, time.time(), form, body, fate=fate
    )  # fmt: skip


def _not_finite(outcome: Outcome) -> str:
    """What is wrong with the numbers of a run that says it went well; empty if nothing is.

    Values may be missing after the end of a run, for times that never came, in rows of things that
    are not there, and where a variable has gaps.
    """
    axis = outcome.coordinates.get("time")
    final = outcome.values.get("final_time")
    for name, values in outcome.values.items():
        array = np.asarray(values)
        if array.dtype.kind != "f" or name not in VARIABLES:
            continue
        if np.isinf(array).any():
            return f"{name} is infinite: try a smaller solver.step"
        if VARIABLES[name].gaps:
            continue
        dims = VARIABLES[name].dims
        if "time" in dims and axis is not None and final is not None:
            along = dims.index("time")
            end = np.fmin(outcome.values.get(VARIABLES[name].until, np.nan), final)
            gaps = np.isnan(np.compress(np.asarray(axis) <= float(end), array, axis=along))
            broken = bool((gaps.any(axis=along) & ~gaps.all(axis=along)).any())
        else:
            broken = name in _ALWAYS_THERE and bool(np.isnan(array).any())
            if name == "energy_error" and "dissipation" in outcome.values:
                # Nobody can tell the dissipation of damped ANCF rods, nor then the energy's error.
                broken = broken and not np.isnan(outcome.values["dissipation"]).all()
        if broken:
            return f"{name} is not a number: try a smaller solver.step"
    return ""
