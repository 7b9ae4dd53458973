"""The cables: tensions of spans, slack, pulleys' ratios, lengths; stress and strain of the rods."""

import math
import re
from typing import Any

import numpy as np

from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    SpanNames,
    Values,
    Variable,
)
from ringsim.scene import Scene

# Tensions of the cables' spans.


TENSION_PEAK = Peak("peak_tension", ("plane", "span"), "the largest tension", "cable_tension")


class CableTension(Output):
    """Tension of every span, and the largest with its time.

    The largest counts until all V-joints have locked: winches that go on pulling at a locked ring
    raise the tension for as long as one cares to simulate.  While a latch has not caught, they pull
    at a ring that is not locked, and that counts.
    """

    late = True
    rank = 40
    of_opening = True
    needs = ("cables",)
    peak = TENSION_PEAK
    limit = "tension"
    variables = (
        Variable("cable_tension", ("plane", "span", "time"), "N", "tension of a cable's span"),
        Variable(
            "peak_tension", (), "N",
            "largest tension of any span of any cable until all V-joints have locked, or to the "
            "end of a run where latches do not catch",
            error_bar=ErrorBar("largest tension", safety=1.4, of="cable_tension"),
            summary=("largest tension", "10.3f"), worse="larger", largest_of="cable_tension",
        ),
        *TENSION_PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, spans), N; NaN where a plane has no cable or one of fewer spans."""
        chain = now.chain
        return None if chain is None else now.by_place(chain.tensions, chain.ropes.edges)

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading or value at the last lock."""
        times, values = series.times, series.values
        if math.isfinite(until := run.locked):
            before, last = times <= until, np.array([until])
            times = np.append(times[before], last)
            values = np.append(values[before], series.at(last), axis=0)
        most, peak = TENSION_PEAK.of(run, times, values)
        return super().reduce(run, series) | peak | {"peak_tension": np.asarray(most)}


# Tension of the cables along a net's edge.


PEAK_OF_NET = Peak(
    "peak_net_tension", ("plane", "section"), "the largest tension of a net's cable", "net_tension"
)


class NetTension(Output):
    """Tension of every cable between neighbouring corners, and the largest at any step."""

    rank = 33
    needs = ("boundary net",)
    peak = PEAK_OF_NET
    variables = (
        Variable(
            "net_tension", ("plane", "section", "time"), "N",
            "tension of the net's cable along a section; missing in planes without",
        ),
        Variable(
            "peak_net_tension", (), "N", "largest tension of any cable along the net's edge",
            error_bar=ErrorBar("largest net tension", safety=1.5, of="net_tension"),
            summary=("largest net tension", "10.4f"), worse="larger", largest_of="net_tension",
        ),
        *PEAK_OF_NET.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (planes, sections), N."""
        return now.meters.net()

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        most, peak = PEAK_OF_NET.of(run, series.times, series.values)
        return super().reduce(run, series) | peak | {"peak_net_tension": np.asarray(most)}


# How long cables were slack.


class SlackDuration(Output):
    """Time for which each cable was slack at its first winch."""

    late = True
    rank = 41
    of_opening = True
    needs = ("cables",)
    variables = (
        Variable(
            "slack_duration",
            ("plane",),
            "s",
            "time for which the cable is slack at its winch, until its plane has locked",
        ),
    )

    def read(self, now: Reading) -> Array | None:
        """1 where the rope at the first winch is slack, else 0, shape (planes,)."""
        if (chain := now.chain) is None:
            return None
        return now.by_plane(chain.is_slack[..., chain.ropes.of_end[:, 0]])

    def reduce(self, run: Run, series: Series) -> Values:
        """The sum of the steps, of which those that begin or end taut count half."""
        locked = np.nan_to_num(run.locks.max(axis=1), nan=math.inf)
        slack, steps = series.values, np.diff(np.minimum(series.times[:, None], locked), axis=0)
        return {"slack_duration": np.sum(0.5 * steps * (slack[1:] + slack[:-1]), axis=0)}


# How long spans were slack at a stretch.


_DEEP = 1e9
"""Below zero by so much (m) no slope is seen: at the instant before."""
PEAK_OF_SLACK = Peak("longest_slack", ("plane", "span"), "the longest slack")


class LongestSlack(Output):
    """The longest time for which a span held more free rope than ``limits.slack_length``.

    Free rope is what a span holds beyond its length, spread evenly over a slack rope.  It counts
    until the span's plane has locked, and no longer once the rope has parted.
    """

    late = True
    rank = 41
    of_opening = True
    needs = ("cables",)
    peak = PEAK_OF_SLACK
    variables = (
        Variable(
            "longest_slack", (), "s",
            "longest time for which a span held more free rope than limits.slack_length, until its "
            "plane has locked or its rope has parted",
            summary=("longest slack", "10.3g"), worse="larger",
        ),
        *PEAK_OF_SLACK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Free rope, m, shape (planes, spans), negative where the rope is strained; -inf where it
        has parted, NaN where a plane has no cable or one of fewer spans.
        """
        chain = now.chain
        if chain is None:
            return None
        ropes = chain.ropes
        free = chain.lengths * ((chain.natural - chain.paths) / chain.paths)[..., ropes.of_span]
        if not ropes.alive.all():
            free = np.where(ropes.alive[ropes.of_span], free, -math.inf)
        return now.by_place(free, ropes.edges)

    def reduce(self, run: Run, series: Series) -> Values:
        """The longest of all spans, and when it began; 0 s of no place if there was none."""
        until = np.nan_to_num(run.locks.max(axis=1), nan=math.inf)
        beyond = series.values - run.scene.limits.slack_length
        longest, begun = longest_above(series.times, beyond, until[:, None])
        if not np.nanmax(longest) > 0.0:
            return {"longest_slack": 0.0}
        return {"longest_slack": np.nanmax(longest)} | PEAK_OF_SLACK.at(run, begun, longest)

    def told(self, values: Values, span_names: SpanNames) -> str:
        """From when on, and where."""
        return re.sub(r"^at (\S+ s)", r"from \1 on", super().told(values, span_names))


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


# How much of the tension every pulley passes on.


class PulleyRatio(Output):
    """Tension behind each pulley over that before it, both seen from the cable's first winch.

    The decay factor of paper 000, eq. 9 (figs 6 and 7), as it acts: eta ** tanh(s / s_slip) of the
    rope's speed s over the pulley, see ``ringsim.core.tension``.  It exceeds 1 where rope runs
    away from the winch; at a jammed pulley, where two ropes meet, it is the quotient of their
    tensions.
    """

    late = True
    rank = 40
    needs = ("cables",)
    variables = (
        # Single precision is 1e-7: a file has as many ratios as tensions.
        Variable(
            "pulley_ratio", ("plane", "pulley", "time"), "1",
            "tension behind a pulley over that before it, from the winch on; missing while the "
            "rope before it is slack", "f4", gaps=True,
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Ratios, and 1 where the rope before the pulley is taut, else 0, shape (2, planes,
        pulleys); NaN where a plane has no cable or one of fewer pulleys.
        """
        chain = now.chain
        if chain is None:
            return None
        ropes = chain.ropes
        taut = ~chain.is_slack[..., ropes.of_span[ropes.behind - 1]]
        ratios = np.exp(chain.exponents * chain.log_decays)
        jammed = ropes.slips == 0.0
        if jammed.any():
            tensions = chain.tensions
            before, behind = tensions[..., ropes.behind - 1], tensions[..., ropes.behind]
            met = np.divide(behind, before, out=np.ones_like(before), where=taut)
            ratios = np.where(jammed, met, ratios)
        return now.by_place(np.stack([ratios, taut], axis=-2), ropes.pulley_edges)

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated; missing where the nearer step found the rope slack."""
        ratios, taut = series.on_grid()
        return {"pulley_ratio": np.where(taut > 0.5, ratios, np.nan)}


# Mean strain of ropes, below zero where they are slack.


class RopeStrain(Output):
    """(S - M) / M with the length S of the path and the natural length M of the rope on it."""

    late = True
    rank = 42
    needs = ("cables",)
    variables = (
        Variable(
            "rope_strain", ("plane", "time"), "1",
            "mean strain of the rope at the cable's winch, below zero where it is slack",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes,); NaN where a plane has no cable."""
        chain = now.chain
        return None if chain is None else now.by_plane(chain.strains[..., chain.ropes.of_end[:, 0]])


# Length of the driving cable of a structure with a gauge.


class CableLength(Output):
    """Distance from the lower joint on the axis to the upper outer joint: the last span."""

    late = True
    rank = 43
    needs = ("gauge",)
    variables = (Variable("cable_length", ("plane", "time"), "m", "length of the driving cable"),)

    def read(self, now: Reading) -> Array | None:
        """Shape (1,), m."""
        return None if now.chain is None else now.chain.lengths[..., -1:]


# Rope that the winches have wound up.


class WoundLength(Output):
    """Rope wound by all winches of each cable."""

    late = True
    rank = 42
    needs = ("cables",)
    variables = (
        Variable("wound_length", ("plane", "time"), "m", "rope wound up by the cable's winches"),
    )

    def read(self, now: Reading) -> Array | None:
        """Shape (planes,), m; NaN where a plane has no cable."""
        return None if now.chain is None else now.by_plane(now.chain.wound.sum(axis=-1))


# Stress of the rods.


STRESS_PEAK = Peak("peak_stress", ("rod", "section"), "the largest stress of a rod", "rod_stress")


class RodStress(Output):
    """Axial + bending stress at the ends of every rod half, and the largest at any step."""

    rank = 30
    needs = ("stress",)
    peak = STRESS_PEAK
    shocks = (("peak_rod_stress", peak),)
    limit = "rod_stress"
    coordinates = (Variable("rod", ("rod",), "1", "rod half of a section", "str"),)
    variables = (
        Variable(
            "rod_stress", ("rod", "section", "time"), "Pa",
            "axial + bending stress of a rod, elastic + viscous",
        ),
        Variable(
            "peak_rod_stress", (), "Pa", "largest axial + bending stress of any rod",
            error_bar=ErrorBar("largest stress", safety=2.2, of="rod_stress"),
            summary=("largest rod stress", "10.4g"), worse="larger", largest_of="rod_stress",
        ),
        *STRESS_PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (rod halves, sections), Pa."""
        return now.meters.stress()

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        most, peak = STRESS_PEAK.of(run, series.times, series.values)
        return super().reduce(run, series) | peak | {"peak_rod_stress": np.asarray(most)}


# Bending strain of the rod that carries a structure's gauge.


class BendingStrain(Output):
    """Strain of the outer fibre at the nodes, where a beam loaded at its nodes is bent most."""

    rank = 44
    needs = ("gauge",)
    coordinates = (
        Variable("station", ("station",), "m", "distance along the upper beam from the fixed axis"),
    )
    variables = (
        Variable(
            "bending_strain", ("station", "time"), "1", "bending strain of the upper beam's fibre"
        ),
        Variable(
            "peak_bending_strain", (), "1", "largest bending strain of the upper beam at any step",
            summary=("largest strain", "10.2e"), worse="larger", largest_of="bending_strain",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (stations,)."""
        return now.meters.strain()
