"""What drills of hardening.py share: their table, a sound campaign, and what must always hold."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import random
import shlex
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "campaign"))

from preloaded import ringsim

from campaign_bench import comparable

SAMPLES = 60
CAMPAIGN = f"""
name = "drill"
seed = 7
scene = "truss2"
fidelity = "frame"
design = {{ kind = "random", samples = {SAMPLES} }}
[set]
"solver.end_time" = 0.6
"record.interval" = 0.02
[inputs]
"rods.young_modulus" = {{ kind = "normal", mean = 120e9, standard_deviation = 6e9 }}
[inputs."cables.upper.friction.coefficient"]
kind = "uniform"
low = 2e-4
high = 6e-4
each_section = true
[requirements]
asynchrony_max = {{ max = 30.0, probability = 0.5, confidence = 0.9 }}
"""
SHORT = ("--set", "solver.end_time=0.5")
CHANCE = random.Random(5)


class Skipped(Exception):  # noqa: N818 (it is no error)
    """A drill that cannot be done here, with the reason."""


@dataclass
class Drill:
    """One row of the table, and the function that finds its last columns."""

    group: str
    name: str
    did: str
    expected: str
    run: Callable[[Path], str]


DRILLS: list[Drill] = []


def drill(group: str, name: str, did: str, expected: str) -> Callable[..., Any]:
    """Register a function that tells what happened, or raises AssertionError if it should not."""

    def register(run: Callable[[Path], str]) -> Callable[[Path], str]:
        DRILLS.append(Drill(group, name, did, expected, run))
        return run

    return register


# What all drills begin with, and what must hold of every folder.


@functools.cache
def sound() -> Path:
    """A folder with a campaign that nothing disturbed, and a run."""
    folder = Path(tempfile.mkdtemp(prefix="ringsim-drills-"))
    (folder / "drill.toml").write_text(CAMPAIGN)
    for words in (
        ("campaign", "drill.toml", "--workers", 2, "--out", "out"),
        ("run", "truss2", *SHORT, "--set", "record.state_interval=0.1", "--out", "run.nc"),
    ):
        done = ringsim(*words, folder=folder)
        assert done.returncode == 0, done.stderr
    return folder


def is_whole(path: Path) -> bool:
    """Whether a finished file can be read to its end."""
    content = path.read_bytes()
    match path.suffix:
        case ".nc":
            with netCDF4.Dataset(path) as file:
                return all(each[...] is not None for each in file.variables.values())
        case ".html":
            return content.rstrip().endswith(b"</html>")
        case ".png":
            return content.endswith(b"IEND\xaeB`\x82")
        case ".json":
            return bool(json.loads(content))
        case ".npz":
            return bool(np.load(path).files)
        case ".toml":
            return bool(tomllib.loads(content.decode()))
        case ".csv":
            return content.endswith(b"\n")
        case ".mat":
            return len(content) > 128
    return True


def half_written(folder: Path) -> list[str]:
    """Files at the places of finished ones that are none; drafts have other names."""
    broken = []
    for path in folder.rglob("*"):
        if path.is_file() and not path.name.endswith(".draft"):
            try:
                good = is_whole(path)
            except (OSError, ValueError, EOFError, RuntimeError):
                good = False
            broken += [] if good else [str(path.relative_to(folder))]
    return broken


def drafts(folder: Path) -> int:
    return len([*folder.rglob("*.draft")])


def same_values(one: Path, other: Path) -> bool:
    """Whether two netCDF files hold the same, but for the time that it took."""
    with xr.open_dataset(one) as first, xr.open_dataset(other) as second:
        return comparable(first.load()).identical(comparable(second.load()))


def require(held: object, told: str) -> None:
    if not held:
        raise AssertionError(told)


def require_whole(folder: Path) -> None:
    require(not (broken := half_written(folder)), f"half-written: {', '.join(broken)}")


@dataclass
class Faults:
    """What did not hold within a drill, which goes on in spite of it."""

    found: list[str] = field(default_factory=list)
    tried: int = 0

    @contextlib.contextmanager
    def within(self, *where: Any) -> Iterator[None]:
        """One of many cases of a drill."""
        self.tried += 1
        try:
            yield
        except AssertionError as fault:
            self.found.append(f"{plain(where)}: {fault}")

    def ended(self, told: str) -> str:
        """What the drill tells if all of it held; AssertionError if not."""
        most, more = 8, f" and {len(self.found) - 8} more" * (len(self.found) > 8)
        told_faults = " / ".join(each[:300] for each in self.found[:most]) + more
        require(not self.found, f"{len(self.found)} of {self.tried}: {told_faults}")
        return told


def plain(words: tuple[Any, ...]) -> str:
    return " ".join(map(str, words))


def limited(
    limit: str, words: tuple[Any, ...], folder: Path, end: str = "",
    environment: dict[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:  # fmt: skip
    """A command of a fresh process, behind words of bash and with its streams redirected."""
    command = shlex.join([sys.executable, "-m", "ringsim", *map(str, words)])
    return subprocess.run(
        ["bash", "-c", f"{limit}\n{command} {end}"], cwd=folder, text=True, capture_output=True,
        timeout=300, errors="replace", env=os.environ | (environment or {}),
    )  # fmt: skip
