"""The core in C, for pyproject.toml: once for any processor and, on x86-64, once for AVX2."""

import platform
from pathlib import Path

from setuptools import Extension, setup

SOURCES = sorted(str(file) for file in Path("ringsim/core/c").glob("*.c"))
HEADERS = sorted(str(file) for file in Path("ringsim/core/c").glob("*.h"))
# No product and sum in one rounding, and no other order of sums: results are the same bits with any
# registers.
FLAGS = [
    "-std=gnu17",
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-Wno-psabi",
    "-fvisibility=default",
]
WIDE = ["-mavx2"] if platform.machine() in ("x86_64", "AMD64") else []


def core(name: str, flags: list[str]) -> Extension:
    """A library that ctypes loads: it needs nothing of Python's."""
    return Extension(
        f"ringsim.core.c.{name}", SOURCES, depends=HEADERS, extra_compile_args=[*FLAGS, *flags],
        libraries=["m"],
    )  # fmt: skip


setup(ext_modules=[core("_core", []), *([core("_wide", WIDE)] if WIDE else [])])
