"""Normal distribution."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.special import ndtr, ndtri

from ringsim.sampling.distributions.family import Array, Continuous
from ringsim.sampling.values import Values


class Normal(Continuous):
    """Density exp(-(x - mean)^2 / (2 s^2)) / (s sqrt(2 pi)), s the standard deviation.

    >>> Normal(mean=120e9, standard_deviation=6e9).quantile([0.5]).tolist()
    [120000000000.0]
    """

    kind: Literal["normal"] = "normal"
    mean: float
    """Mean of the values, in the unit of the input."""
    standard_deviation: Annotated[float, Field(gt=0.0)]
    """Standard deviation, in the unit of the input."""

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution."""
        values: Array = self.mean + self.standard_deviation * ndtri(probability)
        return values

    def log_density(self, values: Values) -> Array:
        """Logarithm of the density above."""
        scaled = (np.asarray(values, dtype=float) - self.mean) / self.standard_deviation
        found: Array = -0.5 * scaled**2 - math.log(self.standard_deviation * math.sqrt(2 * math.pi))
        return found

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return float(ndtr((value - self.mean) / self.standard_deviation))
