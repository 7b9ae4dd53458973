"""Tension of the cables along a net's edge."""

import numpy as np

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable
from ringsim.outputs.peaks import Peak

PEAK = Peak(
    "peak_net_tension", ("plane", "section"), "the largest tension of a net's cable", "net_tension"
)


class NetTension(Output):
    """Tension of every cable between neighbouring corners, and the largest at any step."""

    rank = 33
    needs = ("boundary net",)
    peak = PEAK
    variables = (
        Variable(
            "net_tension", ("plane", "section", "time"), "N",
            "tension of the net's cable along a section; missing in planes without",
        ),
        Variable(
            "peak_net_tension", (), "N", "largest tension of any cable along the net's edge",
            summary=("largest net tension", "10.4f"), worse="larger", largest_of="net_tension",
        ),
        *PEAK.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, sections), N."""
        return now.edge

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        values, peak = super().reduce(run, series), PEAK.of(run, series.times, series.values)
        return values | peak | {"peak_net_tension": np.nanmax(series.values)}
