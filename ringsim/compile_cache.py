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
SOURCES = Path(__file__).parent / "frame"


def choose_folder() -> Path:
    """The folder of compiled code, in the environment from now on, for child processes, too.

    That of ``NUMBA_CACHE_DIR`` if it is set; else one of the user's cache folder (XDG_CACHE_HOME,
    or ~/.cache) for these sources and this processor; else, told in a line, a temporary one.
    """
    if given := os.environ.get(VARIABLE):
        return Path(given)
    made = f"ringsim-{_sources()}-numba-{version('numba')}-{_processor()}"
    made += "" if packs() else "-unpacked"
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    folder = Path(cache) / "ringsim" / made
    if not _usable(folder):
        wanted, folder = folder, Path(tempfile.gettempdir()) / f"ringsim-cache-{os.getuid()}-{made}"
        # What lies there is executed: a folder that others can write to is not ours to use.
        if not _usable(folder) or not _private(folder):
            folder = Path(tempfile.mkdtemp(prefix="ringsim-cache-"))
        print(f"{wanted}: cannot be written: compiled code goes to {folder}", file=sys.stderr)
    os.environ[VARIABLE] = str(folder)
    if (loaded := sys.modules.get("numba")) is not None:  # by a script, before ringsim was
        loaded.config.CACHE_DIR = str(folder)
    return folder


def packs() -> bool:
    """Whether rows of fronts are packed into registers (``ringsim.frame.vectors.packed``): unless
    NUMBA_SLP_VECTORIZE is 0.
    """
    return os.environ.get(PACKING) != "0"


def compile_once(kind: Hashable, compiling: Callable[[], object]) -> None:
    """Call ``compiling`` unless compiled code of this kind is there; one process at a time.

    ``kind`` names what else decides about what is compiled, beside the sources and their place,
    to which numba ties its files; its ``repr`` is that of its content.
    """
    folder = choose_folder()
    made = repr((version("numba"), sys.version, _sources(), str(SOURCES), packs(), kind)).encode()
    mark = folder / f"compiled-{hashlib.blake2b(made, digest_size=12).hexdigest()}"
    if mark.exists():
        return
    with _alone(folder / "lock"):
        if not mark.exists():
            compiling()
            with contextlib.suppress(OSError):
                mark.touch()


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold a lock, if the file system has locks: without one, several compile the same."""
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            fcntl.flock(held.enter_context(path.open("wb")), fcntl.LOCK_EX)
        yield


def _usable(folder: Path) -> bool:
    """Whether files can be written to a folder, which is made if it is not there."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _private(folder: Path) -> bool:
    found = folder.lstat()
    others = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not others


def _sources() -> str:
    """Of what is compiled: numba looks at a function's own file, not at those that it calls."""
    return digest_of(SOURCES.glob("*.py"))


def _processor() -> str:
    """Machine and processor: code that was compiled for one may not run on another."""
    known = platform.processor()
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        known += "".join(sorted({x for x in file if x.startswith(("model name", "flags"))}))
    return f"{platform.machine()}-{hashlib.blake2b(known.encode(), digest_size=4).hexdigest()}"
