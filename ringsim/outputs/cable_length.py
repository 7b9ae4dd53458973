"""Length of the driving cable of a structure with a gauge."""

from ringsim.outputs.family import Array, Output, Reading, Variable


class CableLength(Output):
    """Distance from the lower joint on the axis to the upper outer joint: the last span."""

    rank = 43
    needs = ("gauge",)
    variables = (Variable("cable_length", ("plane", "time"), "m", "length of the driving cable"),)

    def read(self, now: Reading) -> Array | None:
        """Shape (1,), m."""
        return None if now.chain is None else now.chain.lengths[-1:]
