"""Commands and scripts without the two seconds that each process would spend on imports.

A process that has loaded all modules forks for each of them, and these fork their solver
processes.  Folder, environment, exit code and what is printed are those of a fresh process.  Tests
of how a process starts, of what it loads, of signals and of MPI start real ones.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import pkgutil
import runpy
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import IO

LOADED = ("netCDF4", "scipy.stats", "xarray")
"""Loaded before ringsim's own modules: what most commands need beside these."""


def ringsim(
    *arguments: object, folder: Path | None = None, environment: dict[str, str] | None = None,
    joined: bool = False, timeout: float = 300.0,
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    """As ``python -m ringsim ARGUMENTS`` in a folder; ``joined`` has stderr within stdout."""
    words = [str(each) for each in arguments]
    return _called("", words, folder or Path.cwd(), environment, joined, timeout)


def script(
    path: Path, *arguments: object, folder: Path, timeout: float = 600.0
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    """As ``python -W error PATH ARGUMENTS`` in a folder."""
    words = [str(each) for each in arguments]
    return _called(str(path), words, folder, None, False, timeout)


def _called(
    path: str, words: list[str], folder: Path, environment: dict[str, str] | None, joined: bool,
    timeout: float,
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        order = {
            "script": path, "arguments": words, "folder": str(folder), "joined": joined,
            "environment": dict(environment or os.environ), "place": place,
        }  # fmt: skip
        code = _asked(order, timeout)
        told = [Path(place, name).read_text(encoding="utf-8") for name in ("out", "err")]
    return subprocess.CompletedProcess([path or "ringsim", *words], code, *told)


def _asked(order: dict[str, object], timeout: float) -> int:
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    server.stdin.write(json.dumps(order).encode() + b"\n")
    child = int(server.stdout.readline())
    late = not select.select([server.stdout], [], [], timeout)[0]
    if late:
        os.kill(child, signal.SIGKILL)
    code = int(server.stdout.readline())
    if late:
        raise subprocess.TimeoutExpired(str(order["arguments"]), timeout)
    return code


@functools.cache
def _server() -> subprocess.Popen[bytes]:
    """One for each process of pytest; it ends when its input does."""
    server = subprocess.Popen(
        [sys.executable, __file__], bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    atexit.register(_end, server)
    return server


def _end(server: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(OSError), server:
        pass


def _serve() -> None:
    import ringsim

    ours = (module.name for module in pkgutil.walk_packages(ringsim.__path__, "ringsim."))
    for name in [*LOADED, *(name for name in ours if not name.endswith("__main__"))]:
        importlib.import_module(name)
    gc.collect()
    gc.freeze()  # pages that forks would otherwise copy
    for line in sys.stdin:
        order = json.loads(line)
        if (child := os.fork()) == 0:
            _become(order)
            _run(_script if order["script"] else _command)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def _command() -> None:
    runpy.run_module("ringsim", run_name="__main__", alter_sys=True)


def _script() -> None:
    warnings.resetwarnings()
    warnings.simplefilter("error")
    runpy.run_path(sys.argv[0], run_name="__main__")


def _run(main: Callable[[], object]) -> None:
    """Run it, and leave without the half second that taking all modules down costs."""
    code = 1
    try:
        main()
        code = 0
    except SystemExit as left:
        code = left.code if isinstance(left.code, int) else 0
    except BaseException:
        traceback.print_exc()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _become(order: dict[str, object]) -> None:
    """What a fresh process would find."""
    place, environment = str(order["place"]), order["environment"]
    assert isinstance(environment, dict)
    assert isinstance(order["arguments"], list)
    out, err = (os.open(f"{place}/{x}", os.O_WRONLY | os.O_CREAT, 0o600) for x in ("out", "err"))
    nothing = os.open(os.devnull, os.O_RDONLY)
    for source, target in ((nothing, 0), (out, 1), (out if order["joined"] else err, 2)):
        os.dup2(source, target)
    for each in (nothing, out, err):
        os.close(each)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(str(order["folder"]))
    paths = [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]
    rest = [path for path in sys.path[1:] if path not in paths]
    script = str(order["script"])
    sys.path[:] = [str(Path(script).parent) if script else os.getcwd(), *paths, *rest]
    sys.argv = [script or "ringsim", *order["arguments"]]
    slot = importlib.import_module("ringsim.execution.slot")
    names = {"DEVNULL": subprocess.DEVNULL, "TimeoutExpired": subprocess.TimeoutExpired}
    slot.__dict__["subprocess"] = SimpleNamespace(Popen=_Solver, **names)


class _Solver:
    """A solver process as ``subprocess.Popen`` would start it, to what it is asked."""

    def __init__(
        self, command: list[str], *, stdin: int, stdout: IO[bytes], stderr: IO[bytes], cwd: str,
        env: dict[str, str], pass_fds: list[int], start_new_session: bool,
    ) -> None:  # fmt: skip
        if not os.access(command[0], os.X_OK):
            raise FileNotFoundError(command[0])
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid, self.code = os.fork(), list[int]()
        if self.pid:
            return
        assert start_new_session
        os.setsid()
        os.chdir(cwd)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        for source, target in ((stdout, 1), (stderr, 2)):
            os.dup2(source.fileno(), target)
        (kept,) = pass_fds
        os.closerange(3, kept)
        os.closerange(kept + 1, 1 << 16)
        os.environ.clear()
        os.environ.update(env)
        for number in (signal.SIGTERM, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        for stream in (sys.stdout, sys.stderr):
            stream.reconfigure(write_through=True)
        module = command.index("-m") + 1
        sys.argv = command[module:]
        _run(importlib.import_module(command[module]).main)

    def wait(self, timeout: float) -> int:
        end = time.monotonic() + timeout
        while not self.code:
            found, status = os.waitpid(self.pid, os.WNOHANG)
            if found:
                self.code.append(os.waitstatus_to_exitcode(status))
            elif time.monotonic() >= end:
                raise subprocess.TimeoutExpired(str(self.pid), timeout)
            else:
                time.sleep(0.002)
        return self.code[0]

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)


if __name__ == "__main__":
    _serve()
