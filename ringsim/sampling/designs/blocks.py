"""Designs that move whole groups of inputs in blocks: Morris and Saltelli."""

import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.choice import kind_of
from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.columns import Correlation, pairs_of
from ringsim.sampling.designs import Design, Factors, Samples
from ringsim.sampling.designs.independent import Replicated, sobol_points
from ringsim.sampling.distributions import Array, Values
from ringsim.units import ListIn

# What designs share that move whole groups of inputs: which input belongs to which group.


MOST_RUNS = 10_000_000
_STRETCH = re.compile(r"(.*)\[(\d{1,6})(?:\.\.(\d{1,6}))?\]", re.DOTALL)


def stretches(places: int, parts: int) -> Iterator[tuple[int, int]]:
    """Where stretches of places of about equal length begin, and where they end.

    >>> list(stretches(17, 4))
    [(0, 4), (4, 8), (8, 13), (13, 17)]
    """
    return itertools.pairwise(round(k * places / parts) for k in range(parts + 1))


class Grouped(Design):
    """A design made of blocks of runs, in which whole groups of inputs change at once.

    An input that no group names is a group of its own, with all its places if it has many.
    """

    groups: dict[str, Annotated[tuple[str, ...], ListIn]] = Field(default_factory=dict)
    """Inputs by the name of their group: paths as under [inputs], and for inputs of many places
    also single ones, ``PATH[3]``, or stretches of them, ``PATH[1..13]``."""
    stretches: dict[str, Annotated[int, Field(ge=2, le=100_000)]] = Field(default_factory=dict)
    """Into how many stretches of places, each a group, an input of many places is divided."""

    def block(self, groups: int) -> int:
        """Runs of a block with so many groups."""
        raise NotImplementedError

    def rows(self, factors: Factors, seed: int) -> list[str]:
        """What each run of the design is within its block."""
        raise NotImplementedError

    def members(self, factors: Factors) -> dict[str, list[int]]:
        """The axes of every group, in the order of the factors within it.

        InputError if a group names what is not drawn, or something is in two groups.
        """
        axes: dict[str, list[int]] = {}
        for number, (path, distribution) in enumerate(factors.items()):
            name = path.rpartition("[")[0] if distribution.each_section else path
            axes.setdefault(name, []).append(number)
        found: dict[str, list[int]] = {}
        taken: dict[int, str] = {}
        for group, paths in self.groups.items():
            if not paths:
                raise InputError(f'design.groups."{group}" is empty: name an input in it')
            if group in axes and group not in paths:
                raise InputError(
                    f'design.groups."{group}" has the name of an input that is not in it: choose '
                    "another name"
                )
            for path in paths:
                for axis in (chosen := self._chosen(group, path, axes)):
                    if axis in taken:
                        raise InputError(
                            f'design.groups."{group}": {path} is in the group "{taken[axis]}", '
                            "too: leave it out of one of the two"
                        )
                taken |= dict.fromkeys(chosen, group)
                found.setdefault(group, []).extend(chosen)
        for name in self.stretches:
            if name not in axes:
                hint = known_or_nearest(name, axes)
                raise InputError(f'design.stretches."{name}" is not an input ({hint})')
        for name, own in axes.items():
            left = [axis for axis in own if axis not in taken]
            if name in self.stretches:
                found |= self._stretches_of(name, own, left)
            elif left:
                found[name if len(left) == len(own) else f"rest of {name}"] = left
        runs = getattr(self, "samples", 1) * self.block(len(found))
        if runs > MOST_RUNS:
            raise InputError(
                f"design.samples = {runs // self.block(len(found))}: blocks of "
                f"{self.block(len(found))} runs for {len(found)} groups make {runs} runs, must be "
                f"at most {MOST_RUNS}: give fewer samples, or join inputs in groups"
            )
        return found

    def _chosen(self, group: str, path: str, axes: dict[str, list[int]]) -> list[int]:
        if path in axes:
            return axes[path]
        where = f'design.groups."{group}"'
        matched = _STRETCH.fullmatch(path)
        if matched is None or matched[1] not in axes:
            inner = matched[1] if matched else path
            raise InputError(f"{where} names {path}, which is not an input "
                             f"({known_or_nearest(inner, axes)})")  # fmt: skip
        own, first = axes[matched[1]], int(matched[2])
        last = int(matched[3] or first)
        if not 1 <= first <= last <= len(own):
            raise InputError(
                f"{where} names {path}, but {matched[1]} has the places 1 to {len(own)}: write for "
                f"example {matched[1]}[1..{max(1, len(own) // 4)}]"
            )
        return own[first - 1 : last]

    def _stretches_of(self, name: str, own: list[int], left: list[int]) -> dict[str, list[int]]:
        parts = self.stretches[name]
        if len(left) < len(own):
            raise InputError(
                f'design.stretches."{name}" is in design.groups, too: leave it out of one'
            )
        if parts > len(own):
            raise InputError(
                f'design.stretches."{name}" = {parts} must be at most its {len(own)} places'
            )
        return {
            f"{name}[{low + 1}..{high}]": own[low:high] for low, high in stretches(len(own), parts)
        }

    def runs_told(self, runs: int) -> str:
        """How many runs the design has, in words, of so many in all."""
        raise NotImplementedError

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """As of every design; InputError without inputs, which leave nothing to move."""
        if not factors:
            raise InputError(f"design.kind = {kind_of(self)} needs inputs: give [inputs]")
        return super().table(factors, correlations, seed=seed, folder=folder)


# Trajectories for screening.


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


# Blocks of runs for Sobol' indices.


class Saltelli(Grouped, Replicated):
    """Two Sobol' points A and B for each of N base samples, and A with each group out of B.

    A block of g + 2 runs for g groups (N (g + 2) runs in all): A, AB_1 .. AB_g, B; with
    ``second_order`` 2 g + 2 runs, BA_1 .. BA_g before B.  A and B are the two halves of one
    scrambled Sobol' sequence over twice the inputs, of which block b is the b-th point of its
    replicate; replicates are what intervals of indices come from.
    Source: Saltelli et al., Computer Physics Communications 181 (2010), table 2.
    """

    kind: Literal["saltelli"] = "saltelli"
    samples: Samples
    """Number N of base samples, a multiple of ``replicates``; runs are g + 2 times as many."""
    replicates: Annotated[int, Field(ge=1, le=10_000)] = 8
    second_order: bool = False
    """Whether interactions of pairs of groups are wanted, too: nearly twice the runs."""

    def block(self, groups: int) -> int:
        """Runs of a block."""
        return 2 * groups + 2 if self.second_order else groups + 2

    def runs_told(self, runs: int) -> str:
        """Base samples by runs of a block."""
        size = runs // self.samples
        groups = f"2 x {size // 2 - 1} groups" if self.second_order else f"{size - 2} groups"
        return f"{self.samples} base samples x ({groups} + 2) = {runs} runs"

    def points(self, factors: Factors, seed: int) -> Array:
        """Block after block, shape (N (g + 2), factors)."""
        members, wide = self.members(factors), len(factors)
        both = self.spread(2 * wide, seed)
        first, second = both[:, :wide], both[:, wide:]
        found = np.empty((self.samples, self.block(len(members)), wide))
        found[:, :], found[:, -1] = first[:, None], second
        for number, axes in enumerate(members.values(), 1):
            found[:, number, axes] = second[:, axes]
            if self.second_order:
                crossed = found[:, len(members) + number]
                crossed[:] = second
                crossed[:, axes] = first[:, axes]
        return found.reshape(-1, wide)

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """The first points of a scrambled sequence."""
        return sobol_points(samples, axes, stream, kind=self.kind)

    def rows(self, factors: Factors, seed: int) -> list[str]:
        """``A``, ``AB: GROUP`` (A with the group out of B), ``BA: GROUP``, ``B``."""
        names = list(self.members(factors))
        crossed = [f"BA: {name}" for name in names] if self.second_order else []
        return ["A", *(f"AB: {name}" for name in names), *crossed, "B"] * self.samples

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """As of every design; InputError if groups depend on each other."""
        group_of = {a: name for name, axes in self.members(factors).items() for a in axes}
        for pair, first, second in pairs_of(list(factors), correlations):
            if group_of[first] != group_of[second]:
                raise InputError(
                    f"correlations.between = {list(pair.between)}: Sobol' indices need "
                    "independent groups: put both inputs into one group of design.groups"
                )
        return super().table(factors, correlations, seed=seed, folder=folder)


def block_size(rows: NDArray[np.str_], samples: NDArray[np.int64]) -> int:
    """Runs of a block of a Saltelli design, of any selection of its runs and in any order; 1 if
    they do not tell.  Shapes (n,).

    Numbers of runs of one kind differ by whole blocks, A begins a block, and B ends it.

    >>> block_size(np.array(["A", "AB: a", "B", "AB: a", "B"]), np.array([4, 5, 7, 13, 15]))
    4
    """
    whole = [np.diff(samples[rows == row]) for row in np.unique(rows)]
    whole += [samples[rows == "A"], samples[rows == "B"] + 1]
    return int(np.gcd.reduce(np.concatenate(whole))) or 1
