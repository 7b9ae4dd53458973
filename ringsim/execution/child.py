"""The solver process: takes tasks from a pipe, one at a time, until its parent is gone."""

import ctypes
import faulthandler
import os
import resource
import signal
import sys
from multiprocessing.connection import Connection
from typing import Any

from ringsim.refusal import InputError

_C = ctypes.CDLL(None)
_PR_SET_PDEATHSIG = 1
_MOST_LOG_BYTES = 1 << 28


def main() -> None:
    """Serve the pipe whose file descriptor is the first argument."""
    pipe = Connection(int(sys.argv[1]))
    # The kernel ends this process when its parent ends, however that happens.
    if sys.platform == "linux":
        _C.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != int(sys.argv[2]):
        os._exit(0)
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR2)
    for ignored in (signal.SIGINT, signal.SIGUSR1):
        signal.signal(ignored, signal.SIG_IGN)
    try:
        _serve(pipe, pipe.recv())
    except (EOFError, ConnectionResetError, BrokenPipeError):
        os._exit(0)


def _serve(pipe: Connection, setup: dict[str, Any]) -> None:
    from ringsim.execution.solve import load_solver, prepare, solve
    from ringsim.scene import Scene

    try:
        solver, base = load_solver(setup["solver"]), Scene.model_validate(setup["scene"])
        prepare(setup["solver"], base)
    except InputError as error:
        pipe.send(str(error))
        return
    _limit(resource.RLIMIT_DATA, int(setup["limits"].memory))
    _limit(resource.RLIMIT_FSIZE, _MOST_LOG_BYTES)
    _limit(resource.RLIMIT_CORE, 0)
    pipe.send("")
    while True:
        sample, values = pipe.recv()
        os.ftruncate(1, 0)
        _C.fflush(None)  # what did not fit into the log before
        os.ftruncate(1, 0)
        # Ends this process, should its parent be unable to look at it.
        signal.setitimer(signal.ITIMER_REAL, 2.0 * setup["limits"].timeout + 60.0)
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
