"""Runs of ringsim beside MBDyn's, at equal mean opening angle (see mbdyn_data/README.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import ringsim
from ringsim.scene import Scene
from ringsim.variables import RODS

Array = NDArray[np.float64]

DATA = Path(__file__).parent / "mbdyn_data"
BARS = np.array([rod.startswith("bar") for rod in RODS])

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
    """Opening angles and largest stresses of one run over time, before any stop acts.

    Attributes
    ----------
    times
        Shape (n,), s.
    angles
        Shape (n, 2 * sections), deg: upper plane first.
    stresses
        Shape (n, 8), Pa: the largest over all sections of each rod half of ``RODS``.
    """

    times: Array
    angles: Array
    stresses: Array

    @cached_property
    def mean(self) -> Array:
        """Mean opening angle, shape (n,), deg."""
        return self.angles.mean(axis=1)

    def covers(self, mean: float) -> bool:
        """Whether the run comes to a mean angle (deg)."""
        return bool(self.mean[0] <= mean <= self.mean[-1])

    def time_at(self, means: Array) -> Array:
        """Times of mean angles (deg), s: the roots of a cubic spline; NaN where not reached."""
        spline = CubicSpline(self.times, self.mean)
        found = [spline.solve(m, extrapolate=False) if self.covers(m) else [] for m in means]
        return np.array([roots[0] if len(roots) else np.nan for roots in found])

    def angles_at(self, times: Array) -> Array:
        """Angles at times, shape (times, 2 * sections), deg."""
        return np.asarray(CubicSpline(self.times, self.angles)(times, extrapolate=False))

    def stresses_at(self, times: Array) -> Array:
        """Stresses at times, shape (times, 8), Pa."""
        return np.array([np.interp(times, self.times, s, right=np.nan) for s in self.stresses.T]).T


@lru_cache
def reference(case: str) -> Series:
    """MBDyn's run of a case."""
    path = DATA / f"{case}.csv.gz"
    table = np.genfromtxt(path, delimiter=",", names=True)
    names = table.dtype.names
    assert names is not None
    angles = [table[name] for name in names if name.startswith("angle_")]
    stresses = [table[f"stress_max_{rod}_Pa"] for rod in RODS]
    return Series(table["time_s"], np.array(angles).T, np.array(stresses).T)


def scene_of(case: str, values: dict[str, Any] | None = None) -> Scene:
    """The scene of a case up to the end of MBDyn's data, with stress; ``values`` override.

    The output grid has ten points between two of MBDyn's.
    """
    times = reference(case).times
    output = {
        "solver.end_time": float(times[-1]),
        "record.interval": float(times[1] - times[0]) / 10.0,
        "record.stress": True,
    }
    return ringsim.load_scene("ring18").with_values(_CASES[case] | output | (values or {}))


def series_of(run: xr.Dataset) -> Series:
    """A run of ringsim until its first joint reaches 180 deg."""
    opening = run["opening_angle"].transpose("time", "plane", "section").values
    angles = opening.reshape(len(opening), -1)
    free = np.cumprod(angles.max(axis=1) < 180.0).astype(bool)
    stresses = run["rod_stress"].max("section").transpose("time", "rod").values
    return Series(run["time"].values[free], angles[free], stresses[free])


class Comparison:
    """A run of ringsim beside MBDyn's of the same case, at equal mean opening angle."""

    def __init__(self, case: str, run: xr.Dataset) -> None:
        self.theirs = reference(case)
        self.ours = series_of(run)
        means = self.theirs.mean
        self._known = means[(means >= 48.0) & (means <= min(175.0, self.ours.mean[-1]))]

    def time_errors(self, means: Array) -> Array:
        """Relative errors of the times at which mean angles (deg) are reached."""
        return np.asarray(self.ours.time_at(means) / self.theirs.time_at(means) - 1.0)

    def deviations(self, means: Array) -> tuple[Array, Array]:
        """Joints' deviations from the mean at mean angles: ours and MBDyn's, deg."""
        both = []
        for series in (self.ours, self.theirs):
            angles = series.angles_at(series.time_at(means))
            both.append(angles - angles.mean(axis=1, keepdims=True))
        return both[0], both[1]

    def deviation_errors(self, means: Array) -> Array:
        """Worst error of a joint's deviation over the largest deviation, at each mean angle."""
        ours, theirs = self.deviations(means)
        return np.asarray(np.abs(ours - theirs).max(axis=1) / np.abs(theirs).max(axis=1))

    def window(self, low: float, high: float) -> Array:
        """MBDyn's mean angles (deg) from ``low`` to ``high``, as far as both runs come."""
        return self._known[(self._known >= low) & (self._known <= high)]

    def asynchrony_error(self, until: float = 175.0) -> float:
        """Relative error of the largest asynchrony up to a mean angle (deg), or the data's end."""
        means = self.window(0.0, until)
        if self.theirs.covers(until) and self.ours.covers(until):
            means = np.append(means, until)
        ours, theirs = (np.ptp(deviations, axis=1).max() for deviations in self.deviations(means))
        return float(ours / theirs - 1.0)

    def stresses(self, low: float = 75.0, high: float = 135.0) -> tuple[Array, Array]:
        """Stresses in a window of mean angles (deg): ours and MBDyn's, shape (angles, 8), Pa."""
        means = self.window(low, high)
        ours, theirs = (s.stresses_at(s.time_at(means)) for s in (self.ours, self.theirs))
        return ours, theirs

    def worst_stress_error(self, low: float = 75.0, high: float = 135.0) -> float:
        """Largest error of any rod half over the largest stress at the same angle."""
        ours, theirs = self.stresses(low, high)
        return float((np.abs(ours - theirs).max(axis=1) / theirs.max(axis=1)).max())

    def mean_bar_stress_error(self, low: float = 75.0, high: float = 135.0) -> float:
        """Relative error of the bars' stress, averaged over bars and angles."""
        ours, theirs = self.stresses(low, high)
        return float(ours[:, BARS].mean() / theirs[:, BARS].mean() - 1.0)


def dissipation_before_stops(run: xr.Dataset) -> float:
    """Energy lost until the first joint reaches 180 deg, J."""
    return float(run["dissipation"].values[len(series_of(run).times) - 1])
