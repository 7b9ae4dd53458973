"""Which V-joints have reached their stops, and how steps should meet them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.build import Built
from ringsim.engine.joints import latch
from ringsim.engine.stepping import StopContact

Array = NDArray[np.float64]
_NEAR = 0.1
"""A V-joint that has reached a stop counts as resting on it within this angle of it, rad."""
_APART = 1e-3
"""A V-joint that starts closer to the stowed stop than this has not come to it, rad."""


class Locks:
    """The V-joints' memory of their stops.

    A joint that bounces has still reached its stop: all joints need not lie in it at the same
    instant.  One that starts on the stowed stop has to leave it before it can come back.

    Attributes
    ----------
    deployed, stowed
        Whether each V-joint has reached 180 deg, and the stowed stop, shape (2, sections).
    latched
        Whether the latches hold, same shape.
    """

    def __init__(self, built: Built, angles: Array) -> None:
        self._built, self._stop = built, built.model.scene.stop
        self._stowed_angle = 0.0 if self._stop is None else math.radians(self._stop.stowed_angle)
        self.deployed, self.stowed, self.latched = np.zeros((3, *angles.shape), dtype=bool)
        self._away = angles > self._stowed_angle + _APART

    def note(self, angles: Array) -> None:
        """Remember the joints that have reached a stop; latch those that have deployed.

        Parameters
        ----------
        angles
            Opening angles, shape (2, sections), rad.
        """
        deployed = angles >= math.pi
        if self._stop is not None and self._stop.latch:
            for plane, section in np.argwhere(deployed & ~self.deployed):
                latch(self._built.model, self._built.stops[plane][section])
                self.latched[plane, section] = True
        self.deployed |= deployed
        self.stowed |= self._away & (angles <= self._stowed_angle)
        self._away |= angles > self._stowed_angle + _NEAR

    def overrun(self, angles: Array) -> float:
        """Largest angle by which a V-joint is past its stops, rad; 0 if none is."""
        return max(float(angles.max()) - math.pi, self._stowed_angle - float(angles.min()), 0.0)

    def contact(self, angles: Array, rates: Array) -> StopContact:
        """V-joints that are about to meet a stop, and those that rest on one.

        Parameters
        ----------
        angles, rates
            Opening angles and their rates, shape (2, sections), rad and rad/s.
        """
        low, high = self._stowed_angle, math.pi
        folding = (rates < 0.0) & self._away & ~self.stowed & (angles > low)
        with np.errstate(divide="ignore", invalid="ignore"):
            opening = np.where((rates > 0.0) & ~self.deployed, (high - angles) / rates, math.inf)
            waiting = np.minimum(opening, np.where(folding, (low - angles) / rates, math.inf))
        first = np.unravel_index(int(np.argmin(waiting)), waiting.shape)
        resting = self.deployed & (angles > high - _NEAR)
        if self._stop is not None:
            resting |= (self.stowed & (angles < low + _NEAR)) | (angles < low)
        return StopContact(
            time_to_next=float(waiting[first]),
            rate_of_next=float(abs(rates[first])),
            resting_rate=float(np.max(np.abs(rates), where=resting, initial=0.0)),
        )
