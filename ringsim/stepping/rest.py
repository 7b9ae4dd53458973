"""Whether a structure has come to rest for good."""

import math
from collections.abc import Callable

import numpy as np

from ringsim.stepping.instant import Array, Instant
from ringsim.stepping.memory import Remembering

MOVED = 0.01
"""Angle that a V-joint at rest may still move by within a window, rad: V-joints that a stopped
winch leaves to their friction creep, in a ring of 6 still by 0.14 deg/s 18 s later."""
WINDOW = 0.1
"""Time over which it is watched, over ``solver.end_time``: what creeps at that rate moves by less
than 10 times ``MOVED``, 6 deg, in all the time that there is."""
_MARGIN = 2.0
"""On how far a V-joint creeps: it may have slowed down near a dead point and speed up again."""
GROWTH = 1.1
"""How much more kinetic energy creep may have in the later half of a window than in the first: a
ring that dry friction holds creeps by its smooth part, faster by a few per cent in a window as its
drive grows with the angle.  What loads set in motion from rest has four times as much."""
_STILL = 1e-12
"""Kinetic energy that is round-off, over the structure's reference energy."""


def resting(missing: str, window: float) -> str:
    """Why a run ends at rest, by who has locked and the window (s) that was watched."""
    return (
        f"came to rest with {missing}: no winch turns, and within {window:.3g} s no V-joint has "
        f"moved by more than {math.degrees(MOVED):.2g} deg"
    )


class Rest(Remembering):
    """Watches whether anything moves or will move.

    A structure is at rest once no V-joint has moved by more than ``MOVED`` within a window in which
    no winch has turned, and none will and no fault is to come (``Instant.driven``), and in which
    its kinetic energy has hardly grown: one that its loads set in motion has hardly moved either.
    Nor may a V-joint reach its stop in the time that is left if it goes on as it creeps.
    """

    changing = ("_since", "_angles", "_largest")

    def __init__(self, start: Instant, end_time: float, energy: float) -> None:
        """Begin to watch at this instant a run that ends at ``end_time`` (s), of a structure with a
        reference energy (J).
        """
        self._end, self.window, self._still = end_time, WINDOW * end_time, _STILL * energy
        self.begin(start)

    def reached(self, now: Instant, ahead: Callable[[Array, Array], Array]) -> bool:
        """Whether the structure is at rest by now; to be asked after every step.

        ``ahead`` tells how far (rad) each V-joint is from the stop that it moves to, infinite if
        from none, by its opening angle and by how far it has moved, rad.
        """
        moved: Array = now.angles - self._angles
        if now.driven or np.abs(moved).max() > MOVED:
            self.begin(now)
        late = now.time - self._since > 0.5 * self.window
        self._largest[late] = max(self._largest[late], now.energies.kinetic)
        if now.time - self._since < self.window:
            return False
        creeping = np.abs(moved) / (now.time - self._since) * (self._end - now.time)
        arrives = np.any(_MARGIN * creeping >= ahead(now.angles, moved))
        if not arrives and self._largest[True] <= max(GROWTH * self._largest[False], self._still):
            return True
        self.begin(now)
        return False

    def begin(self, now: Instant) -> None:
        """Open a window: where it starts, and the largest energy in its halves."""
        self._since, self._angles = now.time, now.angles
        self._largest = {False: 0.0, True: 0.0}
