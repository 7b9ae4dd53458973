"""Full grid over the inputs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.designs.family import Design, Factor
from ringsim.sampling.distributions.family import Array

Levels = Annotated[int, Field(ge=1, le=100_000)]
MOST_POINTS = 10_000_000


class Grid(Design):
    """Every combination; the last input changes fastest.

    Discrete inputs take all their values.  Uniform ones go from end to end in equal steps,
    unbounded ones stand at the middles of intervals of equal probability.
    """

    correlated: ClassVar[bool] = False

    kind: Literal["grid"] = "grid"
    levels: Levels | dict[str, Levels] = 3
    """Points of every continuous input, or a table with one entry per path."""

    def points(self, factors: Sequence[Factor], seed: int) -> Array:
        """All combinations of the inputs' levels."""
        if isinstance(self.levels, dict):
            known = [factor.path for factor in factors]
            for path in self.levels:
                if path not in known:
                    raise InputError(
                        f'design.levels."{path}" is not an input ({known_or_nearest(path, known)})'
                    )
        counts = self.levels if isinstance(self.levels, dict) else {}
        default = 3 if isinstance(self.levels, dict) else self.levels
        lines = [f.distribution.levels(counts.get(f.path, default)) for f in factors]
        size = math.prod(len(line) for line in lines)
        if size > MOST_POINTS:
            raise InputError(
                f"design.levels: the grid has {size} samples and must have at most {MOST_POINTS}: "
                "use fewer levels"
            )
        crossed = np.meshgrid(*lines, indexing="ij")
        return np.stack([values.ravel() for values in crossed], axis=1)
