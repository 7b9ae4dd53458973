"""Full grid over the inputs."""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.distributions.family import Array

Levels = Annotated[int, Field(ge=1, le=100_000)]
MOST_POINTS = 10_000_000


class Grid(Design):
    """Every combination; the last input changes fastest.

    Discrete inputs take all their values.  Uniform ones go from end to end in equal steps,
    unbounded ones stand at the middles of intervals of equal probability.
    """

    correlated: ClassVar[bool] = False
    population: ClassVar[bool] = False

    kind: Literal["grid"] = "grid"
    levels: Levels | dict[str, Levels] = 3
    """Points of every continuous input, or a table with one entry per path."""

    def points(self, factors: Factors, seed: int) -> Array:
        """All combinations of the inputs' levels."""
        counts, default = (self.levels, 3) if isinstance(self.levels, dict) else ({}, self.levels)
        for path in counts:
            if path not in factors:
                raise InputError(
                    f'design.levels."{path}" is not an input ({known_or_nearest(path, factors)})'
                )
        lines = [each.levels(counts.get(path, default)) for path, each in factors.items()]
        size = math.prod(len(line) for line in lines)
        if size > MOST_POINTS:
            raise InputError(
                f"design.levels: the grid has {size} samples and must have at most {MOST_POINTS}: "
                "use fewer levels"
            )
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(size, -1)
