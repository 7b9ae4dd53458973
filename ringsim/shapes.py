"""The shape of a structure over a run: its points as they were computed, or from its angles."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ringsim.layout.layout import Layout, layout_at_opening, layout_of
from ringsim.layout.points import Points, points_of
from ringsim.layout.pose import Array
from ringsim.scene import Scene

COMPUTED = "positions as computed"
FROM_ANGLES = "positions from opening angles and nominal geometry, rods straight"


@dataclass(frozen=True)
class Shape:
    """A run's shape over time."""

    scene: Scene
    points: Points
    times: Array
    """When it is known, s, shape (n,)."""
    computed: bool
    """Whether the run recorded positions; else they follow from its opening angles."""
    known: Array
    """Positions, shape (n, points, 3), m, or opening angles, (n, planes, sections), rad."""

    @property
    def words(self) -> str:
        """Where the positions are from."""
        return COMPUTED if self.computed else FROM_ANGLES

    @property
    def taut_beyond(self) -> float:
        """Length beyond which the net's strings are taut, m."""
        net = self.scene.net
        return 0.0 if net is None or net.two_sided else net.neutral_length

    def at(self, time: float) -> Array:
        """Where the points are at a time (s), linear between records; shape (points, 3), m."""
        after = int(np.clip(np.searchsorted(self.times, time), 1, max(len(self.times) - 1, 1)))
        before = after - 1
        if len(self.times) == 1:
            return self._places(self.known[0])
        span = self.times[after] - self.times[before]
        share = float(np.clip((time - self.times[before]) / span, 0.0, 1.0))
        return self._places((1.0 - share) * self.known[before] + share * self.known[after])

    def lines(self, places: Array) -> dict[str, Array]:
        """Ends of all lines by what they are part of; see ``Points.drawn``."""
        return self.points.drawn(places, self.taut_beyond)

    def lags(self, run: xr.Dataset, time: float) -> dict[str, Array]:
        """Deviation (degree) from the mean opening angle of the joint that each line ends at, by
        what the lines are part of, NaN for those that end at none; linear between records.
        """
        angles = _rows(run, "opening_angle", ("plane", "section"), time).ravel()
        lag = np.full(len(self.points.names) + 1, np.nan)
        lag[self.points.openings.ravel()] = angles - angles.mean()
        joints = np.zeros(len(lag), dtype=bool)
        joints[self.points.openings.ravel()] = True
        found = {}
        for name, pairs in self.points.lines.items():
            first, second = pairs.T
            found[name] = lag[np.where(joints[first], first, np.where(joints[second], second, -1))]
        return found | {"V-joints": angles - angles.mean()}

    def stresses(self, run: xr.Dataset, time: float) -> dict[str, Array]:
        """Stress (Pa) of the rods' lines, by what they are part of; see ``rod_stress``."""
        rows = _rows(run, "rod_stress", ("rod", "section"), time)
        layout, found = layout_of(self.scene), dict[str, list[Array]]()
        for row, halves in zip(rows, layout.halves().values(), strict=True):
            found.setdefault(layout.rods[halves[0].rod].group, []).append(row)
        return {group: np.concatenate(own) for group, own in found.items()}

    def _places(self, known: Array) -> Array:
        return known if self.computed else places_at(self.scene, self.points, known)


def shape_of(run: xr.Dataset, scene: Scene) -> Shape:
    """The shape of a run, or of one sample of a campaign, with its scene.

    Raises
    ------
    ValueError
        If it recorded nothing.
    """
    computed = "position" in run and bool(np.isfinite(run["position"]).any())
    name, dims = ("position", ("point", "axis")) if computed else (
        "opening_angle", ("plane", "section")
    )  # fmt: skip
    if name not in run:
        raise ValueError("the run recorded neither positions nor opening angles")
    found = run[name].transpose("time", *dims).dropna("time", how="any")
    if not found.sizes["time"]:
        raise ValueError("the run ended before its first record")
    values = found.to_numpy() if computed else np.radians(found.to_numpy())
    points = points_of(layout_of(scene), scene.structure.planes)
    return Shape(scene, points, found["time"].to_numpy(), computed, np.asarray(values, dtype=float))


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


def _rows(run: xr.Dataset, name: str, dims: tuple[str, str], time: float) -> Array:
    """A variable of a run over two dimensions at a time (s), linear between records."""
    known = run[name].transpose("time", *dims).dropna("time", how="all")
    times, values = known["time"].to_numpy(), known.to_numpy()
    if len(times) < 2:
        return np.asarray(values[0], dtype=float)
    after = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1))
    share = np.clip((time - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    return np.asarray((1.0 - share) * values[after - 1] + share * values[after], dtype=float)
