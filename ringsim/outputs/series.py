"""What outputs read of a state, the readings over time, and a run that has ended."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.hermite import cubic, monotone_slopes
from ringsim.scene import Scene
from ringsim.stepping.instant import Array, Instant
from ringsim.stepping.latches import history

_SAME = 1.0 + 1e-12
"""Times that differ by round-off alone are the same."""


class Carried(NamedTuple):
    """What base and stops carry.

    Force (N) and torque (N m) of the base on the structure, shape (2, 3), about the base's origin,
    None of a base that floats alone; rotation matrix of the base since the start, None without a
    base; torque of the stop on every V-joint, shape (planes, sections), N m, None without stops.
    """

    reaction: Array | None
    turn: Array | None
    stops: Array | None


class Put(NamedTuple):
    """Places of the corners, shape (planes, corners, 3), m, and elastic energy of the rods, J."""

    corners: Array
    rods: float


@dataclass(frozen=True)
class Reading(Instant):
    """An instant with all that outputs read; to them its energies tell ``work`` with what the
    winches put in, and ``lost``, since the start.
    """

    chain: ChainState | None = None
    """All cables; None if the scene has none."""
    planes: tuple[tuple[int, ...], ...] = ()
    """Planes of each cable of the chain: one may stand for two cables that pull alike."""
    stress: Array | None = None
    """Axial + bending stress, shape (rod halves, sections), Pa; None unless recorded."""
    places: Array | None = None
    """Places (m) and velocities (m/s) of the structure's points, shape (points, 2, 3); None unless
    recorded."""
    strain: Array | None = None
    """Bending strain at the stations of the rod with the gauge, if the structure has one."""

    carried: Carried | None = None
    """What base and stops carry; None unless recorded."""
    accelerations: Array | None = None
    """Of the corners, shape (planes, corners, 3), m/s^2; None unless recorded."""

    put: Put | None = None
    """Where corners are and what the rods store; None unless recorded."""
    edge: Array | None = None
    """Tension of the cables along a net's edge, shape (planes, sections), N; None without."""

    def by_plane(self, of_cables: NDArray[Any]) -> Array:
        """A number for each plane, from one for each cable; NaN where a plane has no cable."""
        found = np.full(len(self.angles), np.nan)
        for planes, value in zip(self.planes, of_cables, strict=True):
            found[list(planes)] = value
        return found


@dataclass(frozen=True)
class Series:
    """Readings of one thing at all instants of a run."""

    times: Array
    """Shape (n,), s."""
    values: Array
    """Shape (n, ...), in the reading's unit."""
    grid: Array
    """The scene's output times, s."""

    def on_grid(self, rates: Array | None = None) -> Array:
        """Values at the output times, which are the last axis; see :meth:`at`."""
        return np.moveaxis(self.at(self.grid, rates), 0, -1)

    def at(self, where: Array, rates: Array | None = None) -> Array:
        """Values at increasing times (s), which are the first axis; NaN after the end of the run,
        and where they are not known throughout, as of a plane without a cable.

        Cubic Hermite interpolation with ``rates``, the values' derivatives, else PCHIP.
        """
        found = np.full((len(where), *self.values.shape[1:]), np.nan)
        inside = where <= self.times[-1] * _SAME
        found[inside] = self._within(np.minimum(where[inside], self.times[-1]), rates)
        found[:, ~np.isfinite(self.values).all(axis=0)] = np.nan
        return found

    def _within(self, where: Array, rates: Array | None) -> Array:
        found = np.empty((len(where), *self.values.shape[1:]))
        values = np.nan_to_num(self.values, posinf=0.0, neginf=0.0)
        # Two readings of one time are a jump, which no curve goes through.
        jumps = np.flatnonzero(np.diff(self.times) <= 0.0) + 1
        for begin, end in pairwise([0, *jumps, len(self.times)]):
            times, known = self.times[begin:end], values[begin:end]
            own = (where >= times[0]) & (where <= times[-1])
            if len(times) == 1:
                found[own] = known
            else:
                slopes = monotone_slopes(times, known) if rates is None else rates[begin:end]
                found[own] = cubic(times, known, slopes, where[own])
        return found


@dataclass(frozen=True)
class Run:
    """A run that has ended."""

    scene: Scene
    angles: Series
    """Opening angles, shape (n, planes, sections), rad."""
    rates: Series
    """Their rates, rad/s."""
    locks: Array
    """When each V-joint reached 180 deg, shape (planes, sections), s; NaN if it did not."""
    counts: Mapping[str, int]
    """What the solver has counted, by variable."""
    coordinates: Mapping[str, NDArray[Any]]
    """Values of all dimensions."""
    before: tuple[tuple[float, Scene], ...] = ()
    """Scenes that it had before its own, each with the time up to which it did, s."""
    caught: NDArray[np.bool_] | None = None
    """Which latches hold at its end, shape (planes, sections); None if it did not tell."""

    def stretches(self) -> list[tuple[NDArray[np.intp], Scene]]:
        """Numbers of the steps that a scene held for, and this scene, one after the other.

        A step to the very time of a change belongs to the scene before.
        """
        times = self.angles.times
        ends = [int(np.searchsorted(times, time * _SAME, side="right")) for time, _ in self.before]
        bounds = pairwise([0, *ends, len(times)])
        scenes = [*(scene for _, scene in self.before), self.scene]
        return [
            (np.arange(begin, end), scene)
            for (begin, end), scene in zip(bounds, scenes, strict=True)
        ]

    @property
    def held(self) -> Array:
        """When each V-joint locked, shape (planes, sections), s: when its latch caught, or, without
        latches, when it reached 180 deg; NaN if it did not.
        """
        if self.scene.stop is None or not self.scene.stop.latch:
            return self.locks
        series = self.angles.times, self.angles.values, self.rates.values
        caught_at = history(self.scene, *series).caught_at
        if self.caught is None:
            return caught_at
        # A run that went on may have had other latches before.
        known = np.where(np.isnan(caught_at), self.locks, caught_at)
        return np.where(self.caught, known, np.nan)

    @property
    def until(self) -> float:
        """When the last V-joint reached 180 deg, s; infinite if one did not."""
        return float(np.nan_to_num(self.locks, nan=math.inf).max())


def output_times(scene: Scene) -> Array:
    """The scene's output grid in s: multiples of ``record.interval`` up to the end time."""
    count = math.floor(scene.solver.end_time / scene.record.interval * _SAME)
    return np.asarray(np.arange(count + 1) * scene.record.interval, dtype=float)
