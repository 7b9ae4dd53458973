"""Blocks of runs for Sobol' indices."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ringsim.refusal import InputError
from ringsim.sampling.correlation import Correlation, pairs_of
from ringsim.sampling.designs.family import Factors
from ringsim.sampling.designs.grouped import Grouped
from ringsim.sampling.designs.replicated import Replicated
from ringsim.sampling.designs.sobol import sobol_points
from ringsim.sampling.distributions.family import Array
from ringsim.sampling.values import Values


class Saltelli(Grouped, Replicated):
    """Two Sobol' points A and B for each of N base samples, and A with each group out of B.

    A block of g + 2 runs for g groups (N (g + 2) runs in all): A, AB_1 .. AB_g, B; with
    ``second_order`` 2 g + 2 runs, BA_1 .. BA_g before B.  A and B are the two halves of one
    scrambled Sobol' sequence over twice the inputs, of which block b is the b-th point of its
    replicate; replicates are what intervals of indices come from.
    Source: Saltelli et al., Computer Physics Communications 181 (2010), table 2.
    """

    kind: Literal["saltelli"] = "saltelli"
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
                    f"correlations.between = {list(pair.between)}: Sobol' indices need groups that "
                    "do not depend on each other: put both inputs into one of design.groups"
                )
        return super().table(factors, correlations, seed=seed, folder=folder)
