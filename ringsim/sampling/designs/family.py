"""The family of designs: each one places samples in the space of the inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from numpy.typing import NDArray
from pydantic import Field

from ringsim.sampling.correlation import Correlation, correlate
from ringsim.sampling.distributions.family import Array, Distribution
from ringsim.units import Model

Samples = Annotated[int, Field(ge=1, le=10_000_000)]


@dataclass(frozen=True)
class Axis:
    """One number (or word) to draw: a scene path with its distribution."""

    path: str
    distribution: Distribution


class Design(Model):
    """How the samples of a campaign are placed."""

    extendable: ClassVar[bool] = False
    """Whether the first samples stay the same when more are asked for."""

    def points(self, axes: Sequence[Axis], seed: int) -> Array:
        """Cumulative probabilities, shape (samples, axes)."""
        raise NotImplementedError

    def table(
        self,
        axes: Sequence[Axis],
        correlations: Sequence[Correlation],
        *,
        seed: int,
        folder: Path,
    ) -> dict[str, NDArray[Any]]:
        """Values by path, each of shape (samples,).

        Parameters
        ----------
        axes
            What to draw.
        correlations
            Pairs of axes that depend on each other.
        seed
            Seed of the campaign.
        folder
            Where files that the design names are looked up.

        Raises
        ------
        InputError
            If the correlations contradict each other.
        """
        points = correlate(self.points(axes, seed), [axis.path for axis in axes], correlations)
        return {
            axis.path: axis.distribution.quantile(points[:, column])
            for column, axis in enumerate(axes)
        }
