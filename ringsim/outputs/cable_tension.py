"""Tensions of the cables' spans."""

import math
from itertools import pairwise

import numpy as np

from ringsim.outputs.family import Array, ErrorBar, Output, Reading, Run, Series, Values, Variable
from ringsim.outputs.peaks import Peak

PEAK = Peak("peak_tension", ("plane", "span"), "the largest tension", "cable_tension")


class CableTension(Output):
    """Tension of every span, and the largest with its time.

    The largest counts up to the deployment time: winches that go on pulling at a locked ring raise
    the tension for as long as one cares to simulate.
    """

    rank = 40
    needs = ("cables",)
    peak = PEAK
    limit = "tension"
    variables = (
        Variable("cable_tension", ("plane", "span", "time"), "N", "tension of a cable's span"),
        Variable(
            "peak_tension", (), "N",
            "largest tension of any span of any cable up to the deployment time",
            error_bar=ErrorBar("largest tension", safety=1.8),
            summary=("largest tension", "10.3f"), worse="larger", largest_of="cable_tension",
        ),
        *PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, spans), N; NaN where a plane has no cable or one of fewer spans."""
        if now.chain is None:
            return None
        edges = now.chain.ropes.cable_starts.tolist()
        found = np.full((len(now.angles), max(b - a for a, b in pairwise(edges))), np.nan)
        for planes, (first, last) in zip(now.planes, pairwise(edges), strict=True):
            for plane in planes:
                found[plane, : last - first] = now.chain.tensions[first:last]
        return found

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading or value at the deployment time."""
        times, values = series.times, series.values
        if math.isfinite(run.until):
            before, last = times <= run.until, np.array([run.until])
            times = np.append(times[before], last)
            values = np.append(values[before], series.at(last), axis=0)
        peak = {"peak_tension": np.nanmax(values)} | PEAK.of(run, times, values)
        return super().reduce(run, series) | peak
