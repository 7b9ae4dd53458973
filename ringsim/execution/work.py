"""What schedulers need to know about the samples that they run, and how one is solved."""

import importlib
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.outputs import VARIABLES
from ringsim.overrides import section_of
from ringsim.parts.solver import Limits
from ringsim.refusal import InputError
from ringsim.sampling.columns import Table
from ringsim.scene import Scene
from ringsim.storage.result import Result, pack, plain
from ringsim.units import Model, Second, Unit
from ringsim.variables import Cause, Fate, Outcome, Status

# What schedulers need to know about the samples that they run, their relative cost too.


Array = NDArray[np.float64]
_EXPONENTS = {
    "rods.elements": 0.7,
    "loads.force": -0.5,
    "solver.step": -1.0,
    "solver.tolerance": -1.0 / 3.0,
}
"""Cost grows like the input to this power: time per step measured over elements, duration of
the motion under a constant force, number of steps over the step or its tolerance."""

_ANCF = 2.7
"""Time of a run with rods of kind "ancf" over that of "geometrically-exact"."""
_ERROR_BARS = 3.3
"""Time of a run with error bars, which runs again with half the steps, over that without."""
_T = TypeVar("_T")


class Allowance(Model):
    """What one run may use before it is ended: the table [limits] of a campaign."""

    gone: ClassVar[dict[str, str]] = {
        name: f'that is a limit of the scene: [set] "limits.{name}" = VALUE'
        for name in Limits.model_fields
    }

    timeout: Second = 3600.0
    """Elapsed time of one run."""
    memory: Annotated[float, Field(ge=1e8, le=1e15), Unit("B")] = 8e9
    """Memory of the solver process."""
    recycle: Annotated[int, Field(ge=1)] = 2000
    """Runs after which a solver process is replaced by a fresh one."""


@dataclass(frozen=True)
class Work:
    """The samples' content, and where results go."""

    solver: str
    """``module:function`` that maps a scene to an outcome; a function ``prepare_FUNCTION`` beside
    it is called with the scene before the first run."""
    scene: dict[str, Any]
    values_of: Callable[[int], dict[str, Any]]
    """Inputs of a sample, or of one's check, by scene path."""
    allowance: Allowance
    keep: Callable[[Result], None]
    """Stores a result; called in the process that supervised the run."""
    stop: Callable[[], str]
    """A reason to stop, or an empty string; asked often."""
    started: Callable[[int], None] = lambda sample: None
    finished: Callable[[Result], None] = lambda result: None
    """Tell rank 0 what goes on; results of other ranks come without their arrays."""
    judge: str = ""
    """What maps the scenes of checks to outcomes; see ``ringsim.storage.result.check_of``."""
    more: bool = False
    """Whether such work may follow: solver processes of this machine then stand ready for it."""


class Scheduler:
    """The one seam between a campaign and its processes, all of which call the same methods.

    What stands here is for one that is alone.
    """

    rank = 0
    workers = 1
    """Samples that run at the same time."""
    description = ""
    """Who computes, in words."""

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run rank 0's samples, first ones first; returns why it stopped before the end, if so."""
        raise NotImplementedError

    def close(self) -> None:
        """End what stands ready for further work."""

    def from_first(self, value: _T) -> _T:
        """The value of rank 0, on all ranks."""
        return value

    def from_all(self, value: _T) -> list[_T]:
        """The values of all ranks, on all of them."""
        return [value]

    def wait(self) -> None:
        """Return when all ranks have come here."""


def relative_cost(table: Table, base: Scene) -> Array:
    """Predicted cost of every sample of the scene ``base``, shape (samples,), with a mean of 1."""
    cost = np.ones(table.samples)
    unused = "tolerance" if base.solver.step_control == "constant" else "step"
    for column in table.columns:
        path = section_of(column.path)[0]
        values = column.values.reshape(table.samples, -1)
        if path == "rods.kind":
            cost *= np.where(values[:, 0] == "ancf", _ANCF, 1.0)
        elif path == "solver.error_bars":
            cost *= np.where(values[:, 0].astype(bool), _ERROR_BARS, 1.0)
        elif path in _EXPONENTS and path != f"solver.{unused}" and not column.in_words:
            size = np.abs(values.astype(float)).mean(axis=1)
            cost *= np.maximum(size, 1e-12) ** _EXPONENTS[path]  # no force, no division by it
    return np.asarray(cost / cost.mean())


def longest_first(samples: NDArray[np.int64], cost: Array) -> list[int]:
    """Samples in the order of falling cost, equal ones by their index.

    >>> longest_first(np.array([0, 2, 3]), np.array([1.0, 9.0, 1.0, 2.0]))
    [3, 0, 2]
    """
    return [int(sample) for sample in samples[np.argsort(-cost[samples], kind="stable")]]


FULL = 30.0
"""Time of the full engine over that of frames: 20 to 50 (docs/evidence/frame.md)."""


def with_checks(samples: Sequence[int], checks: Sequence[int], workers: int) -> list[int]:
    """Samples in their order, and checks evenly among the first half of them, as far as a check
    less than half of the samples takes.

    A check takes as long as dozens of samples: where all came first, nothing else would be known
    for minutes; where they came last, workers would wait for each other.

    >>> with_checks([0, 1, 2, 3], [-1, -3], workers=1)
    [0, -1, -3, 1, 2, 3]
    >>> with_checks(range(100), [-1, -51], workers=1).index(-51)
    12
    """
    first = min(workers, len(samples))  # each worker begins with a sample
    step = max(len(samples) / 2 - first - FULL * workers, 0.0) / max(len(checks), 1)
    places = [*range(len(samples)), *(first - 0.5 + step * check for check in range(len(checks)))]
    order = np.argsort(places, kind="stable")
    return [[*samples, *checks][place] for place in order]


# One run, whatever happens in it: a result with a status, never an exception.


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
        refused, kind = isinstance(error, InputError), type(error).__name__
        reason = str(error) if refused else f"{kind}: {error}" if str(error) else kind
        cause = Cause.REFUSED if refused else Cause.EXCEPTION
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
