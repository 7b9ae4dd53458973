"""Subset simulation of rare events."""

from typing import Annotated, ClassVar, Literal

import numpy as np
import scipy
from pydantic import Field, PrivateAttr, model_validator

from ringsim.outputs import VARIABLES
from ringsim.outputs.balance import instead_of
from ringsim.refusal import known_or_nearest
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.distributions import Array, inside
from ringsim.sampling.subset_levels import Levels, levels


class SubsetSimulation(Design):
    """Samples that approach a rare event level by level; see ``ringsim.sampling.subset_levels``.

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
        known = [n for n, v in VARIABLES.items() if not v.dims and v.dtype == "f8"]
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
