"""Subset simulation: the levels of a rare event, as far as results are known.

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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
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
    probability, squares, anew, before = 1.0, 0.0, _FIRST, -np.inf
    for level in range(most + 1):
        found.states.append(response)
        # The highest response outside the share, and those that equal it stay outside.  With the
        # lowest inside, as in most texts, each level adds a share of 1 / (chains - 1) on average.
        bound = float(np.sort(response)[-chains - 1])
        beyond = response > target
        last = beyond.sum() > chains or level == most
        inside = beyond if last else response > bound
        if not last and bound == -np.inf:
            return  # too few samples tell anything
        if not last and not inside.any():  # all of the best are equal: they go on together
            bound = float(np.max(response, where=response < bound, initial=before))
            inside = response > bound
        probability *= float(inside.mean())
        squares += variance_of_level(inside, chains if level else samples)
        if last:
            found.probability, found.variation = probability, float(np.sqrt(squares))
            return
        found.thresholds.append(bound)
        found.shares.append(probability)
        found.squares.append(squares)
        before = bound
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
