"""The path of a cable: winch, sheaves and far end, in order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import OnBody, OnRod

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FixedSheave:
    """A point of a path that is fixed on a body or on a rod's node, ``arm`` (m) in its axes."""

    mount: OnBody | OnRod
    arm: Array


@dataclass(frozen=True)
class BlockSheave:
    """A sheave on a block that a gear keeps on the bisector of two rods' ends.

    It stands at r - sense h b, b = (y_L + y_R + sense (x_R - x_L)) / |...|, with r the joint, x and
    y the axes of the rods' frames and h the offset (m).  Source: paper 000, fig. 3.
    """

    left: OnRod
    right: OnRod
    sense: float
    offset: float


Sheave = FixedSheave | BlockSheave
