"""Rope that the winches have wound up."""

from ringsim.outputs.family import Array, Output, Reading, Variable


class WoundLength(Output):
    """Rope wound by all winches of each cable."""

    rank = 42
    needs = ("cables",)
    variables = (
        Variable("wound_length", ("plane", "time"), "m", "rope wound up by the cable's winches"),
    )

    def read(self, now: Reading) -> Array | None:
        """Shape (planes,), m; NaN where a plane has no cable."""
        return None if now.chain is None else now.by_plane(now.chain.wound.sum(axis=1))
