"""The family of outputs: series over time, largest values, and what all of them declare."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.choice import kind_of
from ringsim.hermite import cubic, monotone_slopes
from ringsim.layout.layout import Layout, layout_of
from ringsim.outputs.meters import Reading
from ringsim.scene import Scene
from ringsim.scene.substituted import strained
from ringsim.stepping.instant import Array
from ringsim.stepping.locks import History, history
from ringsim.variables import ErrorBar, Variable

# Readings over time, and a run that has ended.


_SAME = 1.0 + 1e-12
"""Times that differ by round-off alone are the same."""


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
        inside = int(np.searchsorted(where, self.times[-1] * _SAME, side="right"))
        self._fill(found[:inside], np.minimum(where[:inside], self.times[-1]), rates)
        found[:, ~np.isfinite(self.values).all(axis=0)] = np.nan
        return found

    def _fill(self, found: Array, where: Array, rates: Array | None) -> None:
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


def slowest_period(layout: Layout) -> float:
    """Longest of the rods' lowest periods of bending, with pinned ends, s.

    2 pi / w, w = (pi / L)^2 sqrt(E I / (rho A)): S. Timoshenko, Vibration Problems in Engineering.
    """
    return max(
        2.0 * rod.length**2 / math.pi
        * math.sqrt(rod.density * rod.tube.area / (rod.young_modulus * rod.tube.second_moment))
        for rod in layout.rods
    )  # fmt: skip


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
    slight: float = 0.0
    """Energy (J) so small that a run of less has done nothing worth judging."""
    layout: Layout | None = None
    """What has moved; None if the scene is to tell."""

    @cached_property
    def slowest_period(self) -> float:
        """See the function of this name."""
        return slowest_period(self.layout or layout_of(self.scene))

    def stretches(self, times: Array) -> list[tuple[NDArray[np.intp], Scene]]:
        """Numbers of the readings, at such times (s), that a scene held for, and this scene, one
        after the other.

        Of two readings at the very time of a change the last one belongs to the scene behind it.
        """
        ends = [
            int(np.searchsorted(times, time * _SAME, side="right")) - 1 for time, _ in self.before
        ]
        bounds = pairwise([0, *ends, len(times)])
        scenes = [*(scene for _, scene in self.before), self.scene]
        return [
            (np.arange(begin, end), scene)
            for (begin, end), scene in zip(bounds, scenes, strict=True)
        ]

    @cached_property
    def opening(self) -> Array:
        """Opening angles at the output times, shape (planes, sections, m), deg."""
        found = self.angles.on_grid(self.rates.values)
        return np.degrees(found, out=found)  # in place: most of what a long ring's outputs take

    @cached_property
    def history(self) -> History:
        """What became of the latches."""
        times, angles, rates = self.angles.times, self.angles.values, self.rates.values
        return history(self.scene, times, angles, rates, self.slowest_period)

    @cached_property
    def held(self) -> Array:
        """When each V-joint locked, shape (planes, sections), s: when its latch caught, or, without
        latches, when it reached 180 deg; NaN if it did not.
        """
        if self.scene.stop is None or not self.scene.stop.latch:
            return self.locks
        caught_at = self.history.caught_at
        if self.caught is None:
            return caught_at
        # A run that went on may have had other latches before.
        known = np.where(np.isnan(caught_at), self.locks, caught_at)
        return np.where(self.caught, known, np.nan)

    @property
    def until(self) -> float:
        """When the last V-joint reached 180 deg, s; infinite if one did not."""
        return float(np.nan_to_num(self.locks, nan=math.inf).max())

    @property
    def locked(self) -> float:
        """When the last V-joint locked, s; infinite if one did not, as its latch missed, say."""
        return float(np.nan_to_num(self.held, nan=math.inf).max())


def output_times(scene: Scene) -> Array:
    """The scene's output grid in s: multiples of ``record.interval`` up to the end time."""
    count = math.floor(scene.solver.end_time / scene.record.interval * _SAME)
    return np.asarray(np.arange(count + 1) * scene.record.interval, dtype=float)


# When and where the largest of an output's readings was.


Values = dict[str, Any]
"""Arrays and numbers by the names of their variables."""
SpanNames = Mapping[str, Sequence[str]]
"""By plane, from the winch on."""


_ROUND_OFF = 1e-6
"""Places that symmetry makes alike differ by less: 1e-10 in tensions and 2e-7 in stresses of rings
without a boom.  A boom, which holds one plane only, makes 3e-4."""


class Top(NamedTuple):
    """The largest of a series: its value, its time (s), and at which of the places."""

    value: float
    time: float
    where: tuple[int, ...]


def top_of(times: Array, values: Array) -> Top:
    """The largest of values of the shape (times, *places), the first of equal ones; NaN counts as
    none.

    Between readings it is that of the parabola through a reading that is larger than its
    neighbours, and these: the largest reading alone is too small by up to h^2 |f''| / 8 at steps of
    h, and two runs may agree in it by chance.  The parabola rises no more than the next slopes
    beyond the neighbours allow, a bound that no true parabola reaches: a level stretch that ends
    with a fall, as of a motor that stalls, has no slope, and so no rise; nor do two equal readings.
    A reading near an end, beside a missing one, or beside a jump, which is two readings of one
    time, stays what it is.

    >>> times = np.array([0.0, 1.0, 2.5, 3.5, 4.0])
    >>> top = top_of(times, 5.0 - (times - 2.3) ** 2)
    >>> round(top.value, 12), round(top.time, 12)
    (5.0, 2.3)
    >>> top_of(np.arange(6.0), np.array([1.0, 2.0, 2.0, 2.0, 0.0, 0.0])).value
    2.0
    """
    flat = values.reshape(len(values), -1)
    tops, shift = flat.astype(float), np.zeros(flat.shape)
    if len(times) > 4:
        steps = np.diff(times)[:, None]
        with np.errstate(all="ignore"):
            slopes = np.diff(flat, axis=0) / steps
            first, up, down, last = slopes[:-3], slopes[1:-2], slopes[2:-1], slopes[3:]
            before, after = steps[1:-2], steps[2:-1]
            bend = (up - down) / (before + after)
            slope = up - bend * before  # at the reading
            most = 0.25 * np.fmax(before, after) ** 2 * np.minimum(
                first / (steps[:-3] + before), -last / (after + steps[3:])
            )  # fmt: skip
            rise = np.minimum(0.25 * slope**2 / bend, most)
            # NaN, beside what is missing, is no rise, and a step without length is a jump.
            apart = (steps[:-3] > 0.0) & (before > 0.0) & (after > 0.0) & (steps[3:] > 0.0)
            rises = apart & (up > 0.0) & (down < 0.0) & np.isfinite(rise) & (rise > 0.0)
            tops[2:-2] += np.where(rises, rise, 0.0)
            shift[2:-2] = np.where(rises, 0.5 * slope / bend, 0.0)
    moment, place = divmod(int(np.nanargmax(tops)), flat.shape[1])
    where = tuple(map(int, np.unravel_index(place, values.shape[1:])))
    time = float(times[moment]) + float(shift[moment, place])
    return Top(float(tops[moment, place]), time, where)


@dataclass(frozen=True)
class Peak:
    """Variables ``NAME_time`` and ``NAME_DIM`` for each dimension of a reading."""

    name: str
    dims: tuple[str, ...]
    words: str
    """What is the largest."""
    series: str = ""
    """Variable (*dims, time) that tells which other places are alike."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Whole numbers where the dimension has numbers (-1 if missing), text elsewhere."""
        types = {"section": "i4", "span": "i4", "winch": "i4", "corner": "i4"}
        where = (
            Variable(f"{self.name}_{d}", (), "1", f"{d} of {self.words}", types.get(d, "str"))
            for d in self.dims
        )
        return (Variable(f"{self.name}_time", (), "s", f"time of {self.words}"), *where)

    def of(self, run: Run, times: Array, values: Array) -> tuple[float, Values]:
        """The largest of values of the shape (times, *dims), and its variables; see ``top_of``."""
        top = top_of(times, values)
        found: Values = {f"{self.name}_time": np.asarray(top.time)}
        for dim, place in zip(self.dims, top.where, strict=True):
            found[f"{self.name}_{dim}"] = run.coordinates[dim][place]
        return top.value, found

    def at(self, run: Run, times: Array, values: Array) -> Values:
        """Of values that each place has at a time of its own, both of shape (*dims); nothing where
        all are NaN.
        """
        if not np.isfinite(values).any():
            return {}
        where = np.unravel_index(int(np.nanargmax(values)), values.shape)
        places = zip(self.dims, where, strict=True)
        found: Values = {f"{self.name}_{dim}": run.coordinates[dim][k] for dim, k in places}
        return found | {f"{self.name}_time": times[where]}

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 0.3 s: upper, span 1 (winch to section 1 first hinge)"; empty if it is unknown."""
        found = [values.get(f"{self.name}_{dim}", np.nan) for dim in ("time", *self.dims)]
        time, *places = (np.asarray(value).item() for value in found)
        if any(each == "" or each != each for each in (time, *places)):
            return ""
        where = dict(zip(self.dims, places, strict=True))
        if not where:
            return f"at {time:.4g} s"
        words = [v if isinstance(v, str) else f"{dim} {v:.0f}" for dim, v in where.items()]
        names = span_names.get(where.get("plane", ""), ())
        if "span" in where and names:
            words[-1] += f" ({names[int(where['span']) - 1]})"
        alike = ties(values, self.series, self.dims, places, time)
        words[0], more = with_ties(tuple(places), alike)
        return f"at {time:.4g} s: {', '.join(words)}{more}"


def ties(
    values: Values, series: str, dims: Sequence[str], own: Sequence[Any], until: float,
    size: float | None = None,
) -> list[tuple[Any, ...]]:  # fmt: skip
    """The places at which a series was that of the ``own`` place up to a time (s), itself included.

    Alike means to round-off of ``size``, by default the largest value there; the own place alone
    where ``values`` hold neither the series nor its coordinates.
    """
    if any(name not in values for name in (series, "time", *dims)):
        return [tuple(own)]
    labels = [np.asarray(values[dim]).tolist() for dim in dims]
    place = tuple(each.index(label) for each, label in zip(labels, own, strict=True))
    end = int(np.searchsorted(values["time"], until)) + 1
    curves = np.asarray(values[series])[..., :end]
    size = float(np.nanmax(np.abs(curves[place]))) if size is None else size
    near = np.isclose(curves, curves[place], rtol=0.0, atol=_ROUND_OFF * size, equal_nan=True)
    return [
        tuple(each[k] for each, k in zip(labels, where, strict=True))
        for where in np.argwhere(near.all(axis=-1)).tolist()
    ]


def with_ties(own: tuple[Any, ...], alike: Sequence[tuple[Any, ...]]) -> tuple[str, str]:
    """The first label of a place, with that of a tie if it is the only one to differ in it alone;
    and how many more ties there are.

    >>> with_ties(("lower", 1), [("upper", 1), ("upper", 9), ("lower", 1), ("lower", 9)])
    ('upper and lower', ' (and 2 more alike)')
    """
    first = [str(place[0]) for place in alike if place[1:] == own[1:]]
    first = first if len(first) == 2 else [str(own[0])]
    more = len(alike) - len(first)
    return " and ".join(first), f" (and {more} more alike)" if more else ""


# The family of outputs, and what all of them together declare.


__all__ = [
    "Array",
    "ErrorBar",
    "Output",
    "Reading",
    "Run",
    "Series",
    "SpanNames",
    "Top",
    "Values",
    "Variable",
    "top_of",
]


OUTPUTS: "list[type[Output]]" = []
"""All outputs, those of the smallest rank first."""

VARIABLES: dict[str, Variable] = {}
"""What all outputs declare, with the error bars of those that have one."""

COORDINATES = {
    "plane": Variable("plane", ("plane",), "1", "plane of the structure", "str"),
    "section": Variable("section", ("section",), "1", "section number, from 1", "i4"),
    "time": Variable("time", ("time",), "s", "time since the start of the run"),
    "span": Variable("span", ("span",), "1", "span of a cable, counted from its winch", "i4"),
    "pulley": Variable(
        "pulley", ("pulley",), "1", "pulley of a cable, at the end of the span of its number",
        "i4",
    ),
    "winch": Variable("winch", ("winch",), "1", "winch: 1 where a path begins, 2 at its end", "i4"),
    "axis": Variable("axis", ("axis",), "1", "axis of space; z points upwards", "str"),
}  # fmt: skip
"""Dimensions of the variables; an output may declare more."""

SPAN_NAME = Variable("span_name", ("plane", "span"), "1", "ends of the span", "str")
"""Coordinate of every result that has spans; empty where a plane's cable has fewer."""


class Output:
    """An output, or a few that are computed together; every run that needs it has its own."""

    variables: ClassVar[tuple[Variable, ...]]
    coordinates: ClassVar[tuple[Variable, ...]] = ()
    """Dimensions that no other output has; an engine gives their values to its ``Recorder``."""
    needs: ClassVar[tuple[str, ...]] = ()
    """What a scene must hold for it, see ``Variable``."""
    peak: ClassVar[Peak | None] = None
    """Variables that tell when and where the value in its summary was."""
    peaks: ClassVar[tuple[Peak, ...]] = ()
    """The same of an output with several such values, whose names these have."""
    shocks: ClassVar[tuple[tuple[str, Peak], ...]] = ()
    """Values that the shock of a lock may make, with what tells when they were."""
    limit: ClassVar[str] = ""
    """Field of ``ringsim.parts.solver.Limits`` that its largest reading must not pass."""
    of_antenna: ClassVar[bool] = True
    """Whether it tells of the antenna, so that engines are compared by it, not of the run."""
    of_opening: ClassVar[bool] = False
    """Whether it tells of the opening alone, so that a ring has come through all of it that opened
    without latching: latches that catch may raise the others."""
    of_both: ClassVar[bool] = False
    """Whether both engines compute it by the same code: neither judges the other by it."""
    late: ClassVar[bool] = False
    """Whether it reads many instants at once, which stand along the first axis, behind them; as
    those do that read nothing."""
    rank: ClassVar[int] = 50
    """Place among the outputs in files and summaries; the smaller the earlier."""

    def __init_subclass__(cls) -> None:
        """Make it known to all that handle results."""
        twice = sorted(_declared(cls).keys() & (VARIABLES.keys() | COORDINATES.keys()))
        if twice:
            raise ValueError(f"{cls.__module__}: there is an output {twice[0]} already: rename it")
        # What reads in its own way says itself, there, whether it does so late.
        reads = next(each for each in cls.__mro__ if "read" in vars(each))
        cls.late = vars(cls).get("late", reads is Output or vars(reads).get("late", False))
        COORDINATES.update({variable.name: variable for variable in cls.coordinates})
        OUTPUTS.append(cls)
        OUTPUTS.sort(key=lambda output: output.rank)
        VARIABLES.clear()
        for output in OUTPUTS:
            VARIABLES.update(_declared(output))

    def read(self, now: Reading) -> Array | float | None:
        """What to keep of the state after an accepted step; None if this run does not tell it."""
        return np.empty((*np.shape(now.time), 0))

    def reduce(self, run: Run, series: Series) -> Values:
        """Values of its variables, from what ``read`` gave at all instants of a run.

        Unless said otherwise the first variable is the reading, interpolated in time, and the
        second of two its largest magnitude, as ``top_of`` has it.
        """
        values: Values = {self.variables[0].name: series.on_grid()}
        if len(self.variables) == 2:
            largest = top_of(series.times, np.abs(series.values)).value
            values[self.variables[1].name] = np.asarray(largest)
        return values

    def told(self, values: Values, span_names: SpanNames) -> str:
        """When and where the value in its summary was, in words; empty if that is not known."""
        return "" if self.peak is None else self.peak.told(values, span_names)

    def told_of(self, name: str, values: Values, span_names: SpanNames) -> str:
        """The same of one of several values in its summary."""
        if not self.peaks:
            return self.told(values, span_names)
        own = (peak for peak in self.peaks if peak.name == name)
        return "".join(peak.told(values, span_names) for peak in own)


def _declared(output: type[Output]) -> dict[str, Variable]:
    """Variables of an output and their error bars ``NAME_error``.

    The bar of a function of time alone is one, too; any other is a number.
    """
    found = {v.name: replace(v, needs=(*output.needs, *v.needs)) for v in output.variables}
    for one in output.variables:
        if one.error_bar is not None:
            name, words = f"{one.name}_error", f"numerical error bar of the {one.error_bar.words}"
            dims = one.dims if one.dims == ("time",) else ()
            words += " at any time up to then" if dims else ""
            if of := one.error_bar.of:
                words += f", from the difference of {of} over all places where that is larger"
            needs = ("error bars", *output.needs)
            found[name] = Variable(name, dims, one.units, words, needs=needs)
    return found


def in_all_planes(values: Array, planes: Sequence[str]) -> Array:
    """Values by plane and corner with rows of NaN for planes that have no corners of their own."""
    found = np.full((len(planes), *values.shape[1:]), np.nan)
    found[: len(values)] = values
    return found


def supply(need: str) -> str:
    """What gives a scene that which an output needs, as an order."""
    if need in type(Scene.model_fields["record"].default).model_fields:
        return f"set record.{need} = true"
    return _SUPPLIES.get(need, "add that to the scene")


_SUPPLIES = {
    "error bars": "set solver.error_bars = true",
    "held base or spacecraft": 'set boom.base = "fixed", or give a spacecraft',
    "second winch": "give its cables two, as [cables.lower.winch] or a far_winch",
    "prestress": "give rods.length_error or structure.hinge_error",
}
"""What gives other needs than those of ``record``."""


def holds(scene: Scene) -> set[str]:
    """Everything that a variable may need and the scene has."""
    winches = [winch for cable in _cables(scene) for winch in cable.winches]
    motors = [motor for winch in winches if (motor := winch.winding.motor) is not None]
    held = {name: getattr(scene, name) is not None for name in type(scene).parts()}
    held |= {
        kind_of(scene.structure): True,
        "stress": scene.record.stress,
        "positions": scene.record.positions,
        "accelerations": scene.record.accelerations,
        "error bars": scene.solver.error_bars,
        "gauge": bool(scene.structure.gauge),
        "motors": bool(motors),
        "second winch": len(winches) > 1,
        "torque_constant": any(motor.torque_constant is not None for motor in motors),
        "reactions": scene.record.reactions,
        "shape": scene.record.shape,
        "frequency": scene.record.frequency,
        "prestress": bool(strained(scene)),
        "base": scene.boom is not None or scene.structure.supported,
        "latches": scene.stop is not None and scene.stop.latch and scene.structure.locks,
        "boundary net": scene.net is not None and scene.net.tells,
        "held base or spacecraft": scene.held or scene.spacecraft is not None,
    }
    return {name for name, present in held.items() if present}


def axes(scene: Scene) -> dict[str, NDArray[Any]]:
    """Values of the dimensions that a scene tells before it runs."""
    most = max((len(cable.winches) for cable in _cables(scene)), default=0)
    return {
        "plane": np.array(scene.structure.planes),
        "section": np.arange(1, scene.structure.sections + 1),
        "time": output_times(scene),
        "span": np.arange(1, scene.spans + 1),
        "pulley": np.arange(1, scene.spans),
        "winch": np.arange(1, most + 1),
        "axis": np.array(["x", "y", "z"]),
    }


def _cables(scene: Scene) -> list[Cable]:
    return [] if scene.cables is None else [cable for _, cable in scene.cables.present()]


def span_names(scene: Scene) -> NDArray[Any]:
    """Values of ``SPAN_NAME``, shape (planes, spans)."""
    rows = ([*names, *[""] * (scene.spans - len(names))] for names in scene.span_names.values())
    return np.array(list(rows), dtype=str)
