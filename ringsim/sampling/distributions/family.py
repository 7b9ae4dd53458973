"""The family of distributions: each one maps probabilities to values of an input."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ringsim.sampling.values import Values
from ringsim.units import ListIn, Model

Array = NDArray[np.float64]


class Distribution(Model):
    """Distribution of one scene field, in the field's own unit."""

    each_section: bool = False
    """Draw one independent value for every section instead of one for all."""
    shared: Annotated[tuple[str, ...], ListIn] = ()
    """Scene paths that all take the value drawn; the key of the input is then only its name."""

    def quantile(self, probability: Array) -> Values:
        """Values at cumulative probabilities in the open interval (0, 1), same shape."""
        raise NotImplementedError

    def levels(self, count: int) -> Array:
        """Probabilities of ``count`` grid points: middles of intervals of equal probability."""
        return (np.arange(count) + 0.5) / count

    def log_density(self, values: Values) -> Array:
        """Logarithm of the density, or of the probability of each value; -inf where there is none.

        Raises TypeError for what is no value of this kind of distribution.
        """
        raise NotImplementedError


class Continuous(Distribution):
    """A distribution over an interval of real numbers."""

    def probability(self, value: float) -> float:
        """Cumulative probability of ``value``."""
        raise NotImplementedError


def inside(probability: Array) -> Array:
    """Probabilities moved off the ends 0 and 1, where quantiles may be infinite."""
    return np.clip(probability, 2.0**-54, 1.0 - 2.0**-53)
