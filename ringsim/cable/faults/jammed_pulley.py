"""A pulley that seizes the rope."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Ropes
from ringsim.cable.state import ChainState


class JammedPulley(CableFault):
    """The rope no longer slips over the pulley: two ropes of fixed content meet there."""

    kind: Literal["jammed-pulley"] = "jammed-pulley"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""

    def strike(self, ropes: Ropes, state: ChainState) -> Ropes:
        """Split the rope at the pulley; each part keeps the rope that its spans hold."""
        return ropes.jam(self.cable - 1, self.pulley - 1, state.stored, state.wound)
