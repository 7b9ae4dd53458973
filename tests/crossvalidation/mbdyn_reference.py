"""Runs of ringsim beside MBDyn's, at equal mean opening angle (see mbdyn_data/README.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from ring_rods import RODS
from scipy.interpolate import CubicSpline

import ringsim
from ringsim.scene import Scene

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

DATA = Path(__file__).parent / "mbdyn_data"
ENDS = {"bar_upper_left": ("corner", "vjoint"), "diagonal_rising_left": ("lower_corner", "pivot")}
"""Rod halves whose forces MBDyn's data give in single sections, and where."""

_FREE_RING = {"boom": "none", "net": "none", "loads.force": 0.03}
_CASES: dict[str, dict[str, Any]] = {
    "closed6_force": _FREE_RING | {"structure.sections": 6, "loads.force[2]": 0.015},
    "closed18_force": _FREE_RING | {"loads.force[5]": 0.015},
    "ring18": {},
}
CASES = tuple(_CASES)
LOCK_TIMES = np.array([3.941793, 3.942673, 3.941793, 3.941120, 3.941234, 3.941120])
"""closed6_force with stops of 200 N m/rad without damping, sections 1 to 6, s."""


@dataclass(frozen=True)
class Series:
    """Opening angles and stresses of one run over time, before any stop acts.

    Attributes
    ----------
    times
        Shape (n,), s.
    angles
        Shape (n, 2 * sections), deg: upper plane first.
    stresses
        Shape (n, rods), Pa, rods as in ``rods_of``; no rods if the run did not record it.
    """

    times: Array
    angles: Array
    stresses: Array

    @cached_property
    def mean(self) -> Array:
        """Mean opening angle, shape (n,), deg."""
        return np.asarray(self.angles.mean(axis=1))

    @cached_property
    def deviations(self) -> Array:
        """Deviations of the joints from the mean angle, shape (n, 2 * sections), deg."""
        return self.angles - self.mean[:, None]

    def time_at(self, means: Array) -> Array:
        """Times of mean angles (deg) within the run, s: roots of a cubic spline."""
        spline = CubicSpline(self.times, self.mean)
        return np.array([spline.solve(mean, extrapolate=False)[0] for mean in means])


@lru_cache
def table(case: str) -> dict[str, Array]:
    """Columns of MBDyn's data by name."""
    data = np.genfromtxt(DATA / f"{case}.csv.gz", delimiter=",", names=True)
    return {name: data[name] for name in data.dtype.names}


def rods_of(case: str) -> list[tuple[str, int | None]]:
    """Rod halves whose stress is known, and their section: None for the largest of all sections."""
    sections = {name.split("_")[-2] for name in table(case) if name.startswith("N_bar")}
    single = [(rod, int(k)) for rod in ENDS for k in sorted(sections, key=int)]
    return [*((rod, None) for rod in RODS), *single]


@lru_cache
def reference(case: str) -> Series:
    """MBDyn's run of a case."""
    columns = table(case)
    angles = [values for name, values in columns.items() if name.startswith("angle_")]
    stresses = [
        columns[f"stress_max_{rod}_Pa"] if section is None else _stress(columns, rod, section)
        for rod, section in rods_of(case)
    ]
    return Series(columns["time_s"], np.array(angles).T, np.array(stresses).T)


def _stress(columns: dict[str, Array], rod: str, section: int) -> Array:
    """Largest |N| / A + |M| r / I at the ends of one rod half, Pa."""
    rods = ringsim.load_scene("ring18").rods
    tube = rods.bar if rod.startswith("bar") else rods.diagonal
    found = []
    for end in ENDS[rod]:
        name = f"{rod.removesuffix('_left') if 'diagonal' in rod else rod}_at_{end}_{section}"
        moment = np.hypot(columns[f"My_{name}_Nm"], columns[f"Mz_{name}_Nm"])
        bending = moment * 0.5 * tube.outer_diameter / tube.second_moment
        found.append(np.abs(columns[f"N_{name}_N"]) / tube.area + bending)
    return np.maximum(*found)


def scene_of(case: str, values: dict[str, Any] | None = None) -> Scene:
    """The scene of a case with stress output, ten times as dense as MBDyn's; ``values`` override.

    With ``solver.end_time`` at the end of MBDyn's data it costs less, as it never reaches the
    stops; but the default leaves the first steps as a user has them.
    """
    times = reference(case).times
    output = {"record.interval": float(times[1] - times[0]) / 10.0, "record.stress": True}
    return ringsim.load_scene("ring18").with_values(_CASES[case] | output | (values or {}))


def tight_settings(case: str) -> dict[str, Any]:
    """What to override for errors near MBDyn's own; the run ends with MBDyn's data."""
    end = {"solver.end_time": float(reference(case).times[-1])}
    if case == "closed6_force":
        return end | {"solver.tolerance": 3e-6, "rods.elements": 4}
    # 18 sections vibrate with a period of 0.6 s, which the mean motion hardly shows.
    steps = {"solver.step_control": "constant", "solver.step": 0.01}
    return end | steps | {"rods.elements": 2 if case == "closed18_force" else 1}


def series_of(case: str, run: xr.Dataset) -> Series:
    """A run of a case by ringsim until its first joint reaches 180 deg."""
    opening = run["opening_angle"].transpose("time", "plane", "section").values
    angles = opening.reshape(len(opening), -1)
    free = np.logical_and.accumulate(angles.max(axis=1) < 180.0)
    times = run["time"].values[free]
    if "rod_stress" not in run:
        return Series(times, angles[free], np.empty((len(times), 0)))
    largest = run["rod_stress"].max("section")
    stresses = [
        (largest if section is None else run["rod_stress"].sel(section=section)).sel(rod=rod)
        for rod, section in rods_of(case)
    ]
    return Series(times, angles[free], np.array(stresses).T[free])


class Comparison:
    """A run of ringsim beside MBDyn's of the same case.

    Everything is compared at rows of MBDyn's data, so that only ringsim's run, which is given
    on a denser grid, is interpolated.

    Parameters
    ----------
    case
        One of ``CASES``.
    run
        The dataset of ``scene_of(case, ...)``.
    """

    def __init__(self, case: str, run: xr.Dataset) -> None:
        self.theirs = reference(case)
        self.ours = series_of(case, run)

    def rows(self, low: float, high: float) -> Rows:
        """Rows with mean angles from ``low`` to ``high`` (deg), as far as both runs come."""
        mean = self.theirs.mean
        return np.flatnonzero((mean >= low) & (mean <= min(high, self.ours.mean[-1])))

    def nearest(self, means: Array) -> Rows:
        """Rows nearest to mean angles (deg); those that a run does not reach are left out."""
        rows = self.rows(0.0, 180.0)
        reached = means[means <= self.theirs.mean[rows[-1]]]
        return rows[np.abs(self.theirs.mean[rows] - reached[:, None]).argmin(axis=1)]

    def time_errors(self, rows: Rows) -> Array:
        """Relative errors of the times at which the mean angles are reached."""
        ours = self.ours.time_at(self.theirs.mean[rows])
        return np.asarray(ours / self.theirs.times[rows] - 1.0)

    def deviations(self, rows: Rows) -> tuple[Array, Array]:
        """Joints' deviations from the mean, ours and MBDyn's, shape (rows, joints), deg."""
        times = self.ours.time_at(self.theirs.mean[rows])
        ours = CubicSpline(self.ours.times, self.ours.deviations)(times)
        return np.asarray(ours), self.theirs.deviations[rows]

    def deviation_errors(self, rows: Rows) -> Array:
        """Worst error of a joint's deviation over the largest deviation, at each row."""
        ours, theirs = self.deviations(rows)
        return np.asarray(np.abs(ours - theirs).max(axis=1) / np.abs(theirs).max(axis=1))

    def asynchrony_error(self, until: float = 175.0) -> float:
        """Relative error of the largest asynchrony up to a mean angle (deg), or the data's end."""
        both = self.deviations(self.rows(48.0, until))
        ours, theirs = (np.ptp(deviations, axis=1).max() for deviations in both)
        return float(ours / theirs - 1.0)

    def stresses(self, rows: Rows) -> tuple[Array, Array]:
        """Stresses of ``rods_of``, ours and MBDyn's, shape (rows, rods), Pa."""
        times = self.ours.time_at(self.theirs.mean[rows])
        ours = [np.interp(times, self.ours.times, stress) for stress in self.ours.stresses.T]
        return np.array(ours).T, self.theirs.stresses[rows]

    def stress_errors(self, rows: Rows) -> Array:
        """Worst error of any of these stresses over the largest, at each row."""
        ours, theirs = self.stresses(rows)
        return np.asarray(np.abs(ours - theirs).max(axis=1) / theirs.max(axis=1))

    def mean_bar_stress_error(self, rows: Rows) -> float:
        """Relative error of the bars' largest stresses, averaged over bars and rows."""
        ours, theirs = self.stresses(rows)
        bars = [column for column, rod in enumerate(RODS) if rod.startswith("bar")]
        return float(ours[:, bars].mean() / theirs[:, bars].mean() - 1.0)
