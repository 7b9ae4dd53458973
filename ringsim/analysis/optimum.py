"""Which design is best: a search by few evaluations, under requirements that have a probability.

Designs are points x of the unit box, f are statistics that are made small and g <= 0 what is
required.  All designs are judged by the same few samples of what is uncertain (common random
numbers), so that f and g are nearly smooth functions of x:

    min f_1(x)   subject to   f_2(x) <= level,   g(x) <= 0

first by COBYQA, which interpolates f and g by quadratics in a trust region (Ragonneau, thesis, Hong
Kong 2022; in scipy), then by steps to the best place near the best known design on smooth surfaces
through all that is known (cubic radial functions: Regis, Eng. Optim. 46 (2014) 218).  Several
levels give the front of two objectives (Haimes, Lasdon and Wismer, IEEE Trans. SMC-1, 1971).  That
P(y <= b) >= p is steered by

    g(x) = mean(y) + z_a sd(y) - b

with a beyond p by as much as it takes to show p by the samples of the verdict.  What few samples
and a normal law get wrong is the shift, by which statistics of many fresh samples of a design
differ from those of its few (Du and Chen, J. Mech. Design 126 (2004) 225).  Interpolated between
designs that were checked, it corrects f and g.  Rounds go on until a check says what was foretold.
"""

import queue
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy

from ringsim.analysis.intervals import quantities, share_bounds
from ringsim.analysis.requirements import Requirement
from ringsim.stepping.instant import Array
from ringsim.tables import with_unit

Without = tuple[int, int] | None  # the number of a chosen design, and its variable as at present
SEARCH, CHECK, VERDICT = "search", "check", "verdict"
"""Which samples a design is run with: few, the same for all; more; and fresh ones."""
_FIRST_STEP, _LATER_STEP, _LAST_STEP = 0.25, 0.1, 0.005
"""Sizes of a trust region in the unit box: at the begin, with a shift, and where a search ends."""
_SHARE_LATER = 0.5
"""Of all designs, those that are left for rounds with a shift."""
_ROUNDS = 6
"""Of each level, at most: a check has many samples."""
_LIKELY = 0.8
"""Probability with which a design that reaches what is aimed at is shown to meet a requirement."""
_FAR = 0.05
"""Of the present value: a design that is worse by more gives way to one that is hardly beyond."""
DIGITS = 6
"""Points are rounded to so many digits, so that the last bits of a library choose no design."""
_SAME = 1e-3
"""Of the range of a variable: closer designs are one."""
_TINY = 1e-12
_PENALTY = 1.0
"""Of a statistic that has no sample, beyond the worst known, over its scale."""
_SLACK = 100.0
"""What a unit beyond a bound costs on a surface, in units of the objective."""
_SURE = 8.0
"""Standard deviations: rarer violations are not told apart."""

Values = Mapping[str, Array]
"""By output of each sample of a design, shape (samples,); NaN where a run failed or ended before
its goal."""


@dataclass(frozen=True)
class Objective:
    """A statistic that is made small, or large."""

    output: str
    statistic: Literal["mean", "quantile", "probability"] = "mean"
    probability: float = 0.5
    """Below the quantile."""
    sign: float = 1.0
    """1 to make it small, -1 to make it large."""
    bound: float = 0.0
    """Beyond which a value counts, of a probability."""
    side: float = 1.0
    """1 if larger values count, -1 if smaller ones do."""

    @property
    def told(self) -> str:
        """Its name in tables."""
        if self.statistic == "probability":
            limit = with_unit(f"{self.bound:g}", quantities()[self.output].units)
            return f"probability of {self.output} {'>' if self.side > 0 else '<'} {limit}"
        what = "mean" if self.statistic == "mean" else f"{self.probability:g} quantile"
        return f"{self.output} ({what})"

    @property
    def units(self) -> str:
        """Of the statistic."""
        return "1" if self.statistic == "probability" else quantities()[self.output].units

    def beyond(self, values: Array) -> Array:
        """Whether each value is one whose probability is meant."""
        return np.asarray(self.side * (values - self.bound) > 0.0)

    def shown(self, steered: Any) -> Any:
        """The statistic itself."""
        return scipy.special.ndtr(steered) if self.statistic == "probability" else (
            self.sign * np.asarray(steered))  # fmt: skip

    def steered(self, values: Array, *, many: bool = False) -> Array:
        """What is made small, of known values along the last axis.

        A quantile is told by the order of the samples as far as they reach, else by a normal law.
        A probability is told as a normal score, which still falls where no sample is beyond: by a
        normal law, or by the share of many samples.
        """
        count = values.shape[-1]
        middle, spread = values.mean(axis=-1), _spread(values)
        if self.statistic == "quantile":
            p = self.probability
            inside = min(p, 1.0 - p) * count >= 1.0
            middle = (np.quantile(values, p, axis=-1, method="hazen") if inside
                      else middle + scipy.special.ndtri(p) * spread)  # fmt: skip
        elif self.statistic == "probability":
            score = self.side * (middle - self.bound) / np.maximum(spread, _TINY)
            middle = np.clip(score, -_SURE, _SURE)
            if many:
                share, rare = self.beyond(values).mean(axis=-1), scipy.special.ndtri(0.5 / count)
                known = scipy.special.ndtri(np.clip(share, 0.5 / count, 1.0 - 0.5 / count))
                # Where none or all are beyond, it is rarer than half a sample.
                middle = np.where(share <= 0.0, np.minimum(middle, rare), np.where(
                    share >= 1.0, np.maximum(middle, -rare), known
                ))  # fmt: skip
        return np.asarray(self.sign * middle)


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


def _spread(values: Array) -> Array:
    if values.shape[-1] < 2:
        return np.zeros(values.shape[:-1])
    return np.asarray(values.std(axis=-1, ddof=1))


class Judged(NamedTuple):
    """What some samples say of a design."""

    objectives: Array
    """Statistics, to be made small, shape (objectives,); NaN without a sample."""
    beyond: Array
    """How far the quantiles aimed at lie beyond the bounds, shape (bounds,); NaN likewise."""
    lost: float
    """Share of samples that failed, ended before their goal or have no value."""
    errors: Array
    """Standard errors of both, one after the other; of few samples nothing."""

    @property
    def parts(self) -> Array:
        """Objectives, then what is beyond."""
        return np.concatenate([self.objectives, self.beyond])


def judged(problem: Problem, values: Values, *, many: bool = False) -> Judged:
    """Statistics of a design.  ``many`` samples also tell the quantiles of bounds by their order:
    the worse one of both counts, as far out as they reach.  Their errors are by the bootstrap.
    """
    known = np.isfinite(np.array(list(values.values()))).all(axis=0)
    lost, count = 1.0 - float(known.mean()), int(known.sum())
    first, size = len(problem.objectives), len(problem.objectives) + len(problem.bounds)
    if not count:
        none = np.full(size, np.nan)
        return Judged(none[:first], none[first:], lost, none)
    good = {name: own[known] for name, own in values.items()}

    def statistics(taken: Any) -> Array:
        found = [each.steered(good[each.output][taken], many=many) for each in problem.objectives]
        for name, sign, bound, aim in problem.bounds:
            own = sign * (good[name][taken] - bound)
            far = own.mean(axis=-1) + scipy.special.ndtri(aim) * _spread(own)
            if many:
                reach = min(aim, 1.0 - 0.5 / count)
                far = np.maximum(far, np.quantile(own, reach, axis=-1, method="hazen"))
            found.append(far)
        return np.array(found)

    parts, errors = statistics(slice(None)), np.zeros(0)
    if many:
        again = max(20, min(200, 1_000_000 // count))
        picked = np.random.default_rng(0).integers(0, count, (again, count))
        errors = statistics(picked).std(axis=-1)
    return Judged(parts[:first], parts[first:], lost, errors)


class Wanted(NamedTuple):
    """A design to be run, with which samples."""

    samples: str
    """SEARCH, CHECK or VERDICT."""
    point: Array
    best: Array | None = None
    """Objectives of the best design so far; none before the first."""
    without: Without = None


@dataclass
class Chosen:
    """A design that was chosen."""

    place: int
    """Among the tried ones."""
    without: list[Judged] = field(default_factory=list)
    """By variable: the same design but for that variable, which is the present one's."""


@dataclass
class Found:
    """All that the search has found."""

    points: list[Array] = field(default_factory=list)
    judged: list[Judged] = field(default_factory=list)
    checks: dict[int, Judged] = field(default_factory=dict)
    """What many samples say, by the place of a design; the present one is the first."""
    corrected: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """Statistics of all designs by few samples and the shift, shape (designs, parts)."""
    searched: int = 0
    """The first of them, which the search has tried; others show what variables buy."""
    chosen: list[Chosen] = field(default_factory=list)
    """By level, from that which is best in the first objective; not the present one."""


Course = Generator[Wanted, Values, Found]
"""What is to be run next, given the values of what was; at the end what was found."""


class _StoppedError(Exception):
    """Nobody waits for the search any more."""


class _Search:
    """COBYQA in a thread of its own, which waits wherever it wants to know a design."""

    def __init__(self, start: Array, designs: int) -> None:
        self._asked: queue.Queue[Any] = queue.Queue()
        self._told: queue.Queue[Any] = queue.Queue()
        self._known: dict[bytes, tuple[float, Array]] = {}
        threading.Thread(target=self._run, args=(start, designs), daemon=True).start()

    def next(self) -> Array | None:
        """The design that it wants to know; None at its end."""
        asked = self._asked.get()
        if isinstance(asked, Exception):
            raise asked
        return None if asked is None else np.asarray(asked)

    def tell(self, told: tuple[float, Array] | None) -> None:
        """What it wants to make small there, and what shall be at most 0; None lets it end."""
        self._told.put(told)

    def _at(self, point: Array) -> tuple[float, Array]:
        point = np.asarray(np.round(np.clip(point, 0.0, 1.0), DIGITS), dtype=np.float64)
        key = point.tobytes()
        if key not in self._known:
            self._asked.put(point)
            if (told := self._told.get()) is None:
                raise _StoppedError
            self._known[key] = told
        return self._known[key]

    def _run(self, start: Array, designs: int) -> None:
        try:
            scipy.optimize.minimize(
                lambda x: self._at(x)[0], start, method="COBYQA",
                bounds=scipy.optimize.Bounds(np.zeros(len(start)), np.ones(len(start))),
                constraints=scipy.optimize.NonlinearConstraint(
                    lambda x: self._at(x)[1], -np.inf, 0.0
                ),
                options={"maxfev": designs, "initial_tr_radius": _FIRST_STEP,
                         "final_tr_radius": _LAST_STEP},
            )  # fmt: skip
            self._asked.put(None)
        except _StoppedError:
            return
        except Exception as error:  # it is raised again where the search is waited for
            self._asked.put(error)


class Archive:
    """All designs with what samples say of them."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.found = problem, Found()
        self._places: dict[bytes, int] = {}
        self.scales: Array = np.ones(0, dtype=np.float64)
        """Of the objectives, then of the bounds."""

    def at(self, point: Array, without: Without = None) -> Generator[Wanted, Values, int]:
        """The place of a design, after a run if it has none."""
        found, point = self.found, np.round(point, DIGITS)
        if (place := self._places.get(point.tobytes())) is None:
            values = yield Wanted(SEARCH, point, self._best_so_far(), without)
            place = self._places[point.tobytes()] = len(found.points)
            found.points.append(point)
            found.judged.append(judged(self.problem, values))
        if not len(self.scales):
            self._scale(found.judged[place])
        return place

    def check(self, place: int) -> Generator[Wanted, Values, bool]:
        """See what many samples say of a design: whether it is what was foretold."""
        foretold = self.estimates()[1][place]
        values = yield Wanted(CHECK, self.found.points[place], self._best_so_far())
        told = self.found.checks[place] = judged(self.problem, values, many=True)
        return bool((np.abs(told.parts - foretold) <= told.errors + _TINY).all())

    def _best_so_far(self) -> Array | None:
        aims = len(self.problem.objectives)
        return self.estimates()[1][self.best(0), :aims] if self.found.points else None

    def _scale(self, first: Judged) -> None:
        sizes = np.zeros(len(first.parts))
        sizes[len(first.objectives) :] = [abs(bound) for _, _, bound, _ in self.problem.bounds]
        own = np.fmax(np.abs(first.parts), sizes)
        self.scales = np.array(np.where(np.isfinite(own) & (own > _TINY), own, 1.0), np.float64)

    def estimates(self) -> tuple[Array, Array]:
        """Of each design the share of lost samples, shape (designs,), and its statistics: of few
        samples, and the shift of the checked ones, of each the more the nearer it is.
        """
        found = self.found
        lost = np.array([one.lost for one in found.judged])
        parts = np.array([one.parts for one in found.judged])
        if found.checks:
            places = list(found.checks)
            shift = np.array([found.checks[k].parts - parts[k] for k in places])
            more = np.array([found.checks[k].lost - lost[k] for k in places])
            points = np.array(found.points)
            square = ((points[:, None] - points[places]) ** 2).sum(axis=-1)
            weight = 1.0 / (square + _TINY)
            weight /= weight.sum(axis=1, keepdims=True)
            parts = parts + weight @ np.nan_to_num(shift)
            # Shares of failures are compared as they are: what is between two tells nothing.
            lost = np.round(np.clip(lost + more[square.argmin(axis=1)], 0.0, 1.0), DIGITS)
        return lost, parts

    def _split(self, parts: Array, which: int, level: float) -> tuple[Array, Array]:
        """The objective, and what shall be at most 0, of statistics along the last axis."""
        first, other = len(self.problem.objectives), 1 - which
        beyond = parts[..., first:]
        if np.isfinite(level):
            beyond = np.concatenate([beyond, parts[..., [other]] - level], axis=-1)
        return parts[..., which], beyond

    def _scales(self, which: int, level: float) -> tuple[float, Array]:
        value, beyond = self._split(self.scales, which, 0.0 if np.isfinite(level) else np.inf)
        return float(value), beyond

    def told(self, which: int, level: float) -> tuple[Array, Array]:
        """Of each design what a search makes small, and what shall be at most 0, without units;
        share of lost samples beyond the least known is among it.
        """
        lost, parts = self.estimates()
        value, beyond = self._split(parts, which, level)
        scale, scales = self._scales(which, level)
        every = np.column_stack([value / scale, beyond / scales])
        known = np.isfinite(every).all(axis=1)
        if not known.all():
            worst = every[known].max(axis=0) if known.any() else np.zeros(every.shape[1])
            every[~known] = worst + _PENALTY
        return every[:, 0], np.column_stack([every[:, 1:], lost - lost.min()])

    def best(self, which: int, level: float = np.inf) -> int:
        """The best design known: by the share of lost samples, then by how far it is beyond, then
        by the objective.
        """
        value, beyond = self.told(which, level)
        far = beyond[:, :-1].max(axis=1, initial=0.0)
        return int(np.lexsort((value, np.where(far > _TINY, far, 0.0), beyond[:, -1]))[0])

    def choice(self, which: int, level: float = np.inf) -> int:
        """The best of the checked designs, by their checks.

        That is the best of those that keep to all bounds.  One that is beyond by less than the
        standard error of that estimate counts, too, if none keeps to all, or if it is better than
        the best of those by more than ``_FAR`` of the present value.
        """
        places = np.array(list(self.found.checks))
        every = [self.found.checks[k] for k in places]
        lost = np.array([one.lost for one in every])
        value, beyond = self._split(np.array([one.parts for one in every]), which, level)
        errors = self._split(np.array([one.errors for one in every]), which, 0.0 * level)[1]
        scale, scales = self._scales(which, level)
        value, beyond = (np.where(np.isnan(v), np.inf, v) for v in (value / scale, beyond))
        least = lost <= lost.min() + _TINY
        keeps = least & (beyond <= _TINY * scales).all(axis=1)
        nearly = least & (beyond <= np.nan_to_num(errors) + _TINY * scales).all(axis=1)
        if not nearly.any():
            far = (beyond / scales).max(axis=1, initial=0.0)
            return int(places[np.lexsort((value, far, lost))[0]])
        rival = int(np.argmin(np.where(nearly, value, np.inf)))
        if not keeps.any():
            return int(places[rival])
        best = int(np.argmin(np.where(keeps, value, np.inf)))
        return int(places[rival if value[rival] < value[best] - _FAR else best])

    def proposed(self, which: int, level: float, centre: Array, radius: float) -> Array:
        """The best place near a design, on smooth surfaces through all that is known."""
        value, beyond = self.told(which, level)
        surface = _surface(np.array(self.found.points), np.column_stack([value, beyond]))
        count = len(centre)
        # A slack that costs much lets it come back from beyond a bound.
        ends = [*zip(np.maximum(centre - radius, 0.0), np.minimum(centre + radius, 1.0),
                     strict=True), (0.0, None)]  # fmt: skip
        begin = np.append(centre, max(0.0, float(surface(centre)[0][1:].max())))
        cost = np.append(np.zeros(count), _SLACK)
        found = scipy.optimize.minimize(
            lambda x: float(surface(x[:count])[0][0] + cost @ x), begin, method="SLSQP",
            jac=lambda x: np.append(surface(x[:count])[1][:, 0], 0.0) + cost, bounds=ends,
            constraints={
                "type": "ineq",
                "fun": lambda x: x[count] - surface(x[:count])[0][1:],
                "jac": lambda x: np.column_stack([
                    -surface(x[:count])[1][:, 1:].T, np.ones(beyond.shape[1])
                ]),
            },
            options={"maxiter": 100},
        )  # fmt: skip
        point = np.where(np.isfinite(found.x[:count]), found.x[:count], centre)
        return np.round(np.clip(point, [low for low, _ in ends[:-1]],
                                [float(high or 0.0) for _, high in ends[:-1]]), DIGITS)  # fmt: skip


def _surface(points: Array, values: Array) -> Callable[[Array], tuple[Array, Array]]:
    """Surfaces through values, shape (points, surfaces), of a plane and the cubes of distances: at
    a point their heights and slopes, shapes (surfaces,) and (variables, surfaces).
    """
    count, size = points.shape
    apart = np.linalg.norm(points[:, None] - points, axis=-1) ** 3
    plane = np.column_stack([np.ones(count), points])
    matrix = np.block([[apart, plane], [plane.T, np.zeros((size + 1, size + 1))]])
    right = np.concatenate([values, np.zeros((size + 1, values.shape[1]))])
    weight = np.linalg.lstsq(matrix, right)[0]

    def at(x: Array) -> tuple[Array, Array]:
        away = x - points
        far = np.linalg.norm(away, axis=1)
        height = far**3 @ weight[:count] + weight[count] + x @ weight[count + 1 :]
        return height, 3.0 * (far[:, None] * away).T @ weight[:count] + weight[count + 1 :]

    return at


def course(problem: Problem) -> Course:
    """The whole search: yields the designs to be run, and returns what was found.

    It ends at once if no sample of the present design has a value.
    """
    archive = Archive(problem)
    found, start = archive.found, problem.start
    yield from archive.at(start)
    if not np.isfinite(found.judged[0].parts).all():
        return found
    yield from archive.check(0)
    each = (problem.designs - 1) // problem.front  # the present one is of them
    later = int(_SHARE_LATER * each)
    for which in range(len(problem.objectives)):
        yield from _search(archive, each - later, which)
        yield from _rounds(archive, which, np.inf, later)
    levels = [np.inf]
    if len(problem.objectives) > 1:
        ends = np.array([found.checks[archive.choice(k)].objectives[1] for k in (0, 1)])
        # Scores of probabilities: what lies farther out cannot be told apart.
        far = 3.0 if problem.objectives[1].statistic == "probability" else np.inf
        low, high = (float(end) for end in np.clip(ends, -far, far))
        near = np.linspace(low, high, problem.front).tolist()
        levels = [float(ends[0]), *near[1:-1], float(ends[1])]
    for level in levels[1:-1]:
        yield from _rounds(archive, 0, level, each)
    places = list(dict.fromkeys(archive.choice(0, level) for level in levels))
    found.searched = len(found.points)
    found.chosen = [Chosen(k) for k in places if k and not _is_dominated(found, k, places)]
    for number, chosen in enumerate(found.chosen):
        for k, value in enumerate(start):
            point = np.where(np.arange(len(start)) == k, value, found.points[chosen.place])
            chosen.without.append(found.judged[(yield from archive.at(point, (number, k)))])
    found.corrected = archive.estimates()[1]
    return found


def _search(archive: Archive, designs: int, which: int) -> Generator[Wanted, Values, None]:
    """A search by COBYQA from the best design known."""
    search = _Search(archive.found.points[archive.best(which)], designs)
    try:
        while (point := search.next()) is not None:
            place = yield from archive.at(point)
            value, beyond = archive.told(which, np.inf)
            search.tell((float(value[place]), beyond[place]))
    finally:
        search.tell(None)


def _rounds(
    archive: Archive, which: int, level: float, designs: int
) -> Generator[Wanted, Values, None]:
    """Check the best design and search on from the best known, until a search comes to its end and
    the check of what it found says what was foretold, and no bound is broken; with so many designs
    at most.
    """
    ended = False
    for _ in range(_ROUNDS):
        place, agrees = archive.best(which, level), True
        if place not in archive.found.checks:
            agrees = yield from archive.check(place)
            agrees &= bool((archive.told(which, level)[1][place, :-1] <= _TINY).all())
        if designs <= 0 or (agrees and ended):
            return
        before = len(archive.found.points)
        most = min(designs, max(len(archive.problem.start) + 1, designs // 2))
        ended = yield from _steps(archive, which, level, most)
        designs -= max(1, len(archive.found.points) - before)


def _steps(
    archive: Archive, which: int, level: float, designs: int
) -> Generator[Wanted, Values, bool]:
    """Steps on smooth surfaces, so many at most; whether they have come to an end."""
    radius, points = _LATER_STEP, archive.found.points
    while radius >= _LAST_STEP:
        place = archive.best(which, level)
        point = archive.proposed(which, level, points[place], radius)
        known = np.abs(np.array(points) - point).max(axis=1).min() < _SAME
        if not known:
            if designs <= 0:
                return False
            designs -= 1
            yield from archive.at(point)
        if known or archive.best(which, level) == place:
            radius *= 0.5
        elif np.abs(point - points[place]).max() > 0.9 * radius:
            radius = min(2.0 * radius, _FIRST_STEP)
    return True


def _is_dominated(found: Found, place: int, places: Sequence[int]) -> bool:
    """Whether another design is better in one objective and worse in nothing, by the checks."""
    mine = found.checks[place]
    return any(
        one.lost <= mine.lost
        and bool((np.maximum(one.beyond, 0.0) <= np.maximum(mine.beyond, 0.0)).all())
        and bool((one.objectives <= mine.objectives).all())
        and bool((one.objectives < mine.objectives).any())
        for one in (found.checks[k] for k in {0, *places} - {place})
    )
