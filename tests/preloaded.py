"""Commands of ringsim without the two seconds that each process would spend on imports.

A process that has loaded all modules forks for each command.  Folder, environment, exit code and
what is printed are those of a fresh process.  Tests of how a process starts, of what it loads, of
signals and of MPI start real ones.
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
import traceback
from pathlib import Path

LOADED = ("netCDF4", "scipy.stats", "xarray")
"""Loaded before ringsim's own modules: what most commands need beside these."""


def ringsim(
    *arguments: object, folder: Path | None = None, environment: dict[str, str] | None = None,
    joined: bool = False, timeout: float = 300.0,
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    """As ``python -m ringsim ARGUMENTS`` in a folder; ``joined`` has stderr within stdout."""
    words = [str(each) for each in arguments]
    with tempfile.TemporaryDirectory() as place:
        order = {
            "arguments": words, "folder": str(folder or Path.cwd()), "joined": joined,
            "environment": dict(environment or os.environ), "place": place,
        }  # fmt: skip
        code = _asked(order, timeout)
        told = [Path(place, name).read_text(encoding="utf-8") for name in ("out", "err")]
    return subprocess.CompletedProcess(["ringsim", *words], code, *told)


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
            _run()
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def _run() -> None:
    """Run the command, and leave without the half second that taking all modules down costs."""
    code = 1
    try:
        runpy.run_module("ringsim", run_name="__main__", alter_sys=True)
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
    sys.path[:] = [os.getcwd(), *paths, *rest]
    sys.argv = ["ringsim", *order["arguments"]]


if __name__ == "__main__":
    _serve()
