"""Whether a structure has come to rest for good."""

import numpy as np

from ringsim.stepping.instant import Array, Instant

MOVED = 1e-3
"""Angle that a V-joint at rest may still move by, rad: 0.06 deg."""
WINDOW = 0.1
"""Time over which it is watched, over ``solver.end_time``: one that creeps on unseen would move
by 10 times ``MOVED``, half a degree, in all the time that there is."""


class Rest:
    """Watches whether anything moves or will move.

    A structure is at rest once no V-joint has moved by more than ``MOVED`` within a window in which
    no winch has turned, and none will and no fault is to come (``Instant.driven``).
    """

    def __init__(self, start: Instant, end_time: float) -> None:
        """Begin to watch at this instant a run that ends at ``end_time`` (s)."""
        self._window = WINDOW * end_time
        self._since, self._angles = start.time, start.angles

    def reached(self, now: Instant) -> bool:
        """Whether the structure is at rest by now; to be asked after every step."""
        moved: Array = np.abs(now.angles - self._angles)
        if now.driven or moved.max() > MOVED:
            self._since, self._angles = now.time, now.angles
        return now.time - self._since >= self._window
