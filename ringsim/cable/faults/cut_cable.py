"""A cable that breaks."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Ropes
from ringsim.cable.state import ChainState


class CutCable(CableFault):
    """The rope parts in one span and loses its tension on both sides, up to the next jam.

    Both new ends are free, and a rope without mass carries nothing to a free end.
    """

    kind: Literal["cut-cable"] = "cut-cable"
    span: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V to second hinge", or number, counted from 1 at the winch."""

    def strike(self, ropes: Ropes, state: ChainState) -> Ropes:
        """Let go of the rope that holds the span."""
        return ropes.cut(self.cable - 1, self.span - 1)
