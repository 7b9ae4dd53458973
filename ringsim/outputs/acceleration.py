"""How hard corners are accelerated."""

import numpy as np

from ringsim.outputs.family import (
    Array,
    Output,
    Reading,
    Run,
    Series,
    Values,
    Variable,
    in_all_planes,
)


class PeakAcceleration(Output):
    """Largest acceleration of every corner's hinge assembly, at the origin of its body.

    It is that of its motion, without the pull of gravity.  Locks give it: each stop sends a shock
    through the rods, whose height depends on how stiff the stop is.
    """

    rank = 49
    needs = ("accelerations",)
    variables = (
        Variable(
            "peak_acceleration", ("plane", "corner"), "m/s^2",
            "largest acceleration of the corner at any step",
        ),
        Variable(
            "peak_acceleration_max", (), "m/s^2", "largest acceleration of any corner at any step",
            summary=("largest acceleration", "10.3g"), worse="larger",
            largest_of="peak_acceleration",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, corners, 3), m/s^2."""
        return now.accelerations

    def reduce(self, run: Run, series: Series) -> Values:
        """Of all steps."""
        peaks = np.linalg.norm(series.values, axis=3).max(axis=0)
        rows = in_all_planes(peaks, run.scene.structure.planes)
        return {"peak_acceleration": rows, "peak_acceleration_max": peaks.max()}
