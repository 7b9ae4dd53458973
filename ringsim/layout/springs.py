"""Springs and contacts inside a structure, and the net."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import Lump, OnBody

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spring:
    """A linear spring with a damper between the origins of two bodies.

    ``law`` is its record (ringsim.parts): ``stiffness``, ``damping``, ``free_length``, and
    ``tension(length, rate)`` as a ``ringsim.parts.springs.Reaction``.
    """

    first: int
    second: int
    law: Any


@dataclass(frozen=True)
class Contact:
    """A body's origin that may not come closer than ``room`` to the plane x_axis = 0.

    ``law`` is its record, with ``push(depth, rate, xp)`` as a ``Reaction``.
    """

    body: int
    axis: int
    room: float
    law: Any


@dataclass(frozen=True)
class HubNet:
    """Springs from bodies to a hub that is free.

    Attributes
    ----------
    hub
        Where the springs balance, shape (3,), m.
    mass
        Of the hub, kg.
    bodies
        Whose origins the springs hold.
    stiffness
        Shape (bodies,), N/m.
    """

    hub: Array
    mass: float
    bodies: tuple[int, ...]
    stiffness: Array


@dataclass(frozen=True)
class BoomBeam:
    """A flexible boom: clamped at ``top``, while ``low`` slides along it.

    ``record`` is the scene's, ``lump`` what it would be as a rigid part of the body at its top.
    """

    top: OnBody
    low: OnBody
    record: Any
    lump: Lump
