"""Latin hypercube samples."""

from typing import Literal

import numpy as np

from ringsim.sampling.designs.replicated import Replicated
from ringsim.sampling.distributions.family import Array


class LatinHypercube(Replicated):
    """Every input has exactly one sample in each of its n intervals of equal probability.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979).  Not extendable.
    """

    kind: Literal["latin-hypercube"] = "latin-hypercube"

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """Random places within randomly permuted intervals."""
        from scipy.stats import qmc

        points: Array = qmc.LatinHypercube(d=axes, rng=stream).random(samples)
        return points
