"""Lognormal distribution."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtr, ndtri

from ringsim.sampling.distributions.family import Array, Continuous


class Lognormal(Continuous):
    """ln x is normal; mean and standard deviation are those of x itself.

    Variance of ln x: ln(1 + (s / mean)^2); mean of ln x: ln(mean) minus half of that.

    >>> Lognormal(mean=1.0, standard_deviation=0.2).quantile([0.5]).round(4).tolist()
    [0.9806]
    """

    kind: Literal["lognormal"] = "lognormal"
    mean: Annotated[float, Field(gt=0.0)]
    standard_deviation: Annotated[float, Field(gt=0.0)]

    @property
    def _log_deviation(self) -> float:
        return math.sqrt(math.log1p((self.standard_deviation / self.mean) ** 2))

    @property
    def _log_mean(self) -> float:
        return math.log(self.mean) - 0.5 * self._log_deviation**2

    def quantile(self, probability: Array) -> NDArray[Any]:
        """Inverse of the cumulative distribution."""
        values: Array = np.exp(self._log_mean + self._log_deviation * ndtri(probability))
        return values

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        if value <= 0.0:
            return 0.0
        return float(ndtr((math.log(value) - self._log_mean) / self._log_deviation))
