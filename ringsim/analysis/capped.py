"""Bounds of a probability under other distributions of inputs, safe whatever their tails.

The weights of samples, new over old density, may be without bound: where the new distribution has
much and the old one hardly a sample, no scatter of weights warns.  A cap W makes two parts of the
probability of an event A, w the weight as the distributions give it everywhere:

    P_new(A) = E_old[min(w, W) 1_A] + E_new[(1 - W / w)+ 1_A]

The first is W times the mean of numbers between 0 and 1, of which samples are drawn: it has bounds
whatever their distribution.  The second is at most E_new[(1 - W / w)+], which needs no run: draws
of the new distribution tell it.  W is chosen by the distributions and the number of samples alone,
so that it is not fitted to what the samples did.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t

from ringsim.analysis.intervals import Array, Interval, standard_error
from ringsim.analysis.quantities import Mask
from ringsim.analysis.weighted import Replicate
from ringsim.sampling.distributions.family import Distribution, inside

_DRAWS = 1 << 16
"""Draws of the new distribution that place the cap, and as many that tell what is beyond it."""
_ERROR_OF_DRAWS = 0.01
"""Part of the error of a bound that is left to the draws."""


class Pair(NamedTuple):
    """An input's distributions."""

    old: Distribution
    new: Distribution
    places: int
    """How many values it has, independent of each other."""


def mean_bounds(mean: float, count: int, error: float) -> Interval:
    """Bounds of the expectation of numbers between 0 and 1, from the mean of so many independent
    ones; each is missed with a probability of at most ``error``.

    Where the samples' mean m and the expectation p have count * KL(m, p) = ln(1 / error), KL that
    of Bernoulli's distributions; with m = 0 the exact bound of a share.  Source: Hoeffding, J. Am.
    Statistical Association 58 (1963), theorem 1.

    >>> low, high = mean_bounds(0.0, 300, 0.1)
    >>> round(high, 6) == round(1 - 0.1 ** (1 / 300), 6)
    True
    """
    far = np.log(1.0 / error) / count

    def apart(p: float) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            one = mean * np.log(mean / p) if mean > 0 else 0.0
            other = (1 - mean) * np.log((1 - mean) / (1 - p)) if mean < 1 else 0.0
        return float(one + other - far)

    tiny = 1e-300
    low = brentq(apart, tiny, mean, rtol=1e-10) if mean > tiny and apart(tiny) > 0 else 0.0
    most = 1.0 - 2.0**-53
    high = brentq(apart, mean, most, rtol=1e-10) if mean < most and apart(most) > 0 else 1.0
    return float(low), float(high)


def drawn_weights(pairs: Mapping[str, Pair], seed: int) -> Array:
    """Weights at independent draws of the new distributions, shape (draws,); infinite where the old
    ones have nothing.
    """
    rng, logarithm = np.random.default_rng(seed), np.zeros(_DRAWS)
    for old, new, places in pairs.values():
        for _ in range(places):
            values = new.quantile(inside(rng.random(_DRAWS)))
            logarithm += new.log_density(values) - old.log_density(values)
    return np.exp(np.minimum(logarithm, 700.0))


class Cap:
    """The largest weight that counts, for so many samples and so much error of a bound."""

    def __init__(self, pairs: Mapping[str, Pair], samples: int, error: float) -> None:
        self._error = error
        rising = np.sort(drawn_weights(pairs, 0))
        # Beyond each draw as a cap, and what samples without a violation would leave below it.
        inverse = np.append(np.cumsum((1.0 / rising)[::-1])[::-1][1:], 0.0)
        beyond = (np.arange(len(rising))[::-1] - rising * inverse) / len(rising)
        none = mean_bounds(0.0, samples, error)[1]
        self.weight = float(rising[np.argmin(beyond + rising * none)])
        """The cap W."""
        left = np.maximum(1.0 - self.weight / drawn_weights(pairs, 1), 0.0)
        self.beyond = mean_bounds(float(left.mean()), len(left), _ERROR_OF_DRAWS * error)[1]
        """Bound of what the new distribution has beyond it."""

    def bounds(self, own: Mask, weights: Array, replicate: Replicate) -> Interval:
        """One-sided bounds of the new probability of what happened to some samples, each missed
        with a probability of at most the error.

        ``weights`` are densities' ratios, shape (samples,), of all samples that were drawn.  Where
        replicates of a design scatter by more, those of Student's t from them.
        """
        values = np.minimum(weights, self.weight) / self.weight * own
        error = self._error * (1.0 - _ERROR_OF_DRAWS)
        mean = float(values.mean())
        low, high = mean_bounds(mean, len(values), error)
        if replicate is not None:
            scatter, free = standard_error(values, replicate)
            half = float(t.isf(error, free) * scatter) if free > 0 else np.nan
            low, high = np.fmin(low, mean - half), np.fmax(high, mean + half)
        return max(0.0, self.weight * low), min(1.0, self.weight * high + self.beyond)
