"""What matters, as lines for people."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ringsim.analysis.intervals import LEVEL, Array
from ringsim.analysis.quantities import quantities
from ringsim.tables import interval_text, number_text, text_table

_NAMED = {False: 5, True: 3}
"""Inputs that are told for each output and group, and single places of such that have many."""


def influence_lines(analysis: xr.Dataset) -> Iterator[str]:
    """The inputs that go with each output most, and that separate each group best."""
    if "input_is_place" not in analysis:  # too few samples
        return
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows, certain, least = [], False, 0
    for output in quantities():
        if f"{output}_rank_correlation" not in analysis:
            continue
        plain, partial = (
            (
                analysis[f"{output}_{word}rank_correlation"].values,
                analysis[f"{output}_{word}rank_correlation_interval"].values,
            )
            for word in ("", "partial_")
        )
        certain = certain or bool(np.isfinite(plain[1]).any())
        used = int(analysis[f"{output}_samples"].values[0])
        least = min(least or used, used)
        rows += [
            (f"{output} with {names[k]}", *_told(*plain, k), *_told(*partial, k), str(used))
            for k in _largest(plain[0], place)
        ]  # fmt: skip
    if rows:
        head = ("rank correlation", "correlation", "95 % interval", "partial", "95 % interval")
        yield from text_table((*head, "used"), rows)
        if certain:
            yield (
                f"the largest of {len(names)} inputs; by chance alone the intervals of about "
                f"{(1 - LEVEL) * len(names):.2g} of them leave out zero"
            )
        else:
            yield (
                f"the largest of {len(names)} inputs; by chance alone one in twenty reaches "
                f"{1.96 / (least - 1) ** 0.5:.2g}"
            )
    if "group" in analysis.dims:
        yield ""
        yield from _separated(analysis)


def _separated(analysis: xr.Dataset) -> Iterator[str]:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows = []
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        middle, ends = one["separation"].values, one["separation_interval"].values
        rows += [
            (f"{group}: {names[k]}", *_told(middle, ends, k), str(one["group_samples"].item()))
            for k in _largest(middle - 0.5, place)
        ]  # fmt: skip
    head = ("what separates", "probability that it is larger", "95 % interval", "samples")
    yield from text_table(head, rows)


def _largest(values: Array, place: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[int]:
    """The largest ones of inputs, then of places, among which chance has more."""
    size = np.abs(np.where(np.isnan(values), 0.0, values))
    order = np.argsort(-size, kind="stable")
    return [int(k) for kind, most in _NAMED.items() for k in order[place[order] == kind][:most]]


def _told(middle: Array, ends: Array, k: int) -> tuple[str, str]:
    return number_text(middle[k], 2), interval_text(float(ends[k, 0]), float(ends[k, 1]), 2)
