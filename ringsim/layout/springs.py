"""Springs and contacts inside a structure, and the net."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import Lump, OnBody
from ringsim.parts.net import Net

Array = NDArray[np.float64]


class Spring(NamedTuple):
    """A linear spring with a damper between the origins of two bodies.

    ``law`` is its record (ringsim.parts): ``stiffness``, ``damping``, ``free_length``, and
    ``tension(length, rate)`` as a ``ringsim.parts.springs.Reaction``.
    """

    first: int
    second: int
    law: Any


class Contact(NamedTuple):
    """A body's origin that may not come closer than ``room`` to the plane x_axis = 0.

    ``law`` is its record, with ``push(depth, rate, xp)`` as a ``Reaction``.
    """

    body: int
    axis: int
    room: float
    law: Any


class HubNet(NamedTuple):
    """Springs from the origins of bodies to a hub that is free, where they balance.

    ``law`` is the scene's, ``hub`` a place in space, shape (3,), m.
    """

    law: Net
    hub: Array
    bodies: tuple[int, ...]


class BoomBeam(NamedTuple):
    """A flexible boom: clamped at ``top``, while ``low`` slides along it.

    ``record`` is the scene's, ``lump`` what it would be as a rigid part of the body at its top.
    """

    top: OnBody
    low: OnBody
    record: Any
    lump: Lump
