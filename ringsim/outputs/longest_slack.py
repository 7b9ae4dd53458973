"""How long spans were slack at a stretch."""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable
from ringsim.outputs.peaks import Peak
from ringsim.scene import Scene

_DEEP = 1e9
"""Below zero by so much (m) no slope is seen: at the instant before."""
PEAK = Peak("longest_slack", ("plane", "span"), "the longest slack")


class LongestSlack(Output):
    """The longest time for which a span held more free rope than ``limits.slack_length``.

    Free rope is what a span holds beyond its length, spread evenly over a slack rope.  It counts
    until the span's plane has locked, and no longer once the rope has parted.
    """

    rank = 41
    needs = ("cables",)
    peak = PEAK
    variables = (
        Variable(
            "longest_slack", (), "s",
            "longest time for which a span was slack without a break, until its plane has locked",
            worse="larger",
        ),
        *PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Free rope, m, shape (planes, spans), negative where the rope is strained; -inf where it
        has parted, NaN where a plane has no cable or one of fewer spans.
        """
        chain = now.chain
        if chain is None:
            return None
        ropes = chain.ropes
        free = chain.lengths * ((chain.natural - chain.paths) / chain.paths)[ropes.of_span]
        free = np.where(ropes.alive[ropes.of_span], free, -math.inf)
        edges = ropes.cable_starts.tolist()
        found = np.full((len(now.angles), max(b - a for a, b in pairwise(edges))), np.nan)
        for planes, (first, last) in zip(now.planes, pairwise(edges), strict=True):
            for plane in planes:
                found[plane, : last - first] = free[first:last]
        return found

    def reduce(self, run: Run, series: Series) -> Values:
        """The longest of all spans, and when it began; 0 s of no place if there was none."""
        until = np.nan_to_num(run.locks.max(axis=1), nan=math.inf)
        beyond = series.values - run.scene.limits.slack_length
        longest, begun = longest_above(series.times, beyond, until[:, None])
        if not np.nanmax(longest) > 0.0:
            return {"longest_slack": 0.0}
        return {"longest_slack": np.nanmax(longest)} | PEAK.at(run, begun, longest)


def longest_above(times: Array, values: Array, until: Array) -> tuple[Array, Array]:
    """Longest times (s) for which values, shape (times, ...), were above zero without a break, up
    to times ``until`` (s), and when these began, s; shape (...), NaN where there are no values.

    Between instants values are linear; -inf is below zero from the instant before on.

    >>> course = np.array([-1.0, 1.0, 1.0, -3.0])
    >>> longest, begun = longest_above(np.arange(4.0), course, np.array(np.inf))
    >>> float(longest), float(begun)
    (1.75, 0.5)
    """
    shape = values.shape[1:]
    longest, best = np.where(np.isnan(values[0]), np.nan, 0.0), np.full(shape, np.nan)
    begun, values = np.full(shape, times[0]), np.maximum(values, -_DEEP)
    for k in range(1, len(times)):
        before, now, step = values[k - 1], values[k], times[k] - times[k - 1]
        above, still = before > 0.0, now > 0.0
        if not (above | still).any():
            continue
        fall = np.where(above == still, 1.0, before - now)
        passes = times[k - 1] + before / fall * step
        begun = np.where(still & ~above, passes, begun)
        ends = np.minimum(np.where(still, times[k], passes), until)
        better = (above | still) & (ends - begun > longest)
        longest, best = np.where(better, ends - begun, longest), np.where(better, begun, best)
    return longest, best


def slackened(scene: Scene, values: Values) -> str:
    """What to say of a run whose rope was slack for longer than the scene allows; else nothing."""
    limits, found = scene.limits, float(values.get("longest_slack", 0.0))
    if limits.slack_duration is None or not found > limits.slack_duration:
        return ""
    told: dict[str, Any] = {dim: np.asarray(values[f"longest_slack_{dim}"]).item()
                            for dim in ("plane", "span", "time")}  # fmt: skip
    name = dict(scene.span_names)[told["plane"]][int(told["span"]) - 1]
    return (
        f"; the {told['plane']} rope was slack in span {told['span']} ({name}), by more than "
        f"limits.slack_length = {limits.slack_length:g} m, for {found:.4g} s from "
        f"{told['time']:.6g} s on, longer than limits.slack_duration = {limits.slack_duration:g} "
        "s: it may have left its pulleys"
    )
