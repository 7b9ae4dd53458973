"""Faults of joints: what breaks or sticks, where and when."""

from typing import Annotated, Any, Literal

from pydantic import Field

from ringsim.parts.joints import Reaction, two_sided
from ringsim.units import Model, SecondOrZero, TorsionDamping, TorsionRate

# The family of faults: things that break at a given time and place.


AT_ONCE = 1e-8
"""Faults strike together that are nearer than this, s: the accelerations of a shorter step are
round-off of places (in steps of 1e-10 s they blew rings up that sound steps open)."""


class Fault(Model):
    """Anything that breaks."""

    time: SecondOrZero
    """When it happens, in s of the simulation."""


# A latch that does not catch.


class FailedLatch(Fault):
    """The latch of a V-joint does not catch from that time on; one that has caught holds on."""

    kind: Literal["failed-latch"] = "failed-latch"
    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""


# A spring that breaks.


class FailedSpring(Fault):
    """The spring of a V-joint gives no torque any more; what it had stored is lost."""

    kind: Literal["failed-spring"] = "failed-spring"
    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""


# A V-joint that seizes.


class StuckVJoint(Fault):
    """A stiff spring holds the joint at the angle that it has at that time."""

    kind: Literal["stuck-vjoint"] = "stuck-vjoint"
    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""
    stiffness: TorsionRate = 1000.0
    """Of the spring that holds the joint."""
    damping: TorsionDamping = 1.0
    """Of the damper beside it."""

    def torque(self, turned: Any, rate: Any) -> Reaction:
        """Against the angle (rad) by which the joint has turned since, and its rate (rad/s)."""
        return two_sided(turned, rate, self.stiffness, self.damping)
