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


_ROUND_OFF = 1e-6
"""Places that symmetry makes alike differ by less: 1e-10 in tensions and 2e-7 in stresses of rings
without a boom.  A boom, which holds one plane only, makes 3e-4."""


@dataclass(frozen=True)
class Peak:
    """Variables ``NAME_time`` and ``NAME_DIM`` for each dimension of a reading."""

    name: str
    dims: tuple[str, ...]
    words: str
    """What is the largest."""
    series: str = ""
    """Variable (*dims, time) that tells which other places are alike."""

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

    def at(self, run: Run, times: Array, values: Array) -> Values:
        """Of values that each place has at a time of its own, both of shape (*dims); nothing where
        all are NaN.
        """
        if not np.isfinite(values).any():
            return {}
        where = np.unravel_index(int(np.nanargmax(values)), values.shape)
        places = zip(self.dims, where, strict=True)
        found: Values = {f"{self.name}_{dim}": run.coordinates[dim][k] for dim, k in places}
        return found | {f"{self.name}_time": times[where]}

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 0.3 s: upper, span 1 (winch to section 1 first hinge)"; empty if it is unknown."""
        found = [values.get(f"{self.name}_{dim}", np.nan) for dim in ("time", *self.dims)]
        time, *places = (np.asarray(value).item() for value in found)
        if any(each == "" or each != each for each in (time, *places)):
            return ""
        where = dict(zip(self.dims, places, strict=True))
        words = [v if isinstance(v, str) else f"{dim} {v:.0f}" for dim, v in where.items()]
        names = span_names.get(where.get("plane", ""), ())
        if "span" in where and names:
            words[-1] += f" ({names[int(where['span']) - 1]})"
        alike = ties(values, self.series, self.dims, places, time)
        words[0], more = with_ties(tuple(places), alike)
        return f"at {time:.4g} s: {', '.join(words)}{more}"


def ties(
    values: Values, series: str, dims: Sequence[str], own: Sequence[Any], until: float,
    size: float | None = None,
) -> list[tuple[Any, ...]]:  # fmt: skip
    """The places at which a series was that of the ``own`` place up to a time (s), itself included.

    Alike means to round-off of ``size``, by default the largest value there; the own place alone
    where ``values`` hold neither the series nor its coordinates.
    """
    if any(name not in values for name in (series, "time", *dims)):
        return [tuple(own)]
    labels = [np.asarray(values[dim]).tolist() for dim in dims]
    place = tuple(each.index(label) for each, label in zip(labels, own, strict=True))
    end = int(np.searchsorted(values["time"], until)) + 1
    curves = np.asarray(values[series])[..., :end]
    size = float(np.nanmax(np.abs(curves[place]))) if size is None else size
    near = np.isclose(curves, curves[place], rtol=0.0, atol=_ROUND_OFF * size, equal_nan=True)
    return [
        tuple(each[k] for each, k in zip(labels, where, strict=True))
        for where in np.argwhere(near.all(axis=-1)).tolist()
    ]


def with_ties(own: tuple[Any, ...], alike: Sequence[tuple[Any, ...]]) -> tuple[str, str]:
    """The first label of a place, with that of a tie if it is the only one to differ in it alone;
    and how many more ties there are.

    >>> with_ties(("lower", 1), [("upper", 1), ("upper", 9), ("lower", 1), ("lower", 9)])
    ('upper and lower', ' (and 2 more alike)')
    """
    first = [str(place[0]) for place in alike if place[1:] == own[1:]]
    first = first if len(first) == 2 else [str(own[0])]
    more = len(alike) - len(first)
    return " and ".join(first), f" (and {more} more alike)" if more else ""
