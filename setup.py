"""The core in C, for pyproject.toml: once for any processor and, on x86-64, once for AVX2."""

import hashlib
import sysconfig
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

FOLDER = Path("ringsim/core/c")
SOURCES = sorted(map(str, FOLDER.glob("*.c")))
HEADERS = sorted(map(str, FOLDER.glob("*.h")))
DIGEST = hashlib.blake2b(
    b"".join(Path(file).read_bytes() for file in sorted([*SOURCES, *HEADERS])), digest_size=8
).hexdigest()
"""By which ringsim/core/library.py knows a library that is none of its sources."""
# No product and sum in one rounding, and no other order of sums: results are the same bits with any
# registers.
FLAGS = [
    "-std=gnu11",
    "-O3",
    "-fno-fast-math",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-Wno-psabi",
]
WIDE = ["-mavx2"] if sysconfig.get_platform().endswith(("x86_64", "amd64")) else []


def core(name: str, flags: list[str]) -> Extension:
    """A library that ctypes loads: it needs nothing of Python's."""
    return Extension(
        f"ringsim.core.c.{name}", SOURCES, depends=[*HEADERS, __file__], libraries=["m"],
        extra_compile_args=[*FLAGS, f'-DSOURCES="{DIGEST}"', *flags],
    )  # fmt: skip


class Build(build_ext):
    """Objects of each library in a folder of their own, as both are of the same sources; libraries
    whose names say nothing of Python's version.
    """

    def get_ext_filename(self, fullname: str) -> str:
        """See setuptools."""
        return f"{fullname.replace('.', '/')}.so"

    def build_extension(self, ext: Extension) -> None:
        """See setuptools."""
        before, self.build_temp = self.build_temp, f"{self.build_temp}/{ext.name}"
        super().build_extension(ext)
        self.build_temp = before


class Wheel(bdist_wheel):
    """One wheel for all versions of Python."""

    def get_tag(self) -> tuple[str, str, str]:
        """See setuptools."""
        return "py3", "none", super().get_tag()[2]


setup(
    ext_modules=[core("_core", []), *([core("_wide", WIDE)] if WIDE else [])],
    cmdclass={"build_ext": Build, "bdist_wheel": Wheel},
)
