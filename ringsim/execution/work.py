"""What schedulers need to know about the samples that they run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

from pydantic import Field

from ringsim.storage.record import Result
from ringsim.units import Model, Second, Unit

Bytes = Annotated[float, Field(ge=1e8, le=1e15), Unit("B")]


class Limits(Model):
    """What one run may use before it is ended."""

    timeout: Second = 3600.0
    """Elapsed time of one run."""
    memory: Bytes = 8e9
    """Memory of the solver process."""
    recycle: Annotated[int, Field(ge=1)] = 2000
    """Runs after which a solver process is replaced by a fresh one."""


@dataclass(frozen=True)
class Task:
    """One run that is asked for."""

    sample: int
    values: dict[str, Any]


@dataclass(frozen=True)
class Work:
    """The samples' content, and where results go.

    Attributes
    ----------
    solver
        ``module:function`` that maps a scene to an outcome.
    scene
        Base scene as nested tables.
    values_of
        Inputs of a sample by scene path.
    limits
        Bounds on one run.
    keep
        Stores a result; called in the process that supervised the run.
    started, finished
        Tell the scheduling process what goes on; results come without their arrays.
    stop
        A reason to stop, or an empty string; asked often.
    """

    solver: str
    scene: dict[str, Any]
    values_of: Callable[[int], dict[str, Any]]
    limits: Limits
    keep: Callable[[Result], None]
    started: Callable[[int], None]
    finished: Callable[[Result], None]
    stop: Callable[[], str]

    def task(self, sample: int) -> Task:
        """The run of a sample."""
        return Task(sample, self.values_of(sample))


class Scheduler(Protocol):
    """The one seam between a campaign and the processes that compute it."""

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples, first ones first; returns the reason if it stopped before the end."""
        ...
