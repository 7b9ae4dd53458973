"""How well the joints hold together."""

from ringsim.outputs.family import Output, Reading, Run, Series, Values, Variable


class JointGaps(Output):
    """Largest distance of points that a joint should hold together."""

    rank = 61
    variables = (
        Variable("constraint_violation", ("time",), "m", "largest gap in any joint"),
        Variable(
            "constraint_error", (), "m", "largest gap in any joint at any step",
            summary=("constraint error", "10.1e"),
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> float:
        """The gap, m."""
        return now.gap

    def reduce(self, run: Run, series: Series) -> Values:
        """Interpolated, and the largest reading."""
        return super().reduce(run, series) | {"constraint_error": series.values.max()}
