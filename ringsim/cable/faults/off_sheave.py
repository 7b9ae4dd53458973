"""A rope that leaves its pulley."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Array, Ropes


class OffSheave(CableFault):
    """The rope has left the groove of a pulley, as a slack one may (``limits.slack_duration``).

    Either it is wedged between pulley and bracket, which holds it as a jammed pulley does, or it
    hangs free: what the pulley held of its path is then more than winches take up soon, so that
    the whole rope carries nothing any more, up to the next jam.
    """

    kind: Literal["off-sheave"] = "off-sheave"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""
    rope: Literal["wedged", "free"] = "wedged"
    """Where the rope is."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Hold the rope at the pulley, or let it go."""
        if self.rope == "wedged":
            return ropes.jam(self.cable - 1, self.pulley - 1, stored, wound)
        for span in (self.pulley - 1, self.pulley):  # before and behind it, two ropes after a jam
            ropes = ropes.cut(self.cable - 1, span)
        return ropes

    def clear(self, ropes: Ropes) -> Ropes:
        """Let a wedged rope slip again; nobody puts a free one back."""
        if self.rope == "wedged":
            return ropes.unjam(self.cable - 1, self.pulley - 1)
        raise ValueError(
            f"faults: the rope of cable {self.cable} that left its pulley at {self.time:g} s "
            "cannot be put back: keep that fault, or take a state before it (--at)"
        )
