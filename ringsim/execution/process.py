"""A solver process as the operating system sees it: starting it, its log, its memory, its end."""

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
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ringsim.execution.solve import LOG_CHARACTERS
from ringsim.refusal import InputError
from ringsim.storage.result import plain

_OF_MPI = ("PMI", "PMIX", "OMPI", "OPAL", "PRTE", "HYDRA", "HYDI", "MPI", "I_MPI", "MPIR")
"""How names of variables begin by which launchers and libraries speak to each other."""

_ADDRESS = re.compile(r"0x[0-9a-fA-F]+")
_END_SECONDS = 10.0
_PRINTING_SECONDS = 0.05
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def without_mpi() -> dict[str, str]:
    """The environment of a process that is to know nothing of an MPI launcher."""
    return {k: v for k, v in os.environ.items() if not k.startswith(_OF_MPI)}


class SolverProcess:
    """A process that serves a pipe (``ringsim.execution.child``), in a folder of its own.

    InputError if it cannot be started.
    """

    def __init__(self, setup: dict[str, Any]) -> None:
        self.ready, self.runs = False, 0
        mine, other = socket.socketpair()
        self.pipe = Connection(mine.detach())
        environment = without_mpi() | dict.fromkeys(_ONE_THREAD, "1")
        environment["PYTHONPATH"] = os.pathsep.join(os.path.abspath(path) for path in sys.path)
        command = [sys.executable, "-P", "-m", "ringsim.execution.child"]
        scratch = ""
        try:
            scratch = tempfile.mkdtemp(prefix="ringsim-")
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
                f"the solver process cannot be started: {error}; use fewer workers, or make "
                f"room in {tempfile.gettempdir()} (TMPDIR)"
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
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGUSR2)
        time.sleep(_PRINTING_SECONDS)

    def memory(self) -> int:
        """Bytes of memory that it holds; 0 where the system does not tell."""
        try:
            pages = Path(f"/proc/{self.pid}/statm").read_text().split()[1]
        except (OSError, IndexError):
            return 0
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

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
