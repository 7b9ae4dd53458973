"""What the integration of an ideal ring leaves behind: its steps, and how it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ringsim.theory.ideal_batch import Equation
from ringsim.variables import Status

Array = NDArray[np.float64]


@dataclass
class Piece:
    """Steps of one sample with the same ropes; arrays of n steps with 3 stages each.

    Attributes
    ----------
    time, step
        Beginning and length of each step, s, shape (n,).
    phi, rate, wound, speed
        At the beginning and the stages, shape (n, 4, ...).
    pull
        phi'' there, rad/s^2, shape (n, 4).
    latched
        Whether the latches held, shape (n,).
    """

    equation: Equation
    time: Array
    step: Array
    phi: Array
    rate: Array
    pull: Array
    wound: Array
    speed: Array
    latched: NDArray[np.bool_]


@dataclass
class Course:
    """What became of one sample.

    Attributes
    ----------
    lock_time
        When the V-joints reached 180 deg, s; NaN if they never did.
    passes, jacobians
        Newton iterations, and steps tried.
    """

    status: Status = Status.UNFINISHED
    reason: str = ""
    lock_time: float = math.nan
    pieces: list[Piece] = field(default_factory=list)
    end: tuple[float, float, float] = (0.0, 0.0, 0.0)
    newton_iterations: int = 0
    tries: int = 0
