"""When and where the largest of an output's readings was."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringsim.outputs.series import Run
from ringsim.stepping.instant import Array
from ringsim.variables import Variable

Values = dict[str, Any]
"""Arrays and numbers by the names of their variables."""
SpanNames = Mapping[str, Sequence[str]]
"""By plane, from the winch on."""


@dataclass(frozen=True)
class Peak:
    """Variables ``NAME_time`` and ``NAME_DIM`` for each dimension of a reading."""

    name: str
    dims: tuple[str, ...]
    words: str
    """What is the largest."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Whole numbers where the dimension has numbers (-1 if missing), text elsewhere."""
        types = {"section": "i4", "span": "i4"}
        where = (
            Variable(f"{self.name}_{d}", (), "1", f"{d} of {self.words}", types.get(d, "str"))
            for d in self.dims
        )
        return (Variable(f"{self.name}_time", (), "s", f"time of {self.words}"), *where)

    def of(self, run: Run, times: Array, values: Array) -> Values:
        """Of values with the shape (times, *dims); the first of equal ones, NaN counts as none."""
        moment, *where = np.unravel_index(int(np.nanargmax(values)), values.shape)
        found: Values = {f"{self.name}_time": times[moment]}
        for dim, place in zip(self.dims, where, strict=True):
            found[f"{self.name}_{dim}"] = run.coordinates[dim][place]
        return found

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 0.3 s: upper, span 1 (winch to section 1 first hinge)"; empty if it is unknown."""
        found = [values.get(f"{self.name}_{dim}", np.nan) for dim in ("time", *self.dims)]
        time, *places = (np.asarray(value).item() for value in found)
        if any(each == "" or each != each for each in (time, *places)):
            return ""
        where = dict(zip(self.dims, places, strict=True))
        words = [v if isinstance(v, str) else f"{dim} {v:.0f}" for dim, v in where.items()]
        if names := span_names.get(where.get("plane", ""), ()):
            words[-1] += f" ({names[int(where['span']) - 1]})"
        return f"at {time:.4g} s: {', '.join(words)}"
