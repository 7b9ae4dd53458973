"""What designs share whose points depend on each other: independent replicates of the design."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from ringsim.sampling.designs.family import Design, Factors, Samples
from ringsim.sampling.distributions.family import Array, inside


class Replicated(Design):
    """A design that may be made of ``replicates``, each with a randomisation of its own.

    Sample i is a point of replicate i modulo ``replicates``, so that the first samples of a
    campaign are spread over all of them.  Only replicates are independent of each other: the
    scatter of their results is what tells how certain a result is.
    Source: L'Ecuyer and Lemieux, in Modeling Uncertainty (2002), randomised quasi-Monte Carlo.
    """

    samples: Samples
    """Number of samples, a multiple of ``replicates``."""
    replicates: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Independent designs among which the samples are divided; from 2 on there are intervals."""

    @model_validator(mode="after")
    def _whole_replicates(self) -> "Replicated":
        if left := self.samples % self.replicates:
            near = max(self.samples - left, self.replicates)
            raise ValueError(
                f"samples = {self.samples} must be a multiple of replicates = {self.replicates}, "
                f"for example {near}: every replicate has as many samples"
            )
        return self

    def points(self, factors: Factors, seed: int) -> Array:
        """The points of all replicates, those of the first with the campaign's own seed."""
        return self.spread(len(factors), seed)

    def spread(self, axes: int, seed: int) -> Array:
        """The points of all replicates in a unit cube of so many axes."""
        found = np.empty((self.samples, axes))
        for number in range(self.replicates):
            # Keys of two numbers, since those of one are the seeds of samples.
            key = () if number == 0 else (0, number)
            stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
            points = self.replicate(self.samples // self.replicates, axes, stream)
            found[number :: self.replicates] = points
        return inside(found)

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """One replicate in the unit cube, shape (samples, axes)."""
        raise NotImplementedError
