"""A pulley that seizes the rope."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Array, Ropes


class JammedPulley(CableFault):
    """The rope no longer slips over the pulley: two ropes of fixed content meet there."""

    kind: Literal["jammed-pulley"] = "jammed-pulley"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Split the rope at the pulley; each part keeps the rope that its spans hold."""
        return ropes.jam(self.cable - 1, self.pulley - 1, stored, wound)

    def clear(self, ropes: Ropes) -> Ropes:
        """Let the rope slip again: both parts become one."""
        return ropes.unjam(self.cable - 1, self.pulley - 1)
