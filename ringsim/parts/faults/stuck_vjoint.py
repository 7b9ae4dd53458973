"""A V-joint that seizes."""

from typing import Annotated, Any, Literal

from pydantic import Field

from ringsim.parts.faults.family import Fault
from ringsim.parts.springs import Reaction, two_sided
from ringsim.units import TorsionDamping, TorsionRate


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
