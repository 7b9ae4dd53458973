"""Full grid over the inputs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Axis, Design
from ringsim.sampling.distributions.family import Array

Levels = Annotated[int, Field(ge=1, le=100_000)]
MOST_POINTS = 10_000_000


class Grid(Design):
    """Every combination; the last input changes fastest.

    Discrete inputs take all their values.  Uniform ones go from end to end in equal steps,
    unbounded ones stand at the middles of intervals of equal probability.
    """

    kind: Literal["grid"] = "grid"
    levels: Levels | dict[str, Levels] = 3
    """Points of every continuous input, or a table with one entry per path."""

    def points(self, axes: Sequence[Axis], seed: int) -> Array:
        """All combinations of the inputs' levels."""
        if isinstance(self.levels, dict):
            known = [axis.path for axis in axes]
            for path in self.levels:
                if path not in known:
                    raise InputError(
                        f'design.levels."{path}" is not an input ({known_or_nearest(path, known)})'
                    )
        lines = [axis.distribution.levels(self._count(axis.path)) for axis in axes]
        size = math.prod(len(line) for line in lines)
        if size > MOST_POINTS:
            raise InputError(
                f"design.levels: the grid has {size} samples and must have at most {MOST_POINTS}: "
                "use fewer levels"
            )
        crossed = np.meshgrid(*lines, indexing="ij")
        return (
            np.stack([values.ravel() for values in crossed], axis=1) if lines else np.empty((1, 0))
        )

    def _count(self, path: str) -> int:
        return self.levels if isinstance(self.levels, int) else self.levels.get(path, 3)

    def table(
        self,
        axes: Sequence[Axis],
        correlations: Sequence[Correlation],
        *,
        seed: int,
        folder: Path,
    ) -> dict[str, NDArray[Any]]:
        """Values by path; see :meth:`Design.table`."""
        if correlations:
            raise InputError(
                "correlations: a grid has none, its inputs are crossed; use another design"
            )
        return super().table(axes, (), seed=seed, folder=folder)
