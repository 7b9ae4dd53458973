"""Where corners, pins, joints and the hub are."""

from ringsim.outputs.family import Array, Output, Reading, Run, Series, Values, Variable


class Position(Output):
    """Positions in space of all points between which drawings have their lines.

    Which these are, and the lines between them, follows from the scene:
    :func:`ringsim.layout.points.points_of`.
    """

    rank = 46
    needs = ("positions",)
    coordinates = (
        Variable("point", ("point",), "1", "corner, pin, pivot, V-joint, hub or boom tip", "str"),
    )
    variables = (
        Variable(
            "position", ("point", "axis", "time"), "m", "position of a point of the structure"
        ),
    )

    def read(self, now: Reading) -> Array | None:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        return now.places

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated with the velocities: between two steps rods turn, and their ends go round
        arcs.
        """
        places, rates = series.values[:, :, 0], series.values[:, :, 1]
        return {"position": Series(series.times, places, series.grid).on_grid(rates)}
