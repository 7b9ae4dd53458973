"""What is unusual in the inputs of a sample, in words."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ringsim.analysis.campaign_samples import called, inputs
from ringsim.analysis.drawn import place_names
from ringsim.analysis.intervals import Array

RARE = 0.2
"""Share of the samples that are as far out, on the same side, up to which a value is unusual."""
_MOST = 3
"""Inputs that are told of a sample."""
_ROUND_OFF = 1e-9
"""Distance from the median, over the largest value, that is none."""
_ZERO = 273.15
"""0 C in K."""
NOTE = (
    "unusual is an input that one sample in five, at most, has as far out on the same side; in "
    "brackets the distance from the median of all samples, of temperatures the value in C"
)


class _Oddity(NamedTuple):
    """An input of a sample, and the share of samples that have it as far out."""

    share: float
    words: str


def unusual(campaign: xr.Dataset, places: list[int]) -> list[str]:
    """For samples, by their places, the inputs that are farthest out among all samples, at most
    three: "cold: temperature 235 K (-38 C, the lowest); pulleys 8.3e-4 m (+50 %)".

    Of an input with m places the one that is farthest out among all values counts, with m times
    the share: some place of every sample is far out by chance.  Its mean counts beside.
    """
    columns = [campaign[name] for name in inputs(campaign)]
    columns = [each for each in columns if each.attrs.get("path") != "solver.error_bars"]
    found = []
    for place in places:
        odd = [each for variable in columns for each in _odd(campaign, variable, place)]
        chosen = sorted(odd, key=lambda each: each.share)[:_MOST]
        found.append("; ".join(each.words for each in chosen) or "nothing unusual")
    return found


def _odd(campaign: xr.Dataset, variable: xr.DataArray, sample: int) -> Iterator[_Oddity]:
    """The oddity of one input in a sample, by its place in the file; none if it is usual."""
    values, name = variable.to_numpy(), called(variable)
    if values.dtype.kind in "OUSb":
        rows = values.reshape(len(values), -1).astype(str)
        alike = int((rows == rows[sample]).all(axis=1).sum())
        if alike <= RARE * len(rows):
            word = ", ".join(dict.fromkeys(rows[sample].tolist()))
            yield _Oddity(alike / len(rows), f"{name} = {word} (as in {alike} of {len(rows)})")
        return
    numbers, odd = values.astype(float), list[_Oddity]()
    units = str(variable.attrs.get("units", "1"))
    for each, of in (
        [(numbers, [""])]
        if numbers.ndim == 1
        else [
            (numbers, [_place(variable, p) for p in place_names(campaign, variable)]),
            (numbers.mean(axis=1), ["mean of "]),
        ]
    ):
        rows = each.reshape(len(each), -1)
        apart = np.abs(rows[sample] - np.median(rows))
        if apart.max() <= _ROUND_OFF * np.abs(rows).max():
            continue
        below = np.array([np.mean(rows < value) for value in rows[sample]])
        above = np.array([np.mean(rows > value) for value in rows[sample]])
        k = int(np.minimum(below, above).argmin())
        # Of continuous values one of so many is the farthest, and has none beyond it.
        share = rows.shape[1] * (min(below[k], above[k]) + 1.0 / rows.size)
        if share <= RARE:
            before, behind = (of[k], "") if of[k].endswith("of ") else ("", of[k])
            told = _told(f"{before}{name}{behind}", rows, float(rows[sample, k]), units)
            odd.append(_Oddity(share, told))
    if odd:
        yield min(odd)


def _place(variable: xr.DataArray, name: str) -> str:
    """As " of section 3"."""
    dim = str(variable.dims[1]).replace("_", " ")
    return f" of {name[1:-1]}" if name.startswith('"') else f" of {dim} {name}"


def _told(name: str, rows: Array, value: float, units: str) -> str:
    """A value among those of all samples."""
    middle = float(np.median(rows))
    end = {rows.min(): ", the lowest", rows.max(): ", the highest"}.get(value, "")
    if units == "K":
        word = "cold" if value < middle else "hot"
        return f"{word}: {name} {value:.4g} K ({value - _ZERO:+.0f} C{end})"
    unit = "" if units == "1" else f" {units}"
    if rows.min() > 0.0 or rows.max() < 0.0:
        ratio = value / middle
        far = f"{100.0 * (ratio - 1.0):+.0f} %" if ratio < 3.0 else f"{ratio:.2g} times"
    else:
        far = f"{value - middle:+.2g}{unit}"
    return f"{name} {value:.4g}{unit} ({far}{end})"
