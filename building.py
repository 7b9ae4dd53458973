"""How ``pip`` builds ringsim: as setuptools does, with a C compiler from PyPI where there is none.

A module by itself, which pip loads before anything is installed (PEP 517); see pyproject.toml.
"""

import os
import shlex
import shutil
import sys
import sysconfig
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403  # all that a build backend has

COMPILER = "ziglang>=0.13"
"""A C compiler in a wheel, which needs nothing of the machine."""


def has_compiler() -> bool:
    """Whether the compiler that setuptools would call is there."""
    given = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    return shutil.which(shlex.split(given)[0]) is not None


def get_requires_for_build_wheel(settings: Any = None) -> list[str]:
    """What a build needs beside what pyproject.toml lists."""
    needed: list[str] = build_meta.get_requires_for_build_wheel(settings)
    return needed if has_compiler() else [*needed, COMPILER]


def get_requires_for_build_editable(settings: Any = None) -> list[str]:
    """As for a wheel."""
    needed: list[str] = build_meta.get_requires_for_build_editable(settings)
    return needed if has_compiler() else [*needed, COMPILER]


def build_wheel(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """A wheel in a folder; its name."""
    choose_compiler()
    return str(build_meta.build_wheel(folder, settings, metadata))


def build_editable(folder: str, settings: Any = None, metadata: str | None = None) -> str:
    """A wheel that leads to the checkout, with the core compiled there; its name."""
    choose_compiler()
    return str(build_meta.build_editable(folder, settings, metadata))


def choose_compiler() -> None:
    """Have setuptools compile with what ``COMPILER`` brings where there is no other compiler."""
    if not has_compiler():
        # For any processor of this kind, as others compile; Zig's default is this one alone.
        compiler = f"{shlex.quote(sys.executable)} -m ziglang cc -mcpu=baseline"
        # Zig looks for undefined behaviour unless told not to, at several times the cost.
        plain = "-fno-sanitize=all"
        os.environ |= {"CC": compiler, "LDSHARED": f"{compiler} -shared", "CFLAGS": plain}
