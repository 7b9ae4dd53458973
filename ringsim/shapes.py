"""The shape of a structure over a run: its points as they were computed, or from its angles."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr

from ringsim.layout.bodies import Array
from ringsim.layout.layout import Layout, layout_at_opening, layout_of
from ringsim.layout.points import Points, points_of
from ringsim.scene import Scene

COMPUTED = "positions as computed"
FROM_ANGLES = "positions from opening angles and nominal geometry, rods straight"

ByLine = Callable[[float], dict[str, Array]]
"""Values of lines at a time (s), by what they are part of as in ``Points.lines``."""


class Track(NamedTuple):
    """What a run recorded of something: times (s), shape (n,), and values, shape (n, ...)."""

    times: Array
    values: Array

    @classmethod
    def of(cls, run: xr.Dataset, name: str, dims: tuple[str, str]) -> "Track":
        """A variable along ``dims`` and time, at the times at which all of it is known."""
        known = run[name].transpose("time", *dims).dropna("time", how="any")
        return cls(known["time"].to_numpy(), np.asarray(known.to_numpy(), dtype=float))

    def at(self, time: float) -> Array:
        """Its values at a time (s), linear between records, the nearest outside of them."""
        if len(self.times) < 2:
            return np.array(self.values[0])
        after = int(np.clip(np.searchsorted(self.times, time), 1, len(self.times) - 1))
        begin, end = self.times[after - 1], self.times[after]
        share = float(np.clip((time - begin) / (end - begin), 0.0, 1.0))
        found: Array = (1.0 - share) * self.values[after - 1] + share * self.values[after]
        return found


@dataclass(frozen=True)
class Shape:
    """A run's shape over time."""

    scene: Scene
    points: Points
    computed: bool
    """Whether the run recorded positions; else they follow from its opening angles."""
    track: Track
    """Positions, (points, 3), m, or opening angles, (planes, sections), rad, over time."""

    @property
    def times(self) -> Array:
        """When it is known, s."""
        return self.track.times

    @property
    def words(self) -> str:
        """Where the positions are from."""
        return COMPUTED if self.computed else FROM_ANGLES

    def at(self, time: float) -> Array:
        """Where the points are at a time (s), linear between records; shape (points, 3), m."""
        known = self.track.at(time)
        return known if self.computed else places_at(self.scene, self.points, known)

    def lines(self, places: Array) -> dict[str, Array]:
        """Ends of all lines by what they are part of; see ``Points.drawn``."""
        return self.points.drawn(places, self._taut_beyond)

    @cached_property
    def _taut_beyond(self) -> Array:
        """Length beyond which each string of the net pulls, m."""
        laws = [law for law in layout_of(self.scene).pair_laws if law.group == "net"]
        each = [law.natural * (law.own.linear() is None) for law in laws]  # which also pushes
        return np.concatenate([np.zeros(0), *each])

    def lags(self, run: xr.Dataset) -> ByLine:
        """Deviation (degree) from the mean opening angle of the joint that a line ends at, NaN for
        those that end at none, and of "V-joints".
        """
        track, joints = Track.of(run, "opening_angle", ("plane", "section")), self.points.openings
        place = np.full(len(self.points.names), -1)
        place[joints.ravel()] = np.arange(joints.size)
        of_line = {name: place[pairs].max(axis=1) for name, pairs in self.points.lines.items()}

        def lags(time: float) -> dict[str, Array]:
            angles = track.at(time).ravel()
            own = np.append(angles - angles.mean(), np.nan)
            return {name: own[joint] for name, joint in of_line.items()} | {"V-joints": own[:-1]}

        return lags

    def stresses(self, run: xr.Dataset) -> ByLine:
        """Stress (Pa) of the rods' lines."""
        layout, track = layout_of(self.scene), Track.of(run, "rod_stress", ("rod", "section"))
        groups: dict[str, list[int]] = {}
        for row, halves in enumerate(layout.halves().values()):
            groups.setdefault(layout.rods[halves[0].rod].group, []).append(row)
        return lambda time: {
            group: track.at(time)[rows].ravel() for group, rows in groups.items()
        }  # fmt: skip


def shape_of(run: xr.Dataset, scene: Scene) -> Shape:
    """The shape of a run, or of one sample of a campaign, with its scene.

    Raises
    ------
    ValueError
        If it recorded nothing.
    """
    computed = "position" in run and bool(np.isfinite(run["position"]).any())
    if not computed and "opening_angle" not in run:
        raise ValueError("the run recorded neither positions nor opening angles")
    if computed:
        track = Track.of(run, "position", ("point", "axis"))
    else:
        track = Track.of(run, "opening_angle", ("plane", "section"))
        track = track._replace(values=np.radians(track.values))
    if not len(track.times):
        raise ValueError("the run ended before its first record")
    return Shape(scene, points_of(layout_of(scene), scene.structure.planes), computed, track)


def places_at(scene: Scene, points: Points, openings: Array) -> Array:
    """Where opening angles (rad), shape (planes, sections), put the points, centred on the vertical
    axis; shape (points, 3), m.
    """
    mean = min(float(openings.mean()), np.pi)  # joints may be past it, the ring cannot
    layout = layout_at_opening(scene, mean)
    return points.places(layout, openings) - middle_of(layout)


def middle_of(layout: Layout) -> Array:
    """The middle of all bodies in plan, shape (3,), m; its height is 0."""
    places = np.array([body.pose.place for body in layout.bodies])
    middle: Array = 0.5 * (places.min(axis=0) + places.max(axis=0)) * [1.0, 1.0, 0.0]
    return middle
