"""The family of designs: each one places samples in the space of the inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from numpy.typing import NDArray
from pydantic import Field

from ringsim.refusal import InputError
from ringsim.sampling.correlation import Correlation, correlate
from ringsim.sampling.distributions.family import Array, Distribution
from ringsim.units import Model

Samples = Annotated[int, Field(ge=1, le=10_000_000)]


@dataclass(frozen=True)
class Factor:
    """One number (or word) to draw: a scene path with its distribution.

    The word is that of the design of experiments: each factor is an axis of the unit cube.
    """

    path: str
    distribution: Distribution


class Design(Model):
    """How the samples of a campaign are placed."""

    extendable: ClassVar[bool] = False
    """Whether the first samples stay the same when more are asked for."""
    correlated: ClassVar[bool] = True
    """Whether factors may depend on each other."""

    def points(self, factors: Sequence[Factor], seed: int) -> Array:
        """Cumulative probabilities, shape (samples, factors); there is at least one factor."""
        raise NotImplementedError

    def table(
        self,
        factors: Sequence[Factor],
        correlations: Sequence[Correlation],
        *,
        seed: int,
        folder: Path,
    ) -> dict[str, NDArray[Any]]:
        """Values by path, each of shape (samples,).

        Parameters
        ----------
        folder
            Where files that the design names are looked up.

        Raises
        ------
        InputError
            If the correlations contradict each other, or if the design has none.
        """
        if correlations and not self.correlated:
            raise InputError(
                "correlations: a grid has none, its inputs are crossed; use another design"
            )
        if not factors:
            return {}
        paths = [factor.path for factor in factors]
        points = correlate(self.points(factors, seed), paths, correlations)
        return {
            factor.path: factor.distribution.quantile(column)
            for factor, column in zip(factors, points.T, strict=True)
        }
