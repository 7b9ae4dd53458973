"""A worker slot: one persistent solver process and its supervision."""

from __future__ import annotations

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
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ringsim.execution.launch import OF_MPI
from ringsim.execution.solve import LOG_CHARACTERS
from ringsim.execution.work import Limits, Task
from ringsim.refusal import InputError
from ringsim.storage.result import Result
from ringsim.variables import Status

TICK = 0.2
"""Seconds between two looks at a process that says nothing."""

_ADDRESS = re.compile(r"0x[0-9a-fA-F]+")
_START_SECONDS = 120.0
_END_SECONDS = 10.0
_PAUSE_SECONDS = 1.0
"""Nobody looked for so long: a batch system suspended the job, or the machine is overloaded."""
_MOST_DEATHS_FROM_OUTSIDE = 2
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_FROM_OUTSIDE = (
    -signal.SIGKILL, -signal.SIGTERM, -signal.SIGHUP, -signal.SIGINT, -signal.SIGUSR1,
)  # fmt: skip
"""Signals that others send: the kernel, batch systems, and the stop signals of a campaign, which
a process that is just starting does not ignore yet."""


class Slot:
    """Runs one sample at a time in a process of its own.

    A run that crashes, hangs or eats memory costs this process and nothing else.  A process
    that somebody else killed is no fault of the sample: the run is repeated.
    """

    def __init__(self, solver: str, scene: dict[str, Any], limits: Limits) -> None:
        self._setup = {"solver": solver, "scene": scene, "memory": limits.memory}
        self._setup["backstop"] = 2.0 * limits.timeout + 60.0
        self._limits = limits
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._scratch: Path | None = None
        self._task: Task | None = None
        self._ready = False
        self._runs = self._deaths = 0
        self._begin = self._deadline = self._look = 0.0

    @property
    def busy(self) -> bool:
        """Whether a sample is running."""
        return self._task is not None

    @property
    def pipe(self) -> Connection:
        """The pipe to wait on while busy."""
        if self._pipe is None:
            raise RuntimeError("a slot has a pipe only while it is busy")
        return self._pipe

    def submit(self, task: Task) -> None:
        """Start a sample; the slot must not be busy.

        Raises
        ------
        InputError
            If the solver process cannot be started.
        """
        self._begin, self._deaths = time.monotonic(), 0
        self._send(task)

    def poll(self) -> Result | None:
        """The result, once there is one; call it when the pipe is ready or after a tick.

        Raises
        ------
        InputError
            If the solver process cannot be started.
        """
        while self._task is not None and self.pipe.poll():
            try:
                message = self.pipe.recv()
            except (EOFError, OSError):
                return self._died()
            if isinstance(message, Result):
                return self._accepted(message)
            elif message:
                raise InputError(str(message))
            else:
                self._ready = True
                self._deadline = time.monotonic() + self._limits.timeout
        now = time.monotonic()
        if self._task is None or now < self._look:
            return None
        if now - self._look > _PAUSE_SECONDS:
            self._deadline += now - self._look  # this process has been asleep, and the run perhaps
        self._look = now + TICK
        return self._check(now)

    def close(self) -> None:
        """End the process at once, whatever it does."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(_END_SECONDS)  # the kernel may hold it, waiting for a disk
        if self._pipe is not None:
            self._pipe.close()
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
        self._process = self._pipe = self._scratch = self._task = None

    def _send(self, task: Task) -> None:
        if self._process is None or self._runs >= self._limits.recycle:
            self.close()
            try:
                self._start()
            except OSError as error:
                self.close()
                raise InputError(
                    f"the solver process cannot be started: {error}; use fewer workers, or make "
                    f"room in {tempfile.gettempdir()} (TMPDIR)"
                ) from error
        self._task = task
        self._runs += 1
        now = time.monotonic()
        self._look = now + TICK
        self._deadline = now + (self._limits.timeout if self._ready else _START_SECONDS)
        with contextlib.suppress(BrokenPipeError):
            self.pipe.send(task)

    def _start(self) -> None:
        self._scratch = Path(tempfile.mkdtemp(prefix="ringsim-"))
        mine, other = socket.socketpair()
        self._pipe = Connection(mine.detach())
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(OF_MPI)
        }
        environment |= dict.fromkeys(_ONE_THREAD, "1")
        environment["PYTHONPATH"] = os.pathsep.join(os.path.abspath(path) for path in sys.path)
        command = [sys.executable, "-P", "-m", "ringsim.execution.child"]
        with other, (self._scratch / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [*command, str(other.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=self._scratch,
                env=environment,
                pass_fds=[other.fileno()],
                start_new_session=True,
            )
        self._ready, self._runs = False, 0
        with contextlib.suppress(BrokenPipeError):
            self._pipe.send(self._setup)

    def _accepted(self, result: Result) -> Result:
        reason = self._too_much() if result.status is Status.MEMORY else result.reason
        log = result.log
        if result.status.failed:
            log = (self._printed() + log)[-LOG_CHARACTERS:]
        self._task = None
        return replace(
            result,
            reason=reason,
            log=log,
            seconds=time.monotonic() - self._begin,
        )

    def _check(self, now: float) -> Result | None:
        process = self._process
        if process is None:
            raise RuntimeError("a busy slot has a process")
        if process.poll() is not None and not self.pipe.poll():
            return self._died()
        if now > self._deadline:
            if not self._ready:
                raise InputError(f"the solver process does not start: {self._printed()}")
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGUSR2)
            time.sleep(0.05)
            return self._give_up(
                Status.TIMEOUT,
                f"still running after limits.timeout = {self._limits.timeout:g} s: raise it, or "
                "raise solver.tolerance",
            )
        if _resident(process.pid) > self._limits.memory:
            return self._give_up(Status.MEMORY, self._too_much())
        return None

    def _too_much(self) -> str:
        return f"the run needed more than limits.memory = {self._limits.memory:g} B"

    def _died(self) -> Result | None:
        process, task = self._process, self._task
        if process is None or task is None:
            raise RuntimeError("nothing ran that could die")
        try:
            code = process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            code = 0
        if code in _FROM_OUTSIDE and self._deaths < _MOST_DEATHS_FROM_OUTSIDE:
            self._deaths += 1
            self.close()
            self._send(task)
            return None
        if not self._ready:
            raise InputError(f"the solver process does not start: {self._printed()}")
        if "bad_alloc" in self._printed():
            return self._give_up(Status.MEMORY, self._too_much())
        if code == -signal.SIGALRM:
            return self._give_up(Status.TIMEOUT, "still running long after limits.timeout")
        how = f"left with exit code {code}"
        if code < 0:
            how = f"died of {signal.Signals(-code).name}"
        return self._give_up(Status.CRASHED, f"the solver process {how}")

    def _give_up(self, status: Status, reason: str) -> Result:
        if self._task is None:
            raise RuntimeError("nothing runs that could be given up")
        result = Result(
            sample=self._task.sample,
            status=status,
            reason=reason,
            log=self._printed(),
            seconds=time.monotonic() - self._begin,
            finished=time.time(),
        )
        self.close()
        return result

    def _printed(self) -> str:
        """The end of what the process has printed since the sample began."""
        if self._scratch is None:
            return ""
        try:
            with (self._scratch / "log").open("rb") as log:
                size = log.seek(0, os.SEEK_END)
                log.seek(max(0, size - LOG_CHARACTERS))
                text = log.read().decode("utf-8", "replace")
                return _ADDRESS.sub("0x", text)
        except OSError:
            return ""


def _resident(pid: int) -> int:
    """Bytes of memory that a process holds; 0 where the system does not tell."""
    try:
        pages = Path(f"/proc/{pid}/statm").read_text().split()[1]
    except (OSError, IndexError):
        return 0
    return int(pages) * os.sysconf("SC_PAGE_SIZE")
