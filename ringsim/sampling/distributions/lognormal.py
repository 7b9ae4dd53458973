"""Lognormal distribution."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ringsim.sampling.distributions.family import Array, Continuous
from ringsim.sampling.distributions.normal import Normal
from ringsim.sampling.values import Values


class Lognormal(Continuous):
    """ln x is normal; mean and standard deviation are those of x itself.

    Variance of ln x: ln(1 + (s / mean)^2); mean of ln x: ln(mean) minus half of that.

    >>> Lognormal(mean=1.0, standard_deviation=0.2).quantile([0.5]).round(4).tolist()
    [0.9806]
    """

    kind: Literal["lognormal"] = "lognormal"
    mean: Annotated[float, Field(gt=0.0)]
    """Mean of the values themselves, in the unit of the input."""
    standard_deviation: Annotated[float, Field(gt=0.0)]
    """Standard deviation of the values themselves, in the unit of the input."""

    @property
    def _logarithm(self) -> Normal:
        deviation = math.sqrt(math.log1p((self.standard_deviation / self.mean) ** 2))
        mean = math.log(self.mean) - 0.5 * deviation**2
        return Normal.model_construct(mean=mean, standard_deviation=deviation)

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution."""
        return np.exp(self._logarithm.quantile(probability))

    def log_density(self, values: Values) -> Array:
        """That of ln x, less ln x."""
        known = np.asarray(values, dtype=float)
        logarithm = np.log(np.where(known > 0.0, known, 1.0))
        found = self._logarithm.log_density(logarithm) - logarithm
        return np.where(known > 0.0, found, -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return self._logarithm.probability(math.log(value)) if value > 0.0 else 0.0
