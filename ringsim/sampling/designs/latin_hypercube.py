"""Latin hypercube samples."""

from typing import Literal

import numpy as np

from ringsim.sampling.designs.family import Design, Factors, Samples
from ringsim.sampling.distributions.family import Array, inside


class LatinHypercube(Design):
    """Every input has exactly one sample in each of its n intervals of equal probability.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979).  Not extendable.
    """

    kind: Literal["latin-hypercube"] = "latin-hypercube"
    samples: Samples

    def points(self, factors: Factors, seed: int) -> Array:
        """Random places within randomly permuted intervals."""
        from scipy.stats import qmc

        engine = qmc.LatinHypercube(d=len(factors), rng=np.random.default_rng(seed))
        return inside(engine.random(self.samples))
