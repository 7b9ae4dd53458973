"""A cable that breaks."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Array, Ropes


class CutCable(CableFault):
    """The rope parts in one span and loses its tension on both sides, up to the next jam.

    Both new ends are free, and a rope without mass carries nothing to a free end.
    """

    kind: Literal["cut-cable"] = "cut-cable"
    span: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V to second hinge", or number, counted from 1 at the winch."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Let go of the rope that holds the span."""
        return ropes.cut(self.cable - 1, self.span - 1)

    def clear(self, ropes: Ropes) -> Ropes:
        """Never."""
        raise ValueError(
            f"faults: the rope of cable {self.cable} that parted at {self.time:g} s cannot be made "
            "whole: keep that fault, or take a state before it (--at)"
        )
