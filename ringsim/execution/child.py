"""The solver process: takes tasks from a pipe, one at a time, until its parent is gone."""

import contextlib
import ctypes
import faulthandler
import functools
import hashlib
import os
import platform
import re
import resource
import shutil
import signal
import sys
import tempfile
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ringsim.refusal import InputError

# The solver process: takes tasks from a pipe, one at a time, until its parent is gone.


_C = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1
_MOST_LOG_BYTES = 1 << 28


def main() -> None:
    """Serve the pipe whose file descriptor is the first argument."""
    pipe = Connection(int(sys.argv[1]))
    end_with(int(sys.argv[2]))
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR2)
    for ignored in (signal.SIGINT, signal.SIGHUP, signal.SIGUSR1):
        signal.signal(ignored, signal.SIG_IGN)
    try:
        _serve(pipe, pipe.recv())
    except (EOFError, ConnectionResetError, BrokenPipeError):
        os._exit(0)


def end_with(parent: int) -> None:
    """Let the kernel end this process when its parent ends, however that happens."""
    if sys.platform == "linux":
        _C.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


def _serve(pipe: Connection, setup: dict[str, Any]) -> None:
    from ringsim.execution.work import load_solver, prepare, solve
    from ringsim.scene import Scene

    try:
        solver, base = load_solver(setup["solver"]), Scene.model_validate(setup["scene"])
        prepare(setup["solver"], base)
    except InputError as error:
        pipe.send(str(error))
        return
    _limit(resource.RLIMIT_DATA, int(setup["allowance"].memory))
    _limit(resource.RLIMIT_FSIZE, _MOST_LOG_BYTES)
    _limit(resource.RLIMIT_CORE, 0)
    pipe.send("")
    while True:
        sample, values = pipe.recv()
        os.ftruncate(1, 0)
        _C.fflush(None)  # what did not fit into the log before
        os.ftruncate(1, 0)
        # Ends this process, should its parent be unable to look at it.
        signal.setitimer(signal.ITIMER_REAL, 2.0 * setup["allowance"].timeout + 60.0)
        chosen = solver if sample >= 0 else load_solver(setup["judge"])
        result = solve(chosen, base, sample, values)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        _C.fflush(None)  # into the log of its own sample
        pipe.send(result)


def _limit(what: int, most: int) -> None:
    hard = resource.getrlimit(what)[1]
    soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(what, (soft, hard))


if __name__ == "__main__":
    main()


# Scratch folders of solver processes, named after their owner, and clearing what the dead left.


_START = 19
"""Place of a process's start time in /proc/PID/stat, counted behind its name."""


def scratch_folder() -> str:
    """A new folder of this process; OSError if there is no room for it.

    The first call also removes the folders of this user's processes that were killed.
    """
    world, pid = _world(), os.getpid()
    if world:
        _clear(world)
    return tempfile.mkdtemp(prefix=f"ringsim-{world or 'any'}-{pid}-{_started(pid)}-")


def _world() -> str:
    """Where process numbers mean what they do here: machine and container; empty if unknown."""
    try:
        inside = os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""
    return hashlib.blake2b(f"{platform.node()} {inside}".encode(), digest_size=6).hexdigest()


def _started(pid: int) -> str:
    """When a process that lives was started, in ticks since the machine was; empty without one."""
    try:
        state, *rest = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (OSError, IndexError, ValueError):
        return ""
    return "" if state in "ZX" else rest[_START - 1]


@functools.cache
def _clear(world: str) -> None:
    # Numbers of processes are used again, so that the owner is known by its start time, too.
    ours = re.compile(rf"ringsim-{world}-([0-9]+)-([0-9]+)-[^-]+")
    for path in Path(tempfile.gettempdir()).glob(f"ringsim-{world}-*"):
        found = ours.fullmatch(path.name)
        with contextlib.suppress(OSError):
            if found and path.lstat().st_uid == os.getuid() and _started(int(found[1])) != found[2]:
                shutil.rmtree(path, ignore_errors=True)
