"""What matters, as lines for people."""

from collections.abc import Collection

import numpy as np
import xarray as xr

from ringsim.analysis.confounded import confounding_notes
from ringsim.analysis.intervals import LEVEL, Array
from ringsim.analysis.losses import marked
from ringsim.analysis.quantities import quantities
from ringsim.tables import Table, interval_text, number_text

_NAMED = {False: 5, True: 3}
"""Inputs that are told for each output and group, and single places of such that have many."""


def influence_tables(
    analysis: xr.Dataset, outputs: Collection[str] | None = None
) -> tuple[Table, ...]:
    """The inputs that go with each output most (of ``outputs``, by default of all), and that
    separate each group best.
    """
    if "input_is_place" not in analysis:  # too few samples
        return ()
    found = [_correlated(analysis, quantities() if outputs is None else outputs)]
    return (*found, _separated(analysis)) if "group" in analysis.dims else (*found,)


def _correlated(analysis: xr.Dataset, outputs: Collection[str]) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows, notes, certain, least, lacking = [], list[str](), False, 0, list[str]()
    named = set[str]()
    for output in outputs:
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
        chosen = _largest(plain[0], place)
        named |= {str(names[k]) for k in chosen}
        rows += [
            (f"{output} with {names[k]}", *_told(*plain, k), *_told(*partial, k), str(used))
            for k in chosen
        ]  # fmt: skip
        if np.isnan(partial[0][chosen]).any():
            alike = [str(names[k]) for k in chosen if np.isnan(plain[0][k])]
            why = f"{alike[0]} is the same in all samples used" if alike else (
                "they are too few, or inputs depend on each other"
            )  # fmt: skip
            lacking.append(f"{output} ({used} samples used: {why})")
    if lacking:
        notes.append(f"no partial correlation, which holds the other inputs: {', '.join(lacking)}")
    if rows:
        chance = (
            f"the intervals of about {(1 - LEVEL) * len(names):.2g} of them leave out zero"
            if certain else f"one in twenty reaches {1.96 / (least - 1) ** 0.5:.2g}"
        )  # fmt: skip
        notes.append(f"told are the largest of {len(names)} inputs: by chance alone {chance}")
        notes += confounding_notes(analysis, named)
    head = ("rank correlation", "correlation", "95 % interval", "partial", "95 % interval")
    return marked(Table((*head, "used"), rows, notes), analysis)


def _separated(analysis: xr.Dataset) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows, notes = [], list[str]()
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        first, *others = str(group).split("; ")
        if others:
            notes.append(f"{first}: the same samples as {', '.join(others)}")
        middle, ends = one["separation"].values, one["separation_interval"].values
        rows += [
            (f"{first}: {names[k]}", *directed(middle, ends, k), str(one["group_samples"].item()))
            for k in _largest(middle - 0.5, place)
        ]  # fmt: skip
    head = ("what separates", *DIRECTED, "samples")
    return marked(Table(head, rows, notes), analysis)


DIRECTED = ("it is", "with probability", "95 % interval")
"""Heads of ``directed``."""


def directed(middle: Array, ends: Array, k: int) -> tuple[str, str, str]:
    """Whether an input is larger or smaller in a group than in the rest, with which probability (of
    a sample of each), and its interval.
    """
    if middle[k] >= 0.5:
        return "larger", *_told(middle, ends, k)
    return "smaller", *_told(1.0 - middle, 1.0 - ends[:, ::-1], k)


def _largest(values: Array, place: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[int]:
    """The largest ones of inputs, then of places, among which chance has more."""
    size = np.abs(np.where(np.isnan(values), 0.0, values))
    order = np.argsort(-size, kind="stable")
    return [int(k) for kind, most in _NAMED.items() for k in order[place[order] == kind][:most]]


def _told(middle: Array, ends: Array, k: int) -> tuple[str, str]:
    return number_text(middle[k], 2), interval_text(float(ends[k, 0]), float(ends[k, 1]), 2)
