"""Elementary effects of trajectories, for screening."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ringsim.analysis import intervals
from ringsim.analysis.blocks import Blocks
from ringsim.analysis.intervals import Array

MEASURES = ("mean_absolute_effect", "mean_effect", "effect_deviation")
"""Morris' mu*, mu and sigma."""
LEAST = {"mean_absolute_effect": 20, "mean_effect": 20, "effect_deviation": 60}
"""Trajectories below which there is no interval: of 10 those of mu* held the truth in 88 of 100
campaigns, of 20 in 93; those of sigma of 30 in 90.
"""


def effects(values: Array, blocks: Blocks, groups: tuple[str, ...]) -> Array:
    """Change of the output by the move of each group, shape (trajectories, groups).

    ``values`` are outputs of all runs, shape (trajectories, runs).  The sign is that of a move
    upwards; of groups of many inputs, which move up and down at once, that of the move made.
    """
    steps = np.diff(values, axis=1)
    found = np.full((len(values), len(groups)), np.nan)
    for number, group in enumerate(groups):
        for way, sign in {"up": 1.0, "down": -1.0, "moved": 1.0}.items():
            block, row = np.nonzero(blocks.rows[:, 1:] == f"{way}: {group}")
            found[block, number] = sign * steps[block, row]
    return found


def measured(found: Array, joint: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Array:
    """Measures of effects (trajectories, groups) with intervals, shape (measure, group, 3).

    The last axis is estimate, lower and upper end.  Trajectories are independent of each other:
    bootstrap over them (BCa).  NaN of the mean effect and of the deviation for groups of many
    inputs (``joint``), whose effects have no sign.
    """
    rows = found.T
    results = []
    for name in MEASURES:
        with_sign = name != "mean_absolute_effect"
        values = rows if with_sign else np.abs(rows)
        statistic: Callable[..., Any] = intervals.spread if name == "effect_deviation" else np.mean
        if len(found) < 2:
            results.append(np.full((len(rows), 3), np.nan))
            continue
        middle = np.asarray(statistic(values, axis=-1))
        told = np.stack([middle, *intervals.of_independent(values, statistic)], axis=-1)
        if len(found) < LEAST[name]:
            told[:, 1:] = np.nan
        results.append(np.where(joint[:, None] & with_sign, np.nan, told))
    return np.array(results)
