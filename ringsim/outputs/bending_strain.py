"""Bending strain of the rod that carries a structure's gauge."""

from ringsim.outputs.family import Array, Output, Reading, Variable


class BendingStrain(Output):
    """Strain of the outer fibre at the nodes, where a beam loaded at its nodes is bent most."""

    rank = 44
    needs = ("gauge",)
    coordinates = (
        Variable("station", ("station",), "m", "distance along the upper beam from the fixed axis"),
    )
    variables = (
        Variable(
            "bending_strain", ("station", "time"), "1", "bending strain of the upper beam's fibre"
        ),
        Variable(
            "peak_bending_strain", (), "1", "largest bending strain of the upper beam at any step",
            summary=("largest strain", "10.2e"), worse="larger", largest_of="bending_strain",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (stations,)."""
        return now.strain
