"""An output that ringsim does not ship, in one file, and a solver that knows it."""

import numpy as np

from ringsim.outputs.family import Output, Reading, Run, Series, Values, Variable
from ringsim.simulation import run_frame

__all__ = ["run_frame"]


class OpeningRate(Output):
    """Mean opening rate over time and its largest value."""

    variables = (
        Variable("opening_rate", ("time",), "degree s-1", "mean rate of all opening angles"),
        Variable(
            "opening_rate_max", (), "degree s-1", "largest mean rate of all opening angles",
            summary=("largest opening rate", "10.4f"),
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> float:
        """Deg/s."""
        return float(np.degrees(now.rates.mean()))

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        return super().reduce(run, series) | {"opening_rate_max": series.values.max()}
