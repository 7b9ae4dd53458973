"""Commands and scripts without the two seconds that each process would spend on imports.

A process that has loaded all modules forks for each of them, and these fork their solver
processes.  Folder, environment, exit code and what is printed are those of a fresh process, and
signals reach it alike.  Tests of how a process starts, of what it loads, of kills of any process
and of MPI start real ones.
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


class Started:
    """A command that runs while others do, with both outputs joined, as a process that
    ``subprocess.Popen`` has started in a session of its own.
    """

    def __init__(self, *arguments: object, folder: Path, environment: dict[str, str]) -> None:
        self._place = tempfile.TemporaryDirectory()
        self.returncode: int | None = None
        self._printed: str | None = None
        self.pid = int(_told(started=True, **_order(
            "", list(map(str, arguments)), folder, environment, True, self._place.name,
        )))  # fmt: skip

    def poll(self) -> int | None:
        """Its exit code, None while it runs."""
        if self.returncode is None and (told := _told(ended=self.pid)) != "not yet":
            self.returncode = int(told)
        return self.returncode

    def communicate(self, timeout: float = 300.0) -> tuple[str, None]:
        """What it has printed when it has ended."""
        end = time.monotonic() + timeout
        while self.poll() is None:
            if time.monotonic() > end:
                raise subprocess.TimeoutExpired(str(self.pid), timeout)
            time.sleep(0.01)
        if self._printed is None:
            self._printed = Path(self._place.name, "out").read_text(encoding="utf-8")
            self._place.cleanup()
        return self._printed, None

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def close(self) -> None:
        """End it if it still runs."""
        self.kill()
        self.communicate()


def _order(
    path: str, words: list[str], folder: Path, environment: dict[str, str] | None, joined: bool,
    place: str,
) -> dict[str, object]:  # fmt: skip
    return {
        "script": path, "arguments": words, "folder": str(folder), "joined": joined,
        "environment": dict(environment or os.environ), "place": place,
    }  # fmt: skip


def _called(
    path: str, words: list[str], folder: Path, environment: dict[str, str] | None, joined: bool,
    timeout: float,
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        code = _asked(_order(path, words, folder, environment, joined, place), timeout)
        told = [Path(place, name).read_text(encoding="utf-8") for name in ("out", "err")]
    return subprocess.CompletedProcess([path or "ringsim", *words], code, *told)


def _told(**order: object) -> str:
    """What the server answers at once."""
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    server.stdin.write(json.dumps(order).encode() + b"\n")
    return server.stdout.readline().decode().strip()


def _asked(order: dict[str, object], timeout: float) -> int:
    child, server = int(_told(**order)), _server()
    assert server.stdout is not None
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
        if "ended" in order:
            found, status = os.waitpid(order["ended"], os.WNOHANG)
            print(os.waitstatus_to_exitcode(status) if found else "not yet", flush=True)
            continue
        if (child := os.fork()) == 0:
            if "started" in order:
                os.setsid()
            _become(order)
            _run(_script if order["script"] else _command)
        print(child, flush=True)
        if "started" not in order:
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
