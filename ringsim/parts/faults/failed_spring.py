"""A spring that breaks."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.faults.family import Fault


class FailedSpring(Fault):
    """The spring of a V-joint gives no torque any more; what it had stored is lost."""

    kind: Literal["failed-spring"] = "failed-spring"
    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""
