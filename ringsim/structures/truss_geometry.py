"""The planar truss: a parallelogram with a telescopic strut and a cable along its diagonal.

The fixed axis stands along y with the lower joint at the origin and the upper joint a distance H
above.  Both beams, of length b, make the angle g with it: g = 0 folded down along the axis,
90 deg square to it.  The synchronising beam joins their outer ends parallel to the axis.

    upper outer joint   C = (b sin g, H - b cos g)
    cable, lower joint to C        c^2 = b^2 + H^2 - 2 b H cos g,      dc/dg = b H sin g / c
    strut, from a foot on the axis p below the upper joint to a head on the upper beam q from it
                                   s^2 = q^2 + p^2 - 2 q p cos g,      ds/dg = q p sin g / s

Source: paper 001, figs 4 and 7.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class TrussPoints(NamedTuple):
    """Joints on the axis, outer ends of the beams, ends of the strut; shape (..., 3), metre."""

    lower: Array
    upper: Array
    lower_end: Array
    upper_end: Array
    foot: Array
    head: Array


@dataclass(frozen=True)
class TrussGeometry:
    """An ideal planar truss with rigid beams; its lengths b, H, p and q in metre, angles in rad."""

    beam: float
    axis: float
    foot: float
    head: float

    def cable(self, angle: ArrayLike) -> Array:
        """Distance c from the lower joint to the upper outer joint."""
        return _third_side(self.beam, self.axis, angle)

    def cable_rate(self, angle: ArrayLike) -> Array:
        """Its derivative dc/dg, m/rad."""
        return np.asarray(self.beam * self.axis * np.sin(angle) / self.cable(angle))

    def strut(self, angle: ArrayLike) -> Array:
        """Length s of the strut between its joints."""
        return _third_side(self.head, self.foot, angle)

    def angle(self, cable: ArrayLike) -> Array:
        """Angle g in [0, pi] at which the cable has a length; NaN out of reach."""
        c = np.asarray(cable, dtype=float)
        cosine = (self.beam**2 + self.axis**2 - c**2) / (2.0 * self.beam * self.axis)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.arccos(cosine))

    def points(self, angle: Any) -> TrussPoints:
        """All points, at angles of any shape."""
        g = np.asarray(angle)  # of any type: a complex angle carries derivatives
        zero = np.zeros_like(g)
        along = np.stack([np.sin(g), -np.cos(g), zero], axis=-1)
        up = np.stack([zero, zero + 1.0, zero], axis=-1)
        upper, beam = self.axis * up, self.beam * along
        foot, head = upper - self.foot * up, upper + self.head * along
        return TrussPoints(0.0 * up, upper, beam, upper + beam, foot, head)


def _third_side(a: float, b: float, angle: ArrayLike) -> Array:
    """Law of cosines, written so that it keeps its digits at small angles."""
    half = np.sin(0.5 * np.asarray(angle, dtype=float))
    return np.asarray(np.sqrt((a - b) ** 2 + 4.0 * a * b * half**2))
