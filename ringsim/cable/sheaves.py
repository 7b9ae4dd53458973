"""What a cable's path runs over; its winch and far end are points as well.

A node names a moving frame where the path is used: a mount of a layout, or a node of an engine.
"""

from dataclasses import dataclass
from typing import Any

from ringsim.cable.ropes import Array


@dataclass(frozen=True)
class FixedSheave:
    """A sheave, winch or end of a rope fixed on the body of a node."""

    node: Any
    arm: Array
    """From the node to the point in the node's axes, m, shape (3,)."""

    @property
    def nodes(self) -> tuple[Any, ...]:
        """All nodes that carry it."""
        return (self.node,)


@dataclass(frozen=True)
class BlockSheave:
    """A V pulley on a block that stays on the bisector of two bar halves."""

    nodes: tuple[Any, ...]
    """Nodes of the first and the second half at their V-joint."""
    sense: float
    """+1 in the upper plane, -1 in the lower: the block stands inside of the joint."""
    offset: float
    """Distance from the joint's axis, m."""


Sheave = FixedSheave | BlockSheave
