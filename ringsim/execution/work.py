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


class Retry(Model):
    """Repeating a run that the solver could not finish, each time with a smaller step.

    Where it does, runs do not start anew by themselves (``solver.restarts``): a sample is
    attempted 1 + times times, not (1 + times) (1 + restarts) times.
    """

    times: Annotated[int, Field(ge=0, le=10)] = 0
    step_factor: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.5
    """Factor on solver.step from one attempt to the next."""


@dataclass(frozen=True)
class Task:
    """One run that is asked for."""

    sample: int
    values: dict[str, Any]
    shrink: float = 1.0
    """Factor on the scene's largest step."""
    restarts: bool = True
    """Whether the run may start anew by itself (``solver.restarts``)."""


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
    limits, retry
        Bounds on one run, and what to repeat.
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
    retry: Retry
    keep: Callable[[Result], None]
    started: Callable[[int], None]
    finished: Callable[[Result], None]
    stop: Callable[[], str]

    def task(self, sample: int) -> Task:
        """The first run of a sample."""
        return Task(sample, self.values_of(sample), restarts=self.retry.times == 0)


class Scheduler(Protocol):
    """The one seam between a campaign and the processes that compute it."""

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples, first ones first; returns the reason if it stopped before the end."""
        ...
