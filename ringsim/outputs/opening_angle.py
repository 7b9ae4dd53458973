"""The opening angles of all V-joints."""

import numpy as np

from ringsim.outputs.family import ErrorBar, Output, Run, Series, Values, Variable


class OpeningAngle(Output):
    """Angle between the bar halves; of a planar truss, between its beams and the axis."""

    rank = 10
    variables = (
        Variable(
            "opening_angle", ("plane", "section", "time"), "degree", "angle between the bar halves",
            error_bar=ErrorBar("opening angles", safety=1.7),
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Cubic Hermite interpolation of angles and rates."""
        return {"opening_angle": np.degrees(run.angles.on_grid(run.rates.values))}
