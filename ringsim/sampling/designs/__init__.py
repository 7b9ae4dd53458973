"""Designs, a kind a file: each one places samples in the space of the inputs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from ringsim.choice import kind_of
from ringsim.refusal import InputError
from ringsim.sampling.columns import Correlation, correlate
from ringsim.sampling.distributions import Array, Distribution, Values
from ringsim.units import Model

Samples = Annotated[int, Field(ge=1, le=10_000_000)]
Factors = Mapping[str, Distribution]
"""Scene paths with their distributions: each is an axis of the unit cube."""


class Design(Model):
    """How the samples of a campaign are placed."""

    correlated: ClassVar[bool] = True
    """Whether factors may depend on each other."""
    population: ClassVar[bool] = True
    """Whether its samples stand for the distributions of the inputs, so that they have a mean."""
    independent: ClassVar[bool] = False
    """Whether every sample is drawn apart from the others; else only replicates are."""
    extendable: ClassVar[bool] = False
    """Whether the first samples of the design are such a design, too."""
    grows: ClassVar[bool] = False
    """Whether which samples come next depends on the results of those before."""
    cure: ClassVar[str] = "change or truncate the inputs"
    """What helps against samples that the scene refuses."""

    def points(self, factors: Factors, seed: int) -> Array:
        """Cumulative probabilities, shape (samples, factors); there is at least one factor."""
        raise NotImplementedError

    def where(self, sample: int, path: str) -> str:
        """Where a sample stands, in words; ``path``, or nothing, is the input that is at fault."""
        return f"sample {sample}"

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """Values by path, each of shape (samples,), or (samples, k) for lists of k values.

        Files that the design names are looked up in ``folder``.  InputError if the correlations
        contradict each other, or if the design has none.
        """
        if correlations and not self.correlated:
            raise InputError(
                f"correlations: a {kind_of(self)} design changes each input by itself and cannot "
                "have correlations: use another design"
            )
        if not factors:
            return {}
        points = correlate(self.points(factors, seed), list(factors), correlations)
        return {
            path: distribution.quantile(column)
            for (path, distribution), column in zip(factors.items(), points.T, strict=True)
        }
