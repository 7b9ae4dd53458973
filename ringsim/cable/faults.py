"""Faults of cables: what is cut or jammed, where and when."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from ringsim.cable.ropes import Array, Ropes
from ringsim.parts.faults import Fault, Struck

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The family of cable faults.


class CableFault(Fault):
    """Something that breaks at a given time and place."""

    cable: Annotated[int, Field(ge=1)] = 1
    """Which cable of the scene, "upper" or "lower", or its number from 1: the upper one first."""

    def strike(self, now: Struck) -> None:
        """See ``Fault``."""
        now.ropes = self.change(now.ropes, now.stored, now.wound)

    def clear(self, now: Struck) -> None:
        """See ``Fault``."""
        now.ropes = self.whole(now.ropes)

    def check(self, scene: "Scene") -> None:
        """See ``Fault``."""
        if scene.cables is None:
            raise ValueError(
                "is a fault of a cable, but the scene has none: add [cables.upper], or leave the "
                "fault out"
            )

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """The ropes after the fault, with the natural length in each span, m, shape (spans,), and
        the rope wound at both ends of each cable, m, shape (cables, 2), at that instant.

        ValueError if the cable or the place on it does not exist.
        """
        raise NotImplementedError

    def whole(self, ropes: Ropes) -> Ropes:
        """The ropes after the fault is cleared; ValueError if it cannot be."""
        raise NotImplementedError


# A cable that breaks.


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

    def whole(self, ropes: Ropes) -> Ropes:
        """Never."""
        raise ValueError(
            f"faults: the rope of cable {self.cable} that parted at {self.time:g} s cannot be "
            "undone: keep that fault, or start from an earlier state (--at)"
        )


# A pulley that seizes the rope.


class JammedPulley(CableFault):
    """The rope no longer slips over the pulley: two ropes of fixed content meet there."""

    kind: Literal["jammed-pulley"] = "jammed-pulley"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Split the rope at the pulley; each part keeps the rope that its spans hold."""
        return ropes.jam(self.cable - 1, self.pulley - 1, stored, wound)

    def whole(self, ropes: Ropes) -> Ropes:
        """Let the rope slip again: both parts become one."""
        return ropes.unjam(self.cable - 1, self.pulley - 1)


# A rope that leaves its pulley.


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

    def whole(self, ropes: Ropes) -> Ropes:
        """Let a wedged rope slip again; nobody puts a free one back."""
        if self.rope == "wedged":
            return ropes.unjam(self.cable - 1, self.pulley - 1)
        raise ValueError(
            f"faults: the rope of cable {self.cable} that left its pulley at {self.time:g} s "
            "cannot be undone: keep that fault, or start from an earlier state (--at)"
        )
