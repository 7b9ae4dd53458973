"""A bracket that is a part of one bar half."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from ringsim.cable.bracket.family import Bracket
from ringsim.cable.ropes import Array
from ringsim.units import Unit


class BarHalfBracket(Bracket):
    r"""The pulley at the end of an element of length H that is fixed to one bar half.

    From the bar to the element are theta + 90 deg, turned across the other half, so that with the
    opening angle delta

        b = H sin((2 theta - delta) / 2),   a = +-H cos((2 theta - delta) / 2)

    (+ on the first half).  b is h of paper 000, eq. 21, which neglects a; see docs/cables.md.  The
    span to that half's own hinge pulley keeps its length, and the other has

        L^2 = l^2 + H^2 + 2 l H sin(theta - delta),

    which falls from the stowed angle on all the way if 90 deg <= theta <= 90 deg + delta.
    """

    kind: Literal["bar-half"] = "bar-half"
    angle: Annotated[float, Field(ge=90.0, le=270.0), Unit("deg")]
    """Angle theta."""
    half: Literal["first", "second"] = "first"
    """The half towards the section's first or second corner, seen from the boom."""

    def refusal(self, opening_angle: float) -> str | None:
        """See ``Bracket``."""
        most = 90.0 + opening_angle
        if self.angle <= most:
            return None
        return (
            f"bracket.angle = {self.angle} deg must be at most {most:g} deg, 90 deg above "
            "structure.opening_angle: the cable would fold the bars at first "
            "(lower it, or raise structure.opening_angle)"
        )

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a and b with theta - delta / 2 = theta - 90 deg + phi."""
        turn = np.radians(self.angle - 90.0) + np.asarray(phi)
        sign = 1.0 if self.half == "first" else -1.0
        return sign * distance * np.cos(turn), distance * np.sin(turn)
