"""How well the joints hold together."""

from ringsim.outputs.family import Output, Reading, Variable


class JointGaps(Output):
    """Largest distance of points that a joint should hold together."""

    rank = 61
    of_antenna = False
    variables = (
        Variable("constraint_violation", ("time",), "m", "largest gap in any joint"),
        Variable(
            "constraint_error", (), "m", "largest gap in any joint at any step",
            summary=("constraint error", "10.1e"), worse="larger",
            largest_of="constraint_violation",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> float:
        """The gap, m."""
        return now.gap
