"""Uniform distribution."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ringsim.sampling.distributions.family import Array, Continuous
from ringsim.sampling.values import Values


class Uniform(Continuous):
    """Constant density between low and high.

    >>> Uniform(low=1.0, high=3.0).quantile(np.array([0.0, 0.25, 1.0])).tolist()
    [1.0, 1.5, 3.0]
    """

    kind: Literal["uniform"] = "uniform"
    low: float
    """Smallest value."""
    high: float
    """Largest value."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"low = {self.low} must be below high = {self.high}")
        return self

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution; its ends are low and high to the bit."""
        return self.low * (1.0 - probability) + self.high * probability

    def levels(self, count: int) -> Array:
        """From end to end: both are values that can occur."""
        return np.linspace(0.0, 1.0, count) if count > 1 else super().levels(count)

    def log_density(self, values: Values) -> Array:
        """Of a constant density."""
        within = (values >= self.low) & (values <= self.high)
        return np.where(within, -np.log(self.high - self.low), -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return float(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0))
