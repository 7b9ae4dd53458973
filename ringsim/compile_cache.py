"""Where compiled code is kept, and who compiles it: one process, once a machine.

numba takes the folder from the environment when it is imported, so that it is chosen before.  Each
of its files appears whole, but it numbers the files of a function's variants without a lock: of
two processes that compile different variants at the same time one may get the other's code.  So
whoever compiles first has a lock, and the others wait for it and load what it made.
"""

import contextlib
import fcntl
import hashlib
import os
import platform
import stat
import sys
import tempfile
from collections.abc import Callable, Hashable, Iterator
from importlib.metadata import version
from pathlib import Path

from ringsim.build import digest_of

VARIABLE = "NUMBA_CACHE_DIR"
PACKING = "NUMBA_SLP_VECTORIZE"
SOURCES = [Path(__file__).parent / room for room in ("compiled", "frame")]


def choose_folder() -> Path:
    """The folder of compiled code, in the environment from now on, for child processes, too.

    That of ``NUMBA_CACHE_DIR`` if it is set; else one of the user's cache folder (XDG_CACHE_HOME,
    or ~/.cache) for these sources and this processor.  Where files cannot be written to it, or
    others could write what is executed here, a temporary one, told in a line.
    """
    made = f"ringsim-{_sources()}-numba-{version('numba')}-{_processor()}"
    made += "" if packs() else "-unpacked"
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    given = os.environ.get(VARIABLE)
    folder = Path(given) if given else Path(cache) / "ringsim" / made
    if why := _why_not(folder):
        wanted, folder = folder, Path(tempfile.gettempdir()) / f"ringsim-cache-{os.getuid()}-{made}"
        if _why_not(folder):
            folder = Path(tempfile.mkdtemp(prefix="ringsim-cache-"))
        print(
            f"{wanted}: {why}, or set {VARIABLE} to a folder of your own: compiled code goes to "
            f"{folder}, which takes a minute wherever that is empty",
            file=sys.stderr,
        )
    os.environ[VARIABLE] = str(folder)
    if (loaded := sys.modules.get("numba")) is not None:  # by a script, before ringsim was
        loaded.config.CACHE_DIR = str(folder)
    return folder


def packs() -> bool:
    """Whether rows of fronts are packed into registers, by ``ringsim.compiled.vectors.packed``:
    unless NUMBA_SLP_VECTORIZE is 0.
    """
    return os.environ.get(PACKING) != "0"


def compile_once(kind: Hashable, compiling: Callable[[], object]) -> None:
    """Call ``compiling`` unless compiled code of this kind is there; one process at a time.

    ``kind`` names what else decides about what is compiled, beside the sources and their place,
    to which numba ties its files; its ``repr`` is that of its content.
    """
    folder = choose_folder()
    what = version("numba"), sys.version, _sources(), str(SOURCES[0]), packs(), kind
    made = hashlib.blake2b(repr(what).encode(), digest_size=12).hexdigest()
    mark = folder / f"compiled-{made}"
    if mark.exists():
        return
    with alone():
        if not mark.exists():
            compiling()
            with contextlib.suppress(OSError):
                mark.touch()


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Keep other processes from compiling meanwhile, if the file system has locks: without one,
    several compile the same.  A process that has the lock may ask for it again.
    """
    path = choose_folder() / "lock"
    with contextlib.ExitStack() as held:
        if path not in _held:
            with contextlib.suppress(OSError):
                path.parent.mkdir(parents=True, exist_ok=True)
                fcntl.flock(held.enter_context(path.open("wb")), fcntl.LOCK_EX)
            _held.add(path)
            held.callback(_held.discard, path)
        yield


_held = set[Path]()


def tell_damage(folder: str) -> None:
    """Say, once in a process, that compiled code could not be read."""
    if folder not in _told:
        _told.add(folder)
        print(f"{folder}: compiled code is damaged: it is compiled anew", file=sys.stderr)


_told = set[str]()


def _why_not(folder: Path) -> str:
    """Why a folder, made if it is not there, is not to be used, with the cure; or nothing."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
        # What lies there is executed: a folder that others can write to is not ours to use.
        if found.st_uid != os.getuid():
            return "belongs to another user, whose code would run: let it be yours (chown)"
        if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            return "others can write to it, whose code would run: chmod go-w"
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return "cannot be written: make room, or let it be written to"
    return ""


def _sources() -> str:
    """Of what is compiled: numba looks at a function's own file, not at those that it calls."""
    return digest_of(file for room in SOURCES for file in room.glob("*.py"))


def _processor() -> str:
    """Machine and processor: code that was compiled for one may not run on another."""
    known = platform.processor()
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        known += "".join(sorted({x for x in file if x.startswith(("model name", "flags"))}))
    return f"{platform.machine()}-{hashlib.blake2b(known.encode(), digest_size=4).hexdigest()}"
