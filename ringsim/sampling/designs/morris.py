"""Trajectories for screening."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.sampling.designs.family import Factors, Samples
from ringsim.sampling.designs.grouped import Grouped
from ringsim.sampling.distributions.family import Array


class Morris(Grouped):
    """Trajectories over a grid of levels: from run to run one group moves, each once, at random.

    N trajectories of g + 1 runs for g groups (N (g + 1) runs in all).  A move crosses half of the
    levels, up or down, each input of a group by itself: of 4 levels, two thirds of a uniform range
    from end to end; unbounded inputs have the middles of intervals of equal probability for
    levels, and discrete ones all their values.
    Source: Morris, Technometrics 33 (1991); groups: Campolongo, Cariboni and Saltelli,
    Environmental Modelling & Software 22 (2007).
    """

    correlated: ClassVar[bool] = False
    population: ClassVar[bool] = False

    kind: Literal["morris"] = "morris"
    samples: Samples
    """Trajectories."""
    levels: Annotated[int, Field(ge=2, le=1000, multiple_of=2)] = 4
    """Levels of each continuous input; a move crosses half of them."""

    def block(self, groups: int) -> int:
        """Runs of a trajectory."""
        return groups + 1

    def runs_told(self, runs: int) -> str:
        """Trajectories by runs of one."""
        groups = runs // self.samples - 1
        return f"{self.samples} trajectories x ({groups} groups + 1) = {runs} runs"

    def points(self, factors: Factors, seed: int) -> Array:
        """Trajectory after trajectory, shape (N (g + 1), factors)."""
        members = list(self.members(factors).values())
        found = np.empty((self.samples, len(members) + 1, len(factors)))
        lines = [each.levels(self.levels) for each in factors.values()]
        for place, (start, end, order) in zip(found, self._moves(factors, seed), strict=True):
            ends = [
                np.array([line[k] for line, k in zip(lines, each, strict=True)])
                for each in (start, end)
            ]
            place[:] = ends[0]
            for row, group in enumerate(order, 1):
                place[row:, members[group]] = ends[1][members[group]]
        return found.reshape(-1, len(factors))

    def rows(self, factors: Factors, seed: int) -> list[str]:
        """``start``, then ``up: GROUP`` or ``down: GROUP``, of groups of many ``moved: GROUP``."""
        members = self.members(factors)
        names, found = list(members), list[str]()
        for start, end, order in self._moves(factors, seed):
            found.append("start")
            for group in order:
                axes = members[names[group]]
                up = "up" if end[axes[0]] >= start[axes[0]] else "down"
                found.append(f"{up if len(axes) == 1 else 'moved'}: {names[group]}")
        return found

    def _moves(
        self, factors: Factors, seed: int
    ) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]]:
        """First and last level of every input, and the order of the groups, by trajectory."""
        groups = len(self.members(factors))
        counts = np.array([len(each.levels(self.levels)) for each in factors.values()])
        step = counts // 2
        for trajectory in range(self.samples):
            # Keys of two numbers, since those of one are the seeds of samples.
            key = np.random.SeedSequence(seed, spawn_key=(1, trajectory))
            stream = np.random.default_rng(key)
            low, up = stream.integers(0, counts - step), stream.random(len(counts)) < 0.5
            order = stream.permutation(groups)
            yield np.where(up, low, low + step), np.where(up, low + step, low), order
