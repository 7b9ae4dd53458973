"""Length of a planar truss's driving cable."""

from ringsim.outputs.family import Array, Instant, Output, Variable


class CableLength(Output):
    """Distance from the lower joint on the axis to the upper outer joint: the last span."""

    rank = 43
    needs = ("planar-truss",)
    variables = (Variable("cable_length", ("plane", "time"), "m", "length of the driving cable"),)

    def read(self, now: Instant) -> Array | None:
        """Shape (1,), m."""
        return None if now.chain is None else now.chain.lengths[-1:]
