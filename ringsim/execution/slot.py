"""A worker slot: samples one after the other in a supervised solver process."""

from __future__ import annotations

import signal
import time
from collections import deque
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

from ringsim.execution.process import SolverProcess
from ringsim.execution.solve import LOG_CHARACTERS
from ringsim.execution.work import Limits, Task, Work
from ringsim.refusal import InputError
from ringsim.storage.result import Result
from ringsim.variables import Cause, Status

TICK = 0.2
"""Seconds between two looks at a process that says nothing."""

_START_SECONDS = 120.0
_PAUSE_SECONDS = 1.0
"""Nobody looked for so long: a batch system suspended the job, or the machine is overloaded."""
_MOST_DEATHS_FROM_OUTSIDE = 2
_CAUSES = {
    Status.CRASHED: Cause.CRASH, Status.TIMEOUT: Cause.TIME_LIMIT, Status.MEMORY: Cause.MEMORY,
}  # fmt: skip
_FROM_OUTSIDE = (
    -signal.SIGKILL, -signal.SIGTERM, -signal.SIGHUP, -signal.SIGINT, -signal.SIGUSR1,
)  # fmt: skip
"""Signals that others send: the kernel, batch systems, and the stop signals of a campaign, which
a process that is just starting does not ignore yet."""


class Slot:
    """Runs one sample at a time in a process of its own.

    A run that crashes, hangs or eats memory costs this process and nothing else.  A process
    that somebody else killed is no fault of the sample: the run is repeated.  The parameters are
    those of :class:`Work`.
    """

    def __init__(self, solver: str, scene: dict[str, Any], limits: Limits) -> None:
        self._setup = {"solver": solver, "scene": scene, "limits": limits}
        self._limits = limits
        self._process: SolverProcess | None = None
        self._task: Task | None = None
        self._deaths = 0
        self._begin = self._deadline = self._look = 0.0

    @property
    def busy(self) -> bool:
        """Whether a sample is running."""
        return self._task is not None

    @property
    def pipe(self) -> Connection:
        """The pipe to wait on while busy."""
        return self._running()[0].pipe

    def submit(self, task: Task) -> None:
        """Start a sample, or refuse if that cannot be done; the slot must not be busy."""
        self._begin, self._deaths = time.monotonic(), 0
        self._send(task)

    def poll(self) -> Result | None:
        """The result, once there is one; call it when the pipe is ready or after a tick."""
        while self._task is not None and self.pipe.poll():
            process, _ = self._running()
            try:
                message = process.pipe.recv()
            except (EOFError, OSError):
                return self._died()
            if isinstance(message, Result):
                self._task = None
                return self._with_log(message, process.printed())
            if message:
                raise InputError(str(message))
            process.ready = True
            self._deadline = time.monotonic() + self._limits.timeout
        now = time.monotonic()
        if self._task is None or now < self._look:
            return None
        if now - self._look > _PAUSE_SECONDS:
            self._deadline += now - self._look  # this process has been asleep, and the run perhaps
        self._look = now + TICK
        return self._check(now)

    def serve(self, queue: deque[int], work: Work) -> Result | None:
        """Keep the result that is there, if there is one, and start the next sample if it is free.

        InputError if the solver process cannot be started, or the result not be written.
        """
        result = self.poll() if self.busy else None
        if result is not None:
            work.keep(result)
            work.finished(result)
        if queue and not self.busy and not work.stop():
            sample = queue.popleft()
            self.submit(work.task(sample))
            work.started(sample)
        return result

    def close(self) -> None:
        """End the process at once, whatever it does."""
        if self._process is not None:
            self._process.close()
        self._process = self._task = None

    def _running(self) -> tuple[SolverProcess, Task]:
        if self._process is None or self._task is None:
            raise RuntimeError("a slot has a process and a task only while it is busy")
        return self._process, self._task

    def _send(self, task: Task) -> None:
        if self._process is None or self._process.runs >= self._limits.recycle:
            self.close()
            self._process = SolverProcess(self._setup)
        self._task = task
        self._process.runs += 1
        now = time.monotonic()
        self._look = now + TICK
        self._deadline = now + (self._limits.timeout if self._process.ready else _START_SECONDS)
        self._process.send(task)

    def _with_log(self, result: Result, printed: str) -> Result:
        """The solver's own result, with what only this process knows."""
        if result.status is Status.MEMORY:
            result = replace(result, reason=self._too_much())
        if result.status.failed:
            result = replace(result, log=(printed + result.log)[-LOG_CHARACTERS:])
        return replace(result, seconds=time.monotonic() - self._begin)

    def _check(self, now: float) -> Result | None:
        process, _ = self._running()
        if process.exit_code() is not None and not process.pipe.poll():
            return self._died()
        if now > self._deadline:
            self._require_started(process)
            process.tell_where_it_is()
            return self._give_up(
                Status.TIMEOUT,
                f"still running after limits.timeout = {self._limits.timeout:g} s: raise it, or "
                "raise solver.tolerance",
            )
        if process.memory() > self._limits.memory:
            return self._give_up(Status.MEMORY, self._too_much())
        return None

    def _too_much(self) -> str:
        return f"the run needed more than limits.memory = {self._limits.memory:g} B"

    def _require_started(self, process: SolverProcess) -> None:
        if not process.ready:
            raise InputError(f"the solver process does not start: {process.printed()}")

    def _died(self) -> Result | None:
        process, task = self._running()
        code = process.exit_code(5.0) or 0
        if code in _FROM_OUTSIDE and self._deaths < _MOST_DEATHS_FROM_OUTSIDE:
            self._deaths += 1
            self.close()
            self._send(task)
            return None
        self._require_started(process)
        if "bad_alloc" in process.printed():
            return self._give_up(Status.MEMORY, self._too_much())
        if code == -signal.SIGALRM:
            return self._give_up(Status.TIMEOUT, "still running long after limits.timeout")
        how = f"died of {signal.Signals(-code).name}" if code < 0 else f"left with exit code {code}"
        return self._give_up(Status.CRASHED, f"the solver process {how}")

    def _give_up(self, status: Status, reason: str) -> Result:
        process, task = self._running()
        result = Result(task.sample, status, reason, _CAUSES[status], finished=time.time())
        result = self._with_log(result, process.printed())
        self.close()
        return result
