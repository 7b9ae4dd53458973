"""Scratch folders of solver processes, named after their owner, and clearing what the dead left."""

import contextlib
import functools
import hashlib
import os
import platform
import re
import shutil
import tempfile
from pathlib import Path

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
