"""Mean strain of ropes, below zero where they are slack."""

from ringsim.outputs.family import Array, Output, Reading, Variable


class RopeStrain(Output):
    """(S - M) / M with the length S of the path and the natural length M of the rope on it."""

    rank = 42
    needs = ("cables",)
    variables = (
        Variable(
            "rope_strain", ("plane", "time"), "1",
            "mean strain of the rope at the cable's winch, below zero where it is slack",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes,); NaN where a plane has no cable."""
        chain = now.chain
        return None if chain is None else now.by_plane(chain.strains[chain.ropes.of_end[:, 0]])
