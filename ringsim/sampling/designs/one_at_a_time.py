"""One input after the other away from a base case."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.distributions.family import Array

Places = Annotated[int, Field(ge=1, le=100_000)]
_BASE = 1


class OneAtATime(Design):
    """A base case, then every input in turn at each of its other levels, the others at the base.

    Levels are those of a grid: all values of a discrete input, a uniform one from end to end in
    equal steps, of unbounded ones the middles of intervals of equal probability.  An input with
    ``each_section`` moves place by place: one bad part at each place in turn.  Interactions of
    inputs stay unseen.
    """

    correlated: ClassVar[bool] = False
    population: ClassVar[bool] = False

    kind: Literal["one-at-a-time"] = "one-at-a-time"
    levels: Annotated[int, Field(ge=2, le=100_000)] = 2
    """Points of every continuous input."""
    base: Places | dict[str, Places] = _BASE
    """Which level of an input, from 1 on, is that of the base case; or a table with one entry per
    path, 1 for those that it leaves out."""

    def points(self, factors: Factors, seed: int) -> Array:
        """The base case, then input by input in their order, shape (samples, factors)."""
        lines = {path: each.levels(self.levels) for path, each in factors.items()}
        places = {path: self._base(path) for path in lines}
        for path, line in lines.items():
            if places[path] > len(line):
                raise InputError(
                    f"design.base = {places[path]} for {path}, which has {len(line)} levels: "
                    "give one of these"
                )
        if isinstance(self.base, dict):
            names = {path.rpartition("[")[0] for path in lines} | set(lines)
            for path in self.base:
                if path not in names:
                    raise InputError(
                        f'design.base."{path}" is not an input ({known_or_nearest(path, names)})'
                    )
        middle = np.array([line[places[path] - 1] for path, line in lines.items()])
        rows = [middle]
        for axis, (path, line) in enumerate(lines.items()):
            for value in np.delete(line, places[path] - 1):
                rows.append(middle.copy())
                rows[-1][axis] = value
        return np.array(rows)

    def _base(self, path: str) -> int:
        if not isinstance(self.base, dict):
            return self.base
        return self.base.get(path, self.base.get(path.rpartition("[")[0], _BASE))
