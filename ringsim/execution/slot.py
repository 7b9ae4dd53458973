"""Worker slots: samples one after the other in supervised solver processes, on this machine."""

import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from ringsim.execution.child import scratch_folder
from ringsim.execution.work import LOG_CHARACTERS, Allowance, Scheduler, Work, load_solver, solve
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.storage.result import Result, plain
from ringsim.tables import counted
from ringsim.threads import ENVIRONMENT
from ringsim.variables import Cause, Status

# A worker slot: samples one after the other in a supervised solver process.


TICK = 0.2
"""Seconds between two looks at a process that says nothing."""

_START_SECONDS = 300.0
"""Longest time until a process is ready, with code that it compiles, or waits for others to."""
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

_OF_MPI = ("PMI", "PMIX", "OMPI", "OPAL", "PRTE", "HYDRA", "HYDI", "MPI", "I_MPI", "MPIR")
"""How names of variables begin by which launchers and libraries speak to each other."""

_ADDRESS = re.compile(r"0x[0-9a-fA-F]+")
_END_SECONDS = 10.0
_PRINTING_SECONDS = 0.05


def without_mpi() -> dict[str, str]:
    """The environment of a process that is to know nothing of an MPI launcher."""
    return {k: v for k, v in os.environ.items() if not k.startswith(_OF_MPI)}


class SolverProcess:
    """``ringsim.execution.child`` in a folder of its own; InputError if it cannot be started."""

    def __init__(self, setup: dict[str, Any]) -> None:
        self.ready, self.runs = False, 0
        mine, other = socket.socketpair()
        self.pipe = Connection(mine.detach())
        environment = without_mpi() | dict.fromkeys(ENVIRONMENT, "1")
        environment["PYTHONPATH"] = os.pathsep.join(os.path.abspath(path) for path in sys.path)
        # Unbuffered: a crash would take with it what has not been written.
        command = [sys.executable, "-P", "-u", "-m", "ringsim.execution.child"]
        scratch = ""
        try:
            scratch = scratch_folder()
            with other, open(f"{scratch}/log", "ab") as log:
                self._process = subprocess.Popen(
                    [*command, str(other.fileno()), str(os.getpid())],
                    stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=scratch, env=environment,
                    pass_fds=[other.fileno()], start_new_session=True,
                )  # fmt: skip
        except OSError as error:
            self.pipe.close()
            other.close()
            shutil.rmtree(scratch, ignore_errors=True)
            raise InputError(
                f"the solver process cannot be started: {error}; use fewer workers, or free some "
                f"space in {tempfile.gettempdir()} (TMPDIR)"
            ) from error
        self._scratch, self.pid = Path(scratch), self._process.pid
        self.send(setup)

    def send(self, message: Any) -> None:
        """Say something to the process; one that is dead does not hear it."""
        with contextlib.suppress(BrokenPipeError):
            self.pipe.send(message)

    def exit_code(self, seconds: float = 0.0) -> int | None:
        """How it ended, negative numbers for signals; None if it still runs after so long."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._process.wait(seconds)
        return None

    def tell_where_it_is(self) -> None:
        """Let it print where it is just now."""
        self._process.send_signal(signal.SIGUSR2)
        time.sleep(_PRINTING_SECONDS)

    def memory(self) -> int:
        """Bytes of memory that it holds; 0 where the system does not tell."""
        with contextlib.suppress(OSError, IndexError):
            pages = Path(f"/proc/{self.pid}/statm").read_text().split()[1]
            return int(pages) * os.sysconf("SC_PAGE_SIZE")
        return 0

    def printed(self) -> str:
        """The end of what it has printed since the sample began."""
        try:
            with (self._scratch / "log").open("rb") as log:
                log.seek(max(0, log.seek(0, os.SEEK_END) - LOG_CHARACTERS))
                return _ADDRESS.sub("0x", plain(log.read().decode("utf-8", "replace")))
        except OSError:
            return ""

    def close(self) -> None:
        """End it at once, whatever it does."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        self.exit_code(_END_SECONDS)  # the kernel may hold it, waiting for a disk
        self.pipe.close()
        shutil.rmtree(self._scratch, ignore_errors=True)


class Slot:
    """Runs one sample at a time in a process of its own.

    A run that crashes, hangs or eats memory costs this process and nothing else.  A process
    that somebody else killed is no fault of the sample: the run is repeated.
    """

    pipe: Connection
    """What to wait on while a sample is running."""

    def __init__(
        self, solver: str, scene: dict[str, Any], allowance: Allowance, judge: str = ""
    ) -> None:
        self._setup = {"solver": solver, "scene": scene, "allowance": allowance, "judge": judge}
        self._allowance, self._deaths = allowance, 0
        self._process: SolverProcess | None = None
        self.busy = False
        self._begin = self._deadline = self._look = 0.0

    @property
    def pid(self) -> int:
        """The number of its process, 0 while it has none."""
        return 0 if self._process is None else self._process.pid

    def suits(self, work: Work) -> bool:
        """Whether it is set up for the runs of this work."""
        return tuple(self._setup.values()) == (work.solver, work.scene, work.allowance, work.judge)

    def submit(self, sample: int, values: dict[str, Any]) -> None:
        """Start a sample, or refuse if that cannot be done; the slot must not be busy."""
        self._begin, self._deaths = time.monotonic(), 0
        self._run = sample, values
        self._send()

    def poll(self) -> Result | None:
        """The result, once there is one; call it when the pipe is ready or after a tick."""
        if self._process is None or not self.busy:
            return None
        process = self._process
        while process.pipe.poll():
            try:
                message = process.pipe.recv()
            except (EOFError, OSError):
                return self._died(process)
            if isinstance(message, Result):
                self.busy = False
                return self._with_log(message, process.printed())
            if message:
                raise InputError(str(message))
            process.ready = True
            self._begin = time.monotonic()  # what it takes to start is not the run's
            self._deadline = self._begin + self._allowance.timeout
        now = time.monotonic()
        if now < self._look:
            return None
        if now - self._look > _PAUSE_SECONDS:
            self._deadline += now - self._look  # this process has been asleep, and the run perhaps
        self._look = now + TICK
        if process.exit_code() is not None and not process.pipe.poll():
            return self._died(process)
        if now > self._deadline:
            _require_started(process)
            process.tell_where_it_is()
            limit = f"limits.timeout = {self._allowance.timeout:g} s"
            why = f"still running after {limit}: raise this limit, or raise solver.tolerance"
            return self._give_up(process, Status.TIMEOUT, why)
        if process.memory() > self._allowance.memory:
            return self._give_up(process, Status.MEMORY)
        return None

    def serve(self, queue: deque[int], work: Work) -> Result | None:
        """Keep the result if there is one; start the next sample if free; InputError if refused."""
        result = self.poll()
        if result is not None:
            work.keep(result)
            work.finished(result)
        if queue and not self.busy and not work.stop():
            sample = queue.popleft()
            self.submit(sample, work.values_of(sample))
            work.started(sample)
        return result

    def close(self) -> None:
        """End the process at once, whatever it does."""
        if self._process is not None:
            self._process.close()
        self._process, self.busy = None, False

    def _send(self) -> None:
        process = self._process
        if process is None or process.runs >= self._allowance.recycle:
            self.close()
            process = self._process = SolverProcess(self._setup)
            self.pipe = process.pipe
        self.busy = True
        process.runs += 1
        now = time.monotonic()
        self._look = now + TICK
        self._deadline = now + (self._allowance.timeout if process.ready else _START_SECONDS)
        process.send(self._run)

    def _with_log(self, result: Result, printed: str) -> Result:
        """The solver's own result, with what only this process knows."""
        if result.status is Status.MEMORY:
            memory = f"limits.memory = {self._allowance.memory:g} B"
            result = replace(result, reason=f"the run needed more than {memory}")
        if result.status.failed:
            result = replace(result, log=(printed + result.log)[-LOG_CHARACTERS:])
        return replace(result, seconds=time.monotonic() - self._begin)

    def _died(self, process: SolverProcess) -> Result | None:
        code = process.exit_code(5.0) or 0
        if code in _FROM_OUTSIDE and self._deaths < _MOST_DEATHS_FROM_OUTSIDE:
            self._deaths += 1
            self.close()
            self._send()
            return None
        _require_started(process)
        if "bad_alloc" in process.printed():
            return self._give_up(process, Status.MEMORY)
        if code == -signal.SIGALRM:
            why = "did not stop at limits.timeout"
            return self._give_up(process, Status.TIMEOUT, why)
        how = (
            f"died of {signal.Signals(-code).name}"
            if code < 0
            else (f"ended with exit code {code}")
        )
        return self._give_up(process, Status.CRASHED, f"the solver process {how}")

    def _give_up(self, process: SolverProcess, status: Status, reason: str = "") -> Result:
        result = Result(self._run[0], status, reason, _CAUSES[status], finished=time.time())
        result = self._with_log(result, process.printed())
        self.close()
        return result


def _require_started(process: SolverProcess) -> None:
    if not process.ready:
        raise InputError(f"the solver process does not start: {process.printed()}")


# Running samples on this machine: in several solver processes at a time, or in this very one.


class Local(Scheduler):
    """A number of solver processes, supervised by one event loop."""

    def __init__(self, workers: int) -> None:
        self.workers, self.description = workers, counted(workers, "local worker")
        self._slots: list[Slot] = []

    def run(self, samples: Sequence[int], work: Work) -> str:
        """See :meth:`Scheduler.run`."""
        queue, stands = deque(samples), False
        try:
            slots = self._ready(min(self.workers, len(queue)), work)
            while not work.stop():
                for slot in slots:
                    slot.serve(queue, work)
                busy = [slot.pipe for slot in slots if slot.busy]
                if not busy:
                    stands = work.more
                    break
                wait(busy, timeout=TICK)
            return work.stop()
        finally:
            if not stands:
                self.close()

    def close(self) -> None:
        """See :meth:`Scheduler.close`."""
        while self._slots:
            self._slots.pop().close()

    def _ready(self, count: int, work: Work) -> list[Slot]:
        """Slots that stand since the last run, if they were set up for such work, and new ones."""
        if any(not slot.suits(work) for slot in self._slots):
            self.close()
        while len(self._slots) < count:
            self._slots.append(Slot(work.solver, work.scene, work.allowance, work.judge))
        return self._slots[:count]


class Serial(Scheduler):
    """One sample after the other in this process, without limits: a crash ends everything."""

    description = "in one process"

    def run(self, samples: Sequence[int], work: Work) -> str:
        """See :meth:`Scheduler.run`."""
        solver, base = load_solver(work.solver), Scene.model_validate(work.scene)
        for sample in samples:
            if work.stop():
                break
            work.started(sample)
            chosen = solver if sample >= 0 else load_solver(work.judge)
            result = solve(chosen, base, sample, work.values_of(sample))
            work.keep(result)
            work.finished(result)
        return work.stop()
