"""Independent random samples."""

from typing import ClassVar, Literal

import numpy as np

from ringsim.sampling.designs.family import Design, Factors, Samples
from ringsim.sampling.distributions.family import Array, inside


class RandomDesign(Design):
    """Plain Monte Carlo: sample i depends on the campaign's seed and on i alone."""

    gone: ClassVar[dict[str, str]] = {
        "replicates": "samples of a random design are independent as they are; leave it out",
    }
    independent: ClassVar[bool] = True
    extendable: ClassVar[bool] = True

    kind: Literal["random"] = "random"
    samples: Samples
    """Number of samples."""

    def points(self, factors: Factors, seed: int) -> Array:
        """One stream of random numbers per sample, in the order of the factors."""
        points = np.empty((self.samples, len(factors)))
        for sample in range(self.samples):
            stream = np.random.SeedSequence(seed, spawn_key=(sample,))
            points[sample] = np.random.default_rng(stream).random(len(factors))
        return inside(points)
