"""Subset simulation of rare events: its design, and its levels as far as results are known.

Each level holds samples beyond a threshold that a given share of those before have passed; from
these few, chains of candidates start.  A candidate keeps a part of its parent in standard normal
space and draws the rest anew, so that it is distributed as the inputs are; the chain moves there
if it is beyond the threshold, else it stays.
Sources: Au and Beck, Probabilistic Engineering Mechanics 16 (2001), levels and coefficient of
variation; Papaioannou, Betz, Zwirglmaier and Straub, ibid. 41 (2015), conditional sampling;
Brehier, Gazeau, Goudenege, Lelievre and Rousset, Annals of Applied Probability 26 (2016), where
thresholds must lie for the mean of the probability to be exact.
"""

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr, model_validator

from ringsim.outputs import VARIABLES
from ringsim.outputs.balance import instead_of
from ringsim.refusal import known_or_nearest
from ringsim.sampling.designs import Design, Factors
from ringsim.sampling.distributions import Array, inside
from ringsim.variables import OF_CAMPAIGNS

# Levels.


Numbers = NDArray[np.int64]
_WISHED = 0.44
"""Share of candidates that move a chain, for which chains forget fastest (Papaioannou 2015)."""
_FIRST = 0.6
"""Part that candidates of the first chains draw anew, as a standard deviation."""


class Batch(NamedTuple):
    """Samples that can run at the same time."""

    parents: Numbers
    """Sample whose point each one keeps a part of; -1 for none."""
    anew: float
    """Standard deviation of what is drawn anew; 1 for all of it."""
    level: int


class Answer(NamedTuple):
    """Their numbers and responses, the larger the nearer to the event."""

    numbers: Numbers
    responses: Array


@dataclass
class Repetition:
    """What one subset simulation gave."""

    probability: float = np.nan
    """NaN until it has ended, or if too few samples have a response."""
    variation: float = np.nan
    """Coefficient of variation by the correlation within chains; too small if levels depend."""
    thresholds: list[float] = field(default_factory=list)
    """Of the levels passed."""
    shares: list[float] = field(default_factory=list)
    """Probability of a response beyond each of them."""
    squares: list[float] = field(default_factory=list)
    """Of these probabilities the squares of their coefficients of variation, as ``variation``."""
    chains: int = 0
    """Of every level but the first, whose samples are independent."""
    states: list[Array] = field(default_factory=list)
    """Responses of every level, the first without a threshold; those of a chain may be equal."""

    @property
    def reached(self) -> float:
        """The response from which a further level would start: the farthest whose probability is
        known as well as that of any level.
        """
        bound = float(np.sort(self.states[-1])[-self.chains - 1])
        told = bound > -np.inf and (self.states[-1] > bound).any()
        return bound if told or not self.thresholds else self.thresholds[-1]

    def beyond(self, response: float) -> tuple[float, float]:
        """Probability of a response beyond this one, and its coefficient of variation, as
        ``variation``; NaN if there is none yet.
        """
        if np.isnan(self.probability):
            return np.nan, np.nan
        passed = int(np.searchsorted(self.thresholds, response, side="right"))
        before, square = (self.shares[passed - 1], self.squares[passed - 1]) if passed else (1, 0)
        inside = self.states[passed] > response
        square += variance_of_level(inside, self.chains if passed else len(inside))
        return before * float(inside.mean()), float(np.sqrt(square))


@dataclass
class Levels:
    """All samples that the known responses determine."""

    parents: Numbers
    anew: Array
    level: Numbers
    replicate: Numbers
    """Shape (samples,) each."""
    batches: list[slice]
    """Samples of each batch of each repetition, in order."""
    repetitions: list[Repetition]
    ended: bool
    """Whether nothing is left to run."""


def levels(
    responses: Array, samples: int, share: float, replicates: int, target: float, most: int
) -> Levels:
    """Samples of independent simulations, whose batches run side by side.

    ``responses`` of the first samples are known; an event is a response above ``target``.
    ``samples`` are those of a level, a ``share`` of which passes to the next, at most ``most``.
    """
    found = [Repetition() for _ in range(replicates)]
    running = {k: simulation_of(found[k], samples, share, target, most) for k in range(replicates)}
    waiting = {k: next(each) for k, each in running.items()}
    parents, anew, level, replicate, batches = [], [], [], [], list[slice]()
    begin, ended = 0, False
    while True:
        first, numbers = begin, dict[int, Numbers]()
        for k, batch in waiting.items():
            count = len(batch.parents)
            numbers[k], begin = np.arange(begin, begin + count), begin + count
            batches.append(slice(begin - count, begin))
            parents.append(batch.parents)
            anew.append(np.full(count, batch.anew))
            level.append(np.full(count, batch.level))
            replicate.append(np.full(count, k))
        ended = first == begin
        if ended or begin > len(responses):
            break
        asked, waiting = waiting, {}
        for k in asked:
            try:
                waiting[k] = running[k].send(Answer(numbers[k], responses[numbers[k]]))
            except StopIteration:
                continue
    of_parents, of_level, of_replicate = (
        np.concatenate(each).astype(np.int64) for each in (parents, level, replicate)
    )
    return Levels(of_parents, np.concatenate(anew), of_level, of_replicate, batches, found, ended)


def simulation_of(
    found: Repetition, samples: int, share: float, target: float, most: int
) -> Generator[Batch, Answer, None]:
    """One simulation, which asks for batches and is sent their responses."""
    length = round(1.0 / share)
    chains = found.chains = samples // length
    here, response = yield Batch(np.full(samples, -1), 1.0, 0)
    probability, squares, anew = 1.0, 0.0, _FIRST
    for level in range(most + 1):
        found.states.append(response)
        # The highest response outside the share, and those that equal it stay outside.  With the
        # lowest inside, as in most texts, each level adds a share of 1 / (chains - 1) on average.
        bound = float(np.sort(response)[-chains - 1])
        beyond = response > target
        last = beyond.sum() > chains or level == most
        if not last and bound == -np.inf:
            return  # too few samples tell anything
        # Where all of the best are equal nothing lies beyond, and the estimate is 0 (Brehier 2016):
        # to go on below until something does would count every attempt.
        last = last or not (response > bound).any()
        inside = beyond if last else response > bound
        probability *= float(inside.mean())
        squares += variance_of_level(inside, chains if level else samples)
        if last:
            found.probability, found.variation = probability, float(np.sqrt(squares))
            return
        found.thresholds.append(bound)
        found.shares.append(probability)
        found.squares.append(squares)
        seeds = np.resize(np.flatnonzero(inside), chains)
        states, values = here[seeds], response[seeds]
        course, heights = [states], [values]
        for step in range(1, length):
            numbers, candidates = yield Batch(states, anew, level + 1)
            moved = candidates > bound
            states, values = np.where(moved, numbers, states), np.where(moved, candidates, values)
            course.append(states)
            heights.append(values)
            anew = min(1.0, anew * float(np.exp((moved.mean() - _WISHED) / np.sqrt(step))))
        here, response = np.concatenate(course), np.concatenate(heights)


def variance_of_level(inside: NDArray[np.bool_], chains: int) -> float:
    """Square of the coefficient of variation of a level's share; infinite if nothing is inside.

    ``inside`` are the states of all ``chains``, step after step; Au and Beck (2001), eqs. 27 to 29.
    """
    share, count = float(inside.mean()), len(inside)
    if share == 0.0:
        return np.inf
    steps = inside.reshape(-1, chains).astype(float)
    variance, factor = share * (1.0 - share), 0.0
    for lag in range(1, len(steps)) if variance else ():
        together = float((steps[:-lag] * steps[lag:]).mean()) - share**2
        factor += 2.0 * (1.0 - lag / len(steps)) * together / variance
    return (1.0 - share) / (share * count) * (1.0 + max(factor, 0.0))


# The design.


class SubsetSimulation(Design):
    """Samples that approach a rare event level by level, as above.

    The design grows with its results: which samples come next depends on those before, and on
    nothing else, neither on the number of workers nor on interruptions.
    """

    population: ClassVar[bool] = False
    grows: ClassVar[bool] = True

    kind: Literal["subset-simulation"] = "subset-simulation"
    of: str
    """Output that tells how near the event is."""
    above: float | None = None
    """The event: the output is above this value, in its unit; or it has none, as for an antenna
    that never deploys."""
    below: float | None = None
    """The same for an output below a value."""
    samples: Annotated[int, Field(ge=20, le=1_000_000)] = 500
    """Samples of a level, in each replicate."""
    share: Annotated[float, Field(ge=0.05, le=0.5)] = 0.1
    """Share of them that passes to the next level: one over a whole number."""
    replicates: Annotated[int, Field(ge=1, le=1000)] = 4
    """Independent simulations: their scatter tells how certain the probability is."""
    most_levels: Annotated[int, Field(ge=1, le=30)] = 8
    """Levels after which nothing rarer is looked for."""
    check: Annotated[int, Field(ge=0)] = 0
    """So many runs at most are repeated with the full model in the end: half of them are those
    outside the event that are nearest to it; the others are in the event, failed, or short of their
    goal, evenly spread over all."""
    _known: Array = PrivateAttr(default_factory=lambda: np.empty(0))

    @model_validator(mode="after")
    def _consistent(self) -> "SubsetSimulation":
        known = [
            n for n, v in VARIABLES.items()
            if not v.dims and v.dtype == "f8" and OF_CAMPAIGNS not in v.needs  # known at the merge
        ]  # fmt: skip
        if self.of in VARIABLES and VARIABLES[self.of].dims:
            sense = "largest" if self.below is None else "least"
            raise ValueError(f"of = {instead_of(self.of, sense)}")
        if self.of not in known:
            raise ValueError(
                f"of = {self.of} is not an output with one number per run "
                f"({known_or_nearest(self.of, known)})"
            )
        if (self.above is None) == (self.below is None):
            raise ValueError("needs either above or below, a value of that output")
        length = round(1.0 / self.share)
        if abs(1.0 / self.share - length) > 1e-6:
            raise ValueError(
                f"share = {self.share:g} must be one over a whole number, as {1 / length:.4g}"
            )
        if left := self.samples % length:
            raise ValueError(
                f"samples = {self.samples} must be a multiple of 1 / share = {length}, for "
                f"example {self.samples - left or length}: all chains have the same length"
            )
        return self

    @property
    def sign(self) -> float:
        """Sign with which the output grows towards the event."""
        return 1.0 if self.below is None else -1.0

    @property
    def target(self) -> float:
        """Response beyond which the event is."""
        bound = self.above if self.above is not None else self.below
        return self.sign * float(bound if bound is not None else np.nan)

    @property
    def most_runs(self) -> int:
        """Runs with all levels, without checks."""
        chains = round(self.samples * self.share)
        return self.replicates * (self.samples + self.most_levels * (self.samples - chains))

    def runs_told(self, runs: int) -> str:
        """How many runs the design has, in words, of so many that are known by now."""
        if self.ended:
            return f"{runs}, all levels completed"
        return f"{runs} so far, at most {self.most_runs}: results decide on further ones"

    def responses(self, values: Array, lost: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Array:
        """Responses of runs by the output, NaN where it has no value, and which runs were lost.

        Lost runs never pass a threshold; those that hold and have no value pass all.
        """
        return np.where(lost, -np.inf, np.where(np.isnan(values), np.inf, self.sign * values))

    def knowing(self, responses: Array) -> "SubsetSimulation":
        """The design with the samples that come after those with known responses."""
        grown = self.model_copy()
        grown._known = responses
        return grown

    @property
    def ended(self) -> bool:
        """Whether no samples come after those with known responses."""
        return self.levels(self._known).ended

    def levels(self, responses: Array) -> Levels:
        """All levels, as far as responses are known."""
        return levels(
            responses, self.samples, self.share, self.replicates, self.target, self.most_levels
        )

    def points(self, factors: Factors, seed: int) -> Array:
        """Each sample from its parent, with random numbers of its own batch."""
        found = self.levels(self._known)
        normal = np.empty((len(found.parents), len(factors)))
        for batch in found.batches:
            # Keys of three numbers: those of fewer are taken by other designs.
            stream = np.random.SeedSequence(seed, spawn_key=(0, 0, batch.start))
            shape = (batch.stop - batch.start, len(factors))
            anew, parents = found.anew[batch, None], found.parents[batch]
            normal[batch] = anew * np.random.default_rng(stream).standard_normal(shape)
            if parents[0] >= 0:
                normal[batch] += np.sqrt(1.0 - anew**2) * normal[parents]
        return inside(scipy.special.ndtr(normal))
