"""A continuous distribution cut off at one or both ends."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import model_validator

from ringsim.choice import OneOf
from ringsim.sampling.distributions.family import Array, Continuous, Distribution
from ringsim.sampling.values import Values

LEAST_MASS = 1e-6
"""Probability between the bounds, at least: less is a mistake in the bounds."""


class Truncated(Distribution):
    """The distribution ``of``, given that its value lies between ``low`` and ``high``.

    >>> from ringsim.sampling.distributions.normal import Normal
    >>> force = Truncated(of=Normal(mean=0.015, standard_deviation=0.002), low=0.015)
    >>> force.quantile(np.array([0.0])).tolist()
    [0.015]
    """

    kind: Literal["truncated"] = "truncated"
    of: Annotated[Continuous, OneOf()]
    """Distribution that is cut off."""
    low: float | None = None
    """Smallest value; left out, no lower bound."""
    high: float | None = None
    """Largest value; left out, no upper bound."""

    @model_validator(mode="after")
    def _some_mass(self) -> Self:
        if self.low is None and self.high is None:
            raise ValueError("truncated needs low, high or both; without them use the kind in of")
        for name in ("each_section", "shared"):
            if getattr(self.of, name):
                raise ValueError(f"of.{name} must be given beside kind, not inside of")
        below, above = self._ends()
        if above - below < LEAST_MASS:
            raise ValueError(
                f"low = {self.low}, high = {self.high} keep a probability of {above - below:.1e} "
                f"only, must be at least {LEAST_MASS:g}: widen the bounds or move the mean"
            )
        return self

    def _ends(self) -> tuple[float, float]:
        below = 0.0 if self.low is None else self.of.probability(self.low)
        above = 1.0 if self.high is None else self.of.probability(self.high)
        return below, above

    def log_density(self, values: Values) -> Array:
        """That of the whole distribution over what the bounds keep of it."""
        below, above = self._ends()
        low = -np.inf if self.low is None else self.low
        high = np.inf if self.high is None else self.high
        found = self.of.log_density(values) - np.log(above - below)
        return np.where((values >= low) & (values <= high), found, -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative probability of ``value``."""
        below, above = self._ends()
        return float(np.clip((self.of.probability(value) - below) / (above - below), 0.0, 1.0))

    def quantile(self, probability: Array) -> Values:
        """Inverse of the cumulative distribution, inside the bounds to the bit."""
        below, above = self._ends()
        values = self.of.quantile(below + (above - below) * probability)
        clipped: Values = np.clip(values, self.low, self.high)
        return clipped
