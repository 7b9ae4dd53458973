"""Which design is best: a search by few evaluations, under requirements that have a probability.

Designs are points x of the unit box, f are statistics that are made small and g <= 0 what is
required.  All designs are judged by the same few samples of what is uncertain (common random
numbers), so that f and g are nearly smooth functions of x:

    min f_1(x)   subject to   f_2(x) <= level,   g(x) + s <= 0

by COBYQA, which needs no derivatives and interpolates f and g by quadratics in a trust region
(Ragonneau, thesis, Hong Kong 2022; in scipy).  Several levels give the front of two objectives
(Haimes, Lasdon and Wismer, IEEE Trans. SMC-1, 1971).  That P(y <= b) >= p is steered by

    g(x) = mean(y) + z_a sd(y) - b

with a beyond p by as much as it takes to show p by the samples of the verdict.  What few samples
and a normal law get wrong of the quantile is what many fresh samples at the optimum say, the shift
s, with which the search goes on (Du and Chen, J. Mech. Design 126 (2004) 225).  Verdicts are told
by samples that have chosen nothing.
"""

import queue
import threading
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import scipy

from ringsim.analysis.intervals import share_bounds
from ringsim.analysis.requirements import Requirement
from ringsim.analysis.verdicts import Verdict
from ringsim.stepping.instant import Array
from ringsim.tables import Table, interval_text, number_text, readable, unit_text

if TYPE_CHECKING:
    import xarray as xr

SEARCH, CHECK, VERDICT = "search", "check", "verdict"
"""Which samples a design is run with: few, the same for all; more; and fresh ones."""
_FIRST_STEP, _LATER_STEP, _LAST_STEP = 0.25, 0.1, 0.005
"""Sizes of a trust region in the unit box: at the begin, with a shift, and where a search ends."""
_SHARE_LATER = 1.0 / 3.0
"""Of all designs, those that are left for searches with a shift."""
_LIKELY = 0.8
"""Probability with which a design that reaches what is aimed at is shown to meet a requirement."""
DIGITS = 6
"""Points are rounded to so many digits, so that the last bits of a library choose no design."""
_SAME = 1e-3
"""Of the range of a variable: closer designs are one."""
_TINY = 1e-12
_PENALTY = 1.0
"""Of a statistic that has no sample, beyond the worst known, over its scale."""

Values = Mapping[str, Array]
"""By output of each sample of a design, shape (samples,); NaN where a run failed or ended before
its goal."""


@dataclass(frozen=True)
class Objective:
    """A statistic that is made small, or large."""

    output: str
    statistic: Literal["mean", "quantile"] = "mean"
    probability: float = 0.5
    """Below the quantile."""
    sign: float = 1.0
    """1 to make it small, -1 to make it large."""

    @property
    def told(self) -> str:
        """Its name in tables."""
        what = "mean" if self.statistic == "mean" else f"{self.probability:g} quantile"
        return f"{self.output} ({what})"

    def steered(self, values: Array) -> float:
        """The statistic of known values, times the sign: the quantile by a normal law."""
        more = 0.0
        if self.statistic == "quantile":
            more = float(scipy.special.ndtri(self.probability)) * _spread(values)
        return self.sign * (float(values.mean()) + more)


@dataclass(frozen=True)
class Problem:
    """What is to be made small, and what is required."""

    objectives: Sequence[Objective]
    """One or two."""
    requirements: Mapping[str, Requirement]
    start: Array
    """The present design in the unit box, shape (variables,)."""
    designs: int
    """To be evaluated in all searches, at most."""
    verdict_samples: int
    front: int = 1
    """Levels of the second objective."""

    @property
    def bounds(self) -> list[tuple[str, float, float, float]]:
        """Each number that is required: output, 1 for a largest and -1 for a least value, bound,
        and the probability to aim at; outcomes are among what has no value.
        """
        found = []
        for name, wanted in self.requirements.items():
            aim = aimed(wanted, self.verdict_samples)
            for key, bound in wanted.limits:
                found.append((name, 1.0 if key == "max" else -1.0, bound, aim))
        return found

    @property
    def least(self) -> int:
        """Designs that all searches take at least."""
        return 2 * self.front * (2 * len(self.start) + 2)


def aimed(wanted: Requirement, samples: int) -> float:
    """The probability of keeping to a requirement at which so many samples are likely to show it.

    Shown is what the lower bound of Clopper and Pearson says: of a design that keeps to it with
    just the probability required, hardly any campaign can.
    ValueError if no number of violations would show it.

    Examples
    --------
    >>> wanted = Requirement(max=1.0, probability=0.99, confidence=0.9)
    >>> round(aimed(wanted, 1000), 4)  # up to 5 violations show it
    0.9961
    """
    most = -1
    while share_bounds(samples - most - 1, samples, wanted.confidence)[0] >= wanted.probability:
        most += 1
    if most < 0:
        raise ValueError
    # P(at most ``most`` of ``samples``) = _LIKELY: the binomial's tail is a beta function.
    return float(1.0 - scipy.special.betaincinv(most + 1, samples - most, 1.0 - _LIKELY))


def _spread(values: Array) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


class Judged(NamedTuple):
    """What some samples say of a design."""

    objectives: Array
    """Statistics, to be made small, shape (objectives,); NaN without a sample."""
    beyond: Array
    """How far the quantiles aimed at lie beyond the bounds, shape (bounds,); NaN likewise."""
    lost: float
    """Share of samples that failed, ended before their goal or have no value."""

    def feasible(self, shift: Array) -> bool:
        """Whether all is kept to, with a shift of shape (bounds,)."""
        return bool(self.lost == 0.0 and (self.beyond + shift <= 0.0).all())


def judged(problem: Problem, values: Values, *, many: bool = False) -> Judged:
    """Statistics of a design.  ``many`` samples also tell quantiles by their order: the worse one
    of both counts, as far out as they reach.
    """
    every = np.isfinite(np.array(list(values.values())))
    known = every.all(axis=0)
    lost = 1.0 - float(known.mean())
    if not known.any():
        shape = len(problem.objectives), len(problem.bounds)
        return Judged(np.full(shape[0], np.nan), np.full(shape[1], np.nan), lost)
    good = {name: own[known] for name, own in values.items()}
    beyond = []
    for name, sign, bound, aim in problem.bounds:
        own = sign * (good[name] - bound)
        far = float(own.mean() + scipy.special.ndtri(aim) * _spread(own))
        if many:
            reach = min(aim, 1.0 - 0.5 / len(own))
            far = max(far, float(np.quantile(own, reach, method="hazen")))
        beyond.append(far)
    return Judged(
        np.array([each.steered(good[each.output]) for each in problem.objectives]),
        np.array(beyond), lost,
    )  # fmt: skip


class Wanted(NamedTuple):
    """A design to be run, with which samples."""

    samples: str
    """SEARCH, CHECK or VERDICT."""
    point: Array


@dataclass
class Chosen:
    """A design that was chosen, and why."""

    point: Array
    level: float
    """Of the second objective; infinite without one."""
    search: Judged
    check: Judged
    shift: Array
    """Found at it, shape (bounds,)."""
    without: list[Judged] = field(default_factory=list)
    """By variable: the same design but for that variable, which is the present one's."""


@dataclass
class Found:
    """All that the search has found."""

    points: list[Array] = field(default_factory=list)
    judged: list[Judged] = field(default_factory=list)
    chosen: list[Chosen] = field(default_factory=list)
    """By level, from that which is best in the first objective; not the present one."""


Course = Generator[Wanted, Values, Found]
"""What is to be run next, given the values of what was; at the end what was found."""


class _StoppedError(Exception):
    """Nobody waits for the search any more."""


class _Search:
    """COBYQA in a thread of its own, which waits wherever it wants to know a design."""

    def __init__(self, start: Array, designs: int, step: float) -> None:
        self._asked: queue.Queue[Any] = queue.Queue()
        self._told: queue.Queue[Any] = queue.Queue()
        self._known: dict[bytes, tuple[float, Array]] = {}
        own = threading.Thread(target=self._run, args=(start, designs, step), daemon=True)
        own.start()

    def next(self) -> Array | None:
        """The design that it wants to know; None at its end."""
        asked = self._asked.get()
        if isinstance(asked, Exception):
            raise asked
        return None if asked is None else np.asarray(asked)

    def tell(self, value: float, beyond: Array) -> None:
        """What it wants to make small there, and what shall be at most 0."""
        self._told.put((value, beyond))

    def stop(self) -> None:
        """Let the thread end."""
        self._told.put(None)

    def _at(self, point: Array) -> tuple[float, Array]:
        point = np.asarray(np.round(np.clip(point, 0.0, 1.0), DIGITS), dtype=np.float64)
        key = point.tobytes()
        if key not in self._known:
            self._asked.put(point)
            if (told := self._told.get()) is None:
                raise _StoppedError
            self._known[key] = told
        return self._known[key]

    def _run(self, start: Array, designs: int, step: float) -> None:
        try:
            scipy.optimize.minimize(
                lambda x: self._at(x)[0], start, method="COBYQA",
                bounds=scipy.optimize.Bounds(np.zeros(len(start)), np.ones(len(start))),
                constraints=scipy.optimize.NonlinearConstraint(
                    lambda x: self._at(x)[1], -np.inf, 0.0
                ),
                options={"maxfev": designs, "initial_tr_radius": step,
                         "final_tr_radius": _LAST_STEP},
            )  # fmt: skip
            self._asked.put(None)
        except _StoppedError:
            return
        except Exception as error:  # it is raised again where the search is waited for
            self._asked.put(error)


class _Archive:
    """All designs with what few samples say of them."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.found = problem, Found()
        self._places: dict[bytes, int] = {}
        self.scales: Array = np.ones(0, dtype=np.float64)
        """Of the objectives, then of the bounds."""

    def at(self, point: Array) -> Generator[Wanted, Values, Judged]:
        """What is known of a design, after a run if nothing is."""
        point = np.round(point, DIGITS)
        if (place := self._places.get(point.tobytes())) is None:
            values = yield Wanted(SEARCH, point)
            place = self._places[point.tobytes()] = len(self.found.points)
            self.found.points.append(point)
            self.found.judged.append(judged(self.problem, values))
        if not len(self.scales):
            self._scale(self.found.judged[place])
        return self.found.judged[place]

    def _scale(self, first: Judged) -> None:
        sizes = [abs(bound) for _, _, bound, _ in self.problem.bounds]
        beyond = np.maximum(np.abs(first.beyond), np.array(sizes, dtype=np.float64))
        own = np.concatenate([np.abs(first.objectives), beyond])
        self.scales = np.array(np.where(np.isfinite(own) & (own > _TINY), own, 1.0), np.float64)

    def value(self, one: Judged, which: int, level: float, shift: Array) -> tuple[float, Array]:
        """What a search makes small, and what shall be at most 0, without units."""
        count = len(self.problem.objectives)
        parts = np.concatenate([one.objectives, one.beyond + shift]) / self.scales
        if not np.isfinite(parts).all():
            known = [np.concatenate([j.objectives, j.beyond]) / self.scales
                     for j in self.found.judged if np.isfinite(j.objectives).all()]  # fmt: skip
            parts = (np.max(known, axis=0) if known else np.zeros(len(parts))) + _PENALTY
        other = [parts[1 - which] - level / self.scales[1 - which]] if np.isfinite(level) else []
        return float(parts[which]), np.array([*parts[count:], *other, one.lost])

    def best(self, which: int, level: float, shift: Array) -> int:
        """The best design known: of those that keep to all, or that which is least beyond."""
        told = [self.value(one, which, level, shift) for one in self.found.judged]
        beyond = np.array([max(0.0, float(g.max())) for _, g in told])
        least = np.flatnonzero(beyond <= beyond.min() + _TINY)
        return int(least[np.argmin([told[k][0] for k in least])])


def course(problem: Problem) -> Course:
    """The whole search: yields the designs to be run, and returns what was found."""
    archive, free = _Archive(problem), np.zeros(len(problem.bounds))
    found = archive.found
    yield from archive.at(problem.start)
    later = int(_SHARE_LATER * problem.designs / problem.front)
    first = problem.designs // problem.front - later
    ends = []
    for which in range(len(problem.objectives)):
        place = yield from _search(archive, problem.start, first, which)
        ends.append(found.judged[place].objectives)
    levels = [np.inf]
    if len(ends) == 2:
        levels = np.linspace(ends[0][1], ends[1][1], problem.front).tolist()
    for k, level in enumerate(levels):
        if 0 < k < len(levels) - 1:
            begin = found.points[archive.best(0, level, free)]
            yield from _search(archive, begin, first, 0, level)
        chosen = yield from _checked(archive, level, free)
        if later > 0:
            begin, shift = chosen.point, chosen.shift
            yield from _search(archive, begin, later, 0, level, shift, _LATER_STEP)
            again = yield from _checked(archive, level, shift)
            chosen = min((chosen, again), key=lambda one: _turn(archive, one))
        known = [problem.start, *(each.point for each in found.chosen)]
        if not any(np.allclose(chosen.point, each, atol=_SAME) for each in known):
            found.chosen.append(chosen)
    for chosen in found.chosen:
        for k, value in enumerate(problem.start):
            point = chosen.point.copy()
            point[k] = value
            chosen.without.append((yield from archive.at(point)))
    return found


def _search(
    archive: _Archive, start: Array, designs: int, which: int, level: float = np.inf,
    shift: Array | None = None, step: float = _FIRST_STEP,
) -> Generator[Wanted, Values, int]:  # fmt: skip
    """A search from a design; the place of the best one known."""
    shift = np.zeros(len(archive.problem.bounds)) if shift is None else shift
    search = _Search(start, designs, step)
    try:
        while (point := search.next()) is not None:
            one = yield from archive.at(point)
            search.tell(*archive.value(one, which, level, shift))
    finally:
        search.stop()
    return archive.best(which, level, shift)


def _checked(archive: _Archive, level: float, shift: Array) -> Generator[Wanted, Values, Chosen]:
    """The best design of a level, with what more samples say of it."""
    place = archive.best(0, level, shift)
    point, few = archive.found.points[place], archive.found.judged[place]
    many = judged(archive.problem, (yield Wanted(CHECK, point)), many=True)
    apart = np.nan_to_num(many.beyond - few.beyond)
    return Chosen(point, level, few, many, apart)


def _turn(archive: _Archive, one: Chosen) -> tuple[float, float]:
    """The order of designs by what many samples say: how far beyond, then how good."""
    value, beyond = archive.value(one.check, 0, np.inf, np.zeros(len(one.shift)))
    return max(0.0, float(beyond.max())), value


# What was found, as tables.


def front_tables(found: "xr.Dataset") -> list[Table]:
    """What an optimisation found (the dataset of its front): designs, and what variables buy."""
    return [_designs(found), *_bought(found)]


def _in_units(values: Array, units: str) -> tuple[Array, str]:
    known = values[np.isfinite(values)]
    factor, told = readable(units, float(np.abs(known).max()) if len(known) else 0.0)
    return factor * values, f" ({unit_text(told)})" if unit_text(told) else ""


def _designs(found: "xr.Dataset") -> Table:
    """A column a design: values, then what the fresh samples say."""
    names = [str(name) for name in found["design"].values]
    rows = []
    for k, variable in enumerate(found["variable"].values):
        values, unit = _in_units(
            found["value"].values[:, k], str(found["variable_units"].values[k])
        )
        rows.append((f"{variable}{unit}", *(number_text(v, 4) for v in values)))
    for k, objective in enumerate(found["objective"].values):
        units = str(found["objective_units"].values[k])
        middle, low, high = (
            found[f"objective_{end}"].values[:, k] for end in ("value", "lower", "upper")
        )
        factor, told = readable(units, float(np.nanmax(np.abs(middle), initial=0.0)))
        unit = f" ({unit_text(told)})" if unit_text(told) else ""
        rows.append((f"{objective}{unit}", *(number_text(factor * v, 4) for v in middle)))
        rows.append(("  95 %", *(
            interval_text(factor * a, factor * b) for a, b in zip(low, high, strict=True)
        )))  # fmt: skip
    for k, words in enumerate(found["requirement_text"].values):
        share, verdict = found["probability"].values[:, k], found["verdict"].values[:, k]
        rows.append((f"{words}: share that meets it", *(number_text(v, 4) for v in share)))
        rows.append(("  verdict", *(Verdict(int(v)).words for v in verdict)))
    count = int(found.attrs["verdict_samples"])
    notes = [
        f"statistics, shares and verdicts are of {count} fresh samples of each design, which have "
        f"chosen none; {found.attrs['designs']} designs were tried with {found.attrs['samples']} "
        "samples each",
    ]
    if found.sizes["design"] == 1:
        notes.append("the present design is the best one found")
    short = {n: int(v) for n, v in zip(names, found["short"].values, strict=True) if v}
    if short:
        told = ", ".join(f"{v} of {n}" for n, v in short.items())
        notes.append(f"failed, or ended before their goal, and not in the statistics: {told}")
    at_edge = _at_bounds(found)
    if at_edge:
        notes.append(f"at a bound, beyond which there may be better ones: {', '.join(at_edge)}")
    return Table(("", *names), rows, notes)


def _at_bounds(found: "xr.Dataset") -> list[str]:
    """Variables that some chosen design has at an end of their range."""
    low, high = found["low"].values, found["high"].values
    values = found["value"].values[1:]
    near = 0.01 * (high - low)
    lowest, highest = (values <= low + near).any(axis=0), (values >= high - near).any(axis=0)
    return [
        f"{name} ({' and '.join(['low'] * int(a) + ['high'] * int(b))})"
        for name, a, b in zip(found["variable"].values, lowest, highest, strict=True) if a or b
    ]  # fmt: skip


def _bought(found: "xr.Dataset") -> list[Table]:
    """For each chosen design what it loses with one variable as it is at present."""
    tables = []
    objectives, bounds = ([str(v) for v in found[n].values] for n in ("objective", "bound"))
    for k, name in enumerate(found["design"].values[1:], start=1):
        rows = []
        for j, variable in enumerate(found["variable"].values):
            cells = []
            for i in range(len(objectives)):
                units = str(found["objective_units"].values[i])
                change = float(found["without"][k, j, i] - found["searched"][k, i])
                factor, told = readable(units, abs(float(found["searched"][k, i])))
                cells.append(f"{factor * change:+.3g} {unit_text(told)}".rstrip())
            worst = [float(v) for v in found["without_beyond"].values[k, j]]
            broken = [b for b, v in zip(bounds, worst, strict=True) if v > 0.0]
            rows.append((str(variable), *cells, ", ".join(broken) or "-"))
        head = (
            f"{name} with the present", *(f"change of {each}" for each in objectives),
            "no longer kept to",
        )  # fmt: skip
        notes = ["by the few samples of the search, the same in all designs"]
        tables.append(Table(head, rows, notes))
    return tables
