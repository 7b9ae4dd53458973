"""The margin of one plane's drive, were it to carry half of all that resists.

Rigid rods make both planes one mechanism, in which either winch may drive both.  Elastic rods let a
plane with less drive lag behind.
"""

import math

from ringsim.parts.margin.family import MarginStandard
from ringsim.scene import Scene
from ringsim.theory.drive_margin import DriveMargin, Margin


class PlaneMargin(DriveMargin):
    """Of the plane 0 (upper) or 1 (lower) of a scene with cables in both.

    With Q_p what the cable of the plane p gives, L what loads and springs give, and R what all
    resistances ask for, with a standard's factors,

        margin_p = (Q_p + L / 2) / (R / 2) - 1
                 = margin of both + margin with p's cable alone - that with the other's alone,

    so that the mean of both planes is the margin of the whole.
    """

    def __init__(self, scene: Scene, standard: MarginStandard, plane: int) -> None:
        super().__init__(scene, standard)
        names = scene.structure.planes
        self._own, self._other = (
            DriveMargin(_without(scene, name), standard)
            for name in (names[1 - plane], names[plane])
        )

    whole = DriveMargin.at
    """Of both planes."""

    def at(
        self, angle: float, rate: float | None = None, acceleration: float = 0.0,
        time: float | None = None,
    ) -> Margin:  # fmt: skip
        """See ``DriveMargin``; ``available`` is that of the plane."""
        whole = self.whole(angle, rate, acceleration, time)
        own, other = (
            drive.at(angle, whole.rate, acceleration, time) for drive in (self._own, self._other)
        )
        available = 0.5 * (whole.available + own.available - other.available)
        if math.isfinite(whole.margin):
            margin = whole.margin + own.margin - other.margin
            return whole._replace(available=available, margin=margin)
        return whole._replace(available=available)


def _without(scene: Scene, plane: str) -> Scene:
    """The scene without the cable of a plane; faults, which may be of that cable, do not count."""
    assert scene.cables is not None
    cables = scene.cables.model_copy(update={plane: None})
    return scene.model_copy(update={"cables": cables, "faults": ()})
