"""A latch that does not catch."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.faults.family import Fault


class FailedLatch(Fault):
    """The latch of a V-joint does not catch from that time on; one that has caught holds on."""

    kind: Literal["failed-latch"] = "failed-latch"
    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""
