"""The margin of one plane's drive, were it to carry half of all that resists.

Rigid rods make both planes one mechanism, in which either winch may drive both.  Elastic rods let a
plane with less drive lag behind.
"""

import math

from ringsim.parts.margin.family import MarginStandard
from ringsim.scene import Scene
from ringsim.theory.drive_margin import CABLES, DriveMargin, Margin


class PlaneMargin(DriveMargin):
    """Of the plane 0 (upper) or 1 (lower) of a scene with cables in both.

    With Q_p what the cable of the plane p gives, Q_o the other's, L what loads and springs give,
    Q = Q_p + Q_o + L, and R what all resistances ask for, with a standard's factors,

        margin_p = (Q_p + L / 2) / (R / 2) - 1 = (Q + Q_p - Q_o) / R - 1,

    so that the mean of both planes is the margin of the whole.
    """

    def __init__(self, scene: Scene, standard: MarginStandard, plane: int) -> None:
        super().__init__(scene, standard)
        self._plane = plane

    whole = DriveMargin.at
    """Of both planes."""

    def at(self, angle: float, time: float = 0.0) -> Margin:
        """See ``DriveMargin``; what drives is that of the plane."""
        whole = self.whole(angle, time)
        ideal, factored = whole.pulls[:, self._plane] - whole.pulls[:, 1 - self._plane]
        half = {source: 0.5 * force for source, force in whole.driving.items()}
        half[CABLES] += 0.5 * float(ideal)
        held = self.conditions.at(time).stuck
        if held or whole.required == 0.0 or not math.isfinite(whole.margin):
            return whole._replace(driving=half)
        margin = whole.margin + float(factored) / whole.required
        return whole._replace(driving=half, margin=margin)
