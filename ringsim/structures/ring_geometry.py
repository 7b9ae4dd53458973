"""Fold states of the pantograph ring: every point as a function of one angle.

Two planes (0 upper, 1 lower), ``sections`` sections, and ``corners`` corners (one more than the
sections in an open arc).  phi is the angle of a bar half from the horizontal; the opening angle
between the halves is delta = pi - 2 phi.  With half bar l and half diagonal d, the width between
the pins of a section is w = 2 l cos(phi) and its height h = sqrt(4 d^2 - w^2): every fold state
keeps all rod lengths, so each is an exact, stress-free configuration.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.structures.polygon import corners as polygon_corners

Array = NDArray[np.float64]

PLANES = ("upper", "lower")
_SIGN = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Fold:
    """Point positions of one fold state, in metre.

    Attributes
    ----------
    corners
        Centres of the hinge assemblies, shape (2, corners, 3).
    left, right
        Pins of a section at its first and second corner, shape (2, sections, 3).
    pivots
        Crossing points of the diagonals, shape (sections, 3).
    vjoints
        Middle joints of the folding bars, shape (2, sections, 3).
    """

    corners: Array
    left: Array
    right: Array
    pivots: Array
    vjoints: Array


@dataclass(frozen=True)
class RingGeometry:
    """An ideal ring: unit directions of its sections and the lengths of one section (metre)."""

    plan: Array
    """Corners in plan view in units of the chord, shape (corners, 3), z = 0."""
    closed: bool
    half_bar: float
    half_diagonal: float
    hinge_offset: float

    @classmethod
    def of_polygon(
        cls,
        sections: int,
        *,
        closed: bool,
        polygon_sections: int,
        aspect_ratio: float,
        half_bar: float,
        half_diagonal: float,
        hinge_offset: float,
    ) -> RingGeometry:
        """A closed ring, or the first ``sections`` sides of a polygon left open."""
        ring = polygon_corners(polygon_sections, aspect_ratio)
        plan = ring if closed else ring[np.arange(sections + 1) % polygon_sections]
        return cls(plan, closed, half_bar, half_diagonal, hinge_offset)

    @property
    def sections(self) -> int:
        """Number of sections."""
        return len(self.plan) if self.closed else len(self.plan) - 1

    @property
    def directions(self) -> Array:
        """Unit vector e_k from corner k to corner k + 1, shape (sections, 3)."""
        following = np.roll(self.plan, -1, axis=0)[: self.sections]
        return np.asarray(following - self.plan[: self.sections])

    @property
    def normals(self) -> Array:
        """Outward normal n_k = e_k x z of each section's plane, shape (sections, 3)."""
        return np.cross(self.directions, [0.0, 0.0, 1.0])

    @property
    def deployed_chord(self) -> float:
        """Distance of neighbouring corners at 180 deg, in metre."""
        return 2.0 * (self.half_bar + self.hinge_offset)

    def width(self, phi: Any) -> Any:
        """Horizontal distance between the pins of a section, in metre."""
        return 2.0 * self.half_bar * np.cos(phi)

    def height(self, phi: Any) -> Any:
        """Vertical distance between upper and lower corners, in metre."""
        return np.sqrt(4.0 * self.half_diagonal**2 - self.width(phi) ** 2)

    def fold(self, phi: Any) -> Fold:
        """Positions at the bar angle ``phi`` (rad, 0 deployed .. pi/2 fully stowed).

        A complex ``phi`` gives complex positions: its imaginary part carries derivatives.
        """
        width, height = self.width(phi), self.height(phi)
        return self._place(
            chord=width + 2.0 * self.hinge_offset,
            offset=self.hinge_offset,
            half_height=0.5 * height,
            joint_height=0.5 * height - self.half_bar * np.sin(phi),
        )

    def _place(self, *, chord: Any, offset: float, half_height: Any, joint_height: Any) -> Fold:
        up = np.array([0.0, 0.0, 1.0])
        lift = _SIGN[:, None, None] * half_height * up
        following = np.roll(self.plan, -1, axis=0)[: self.sections]
        first, second = self.plan[: self.sections], following
        middle = 0.5 * chord * (first + second)
        return Fold(
            corners=chord * self.plan[None] + lift,
            left=(chord * first + offset * self.directions)[None] + lift,
            right=(chord * second - offset * self.directions)[None] + lift,
            pivots=middle,
            vjoints=middle[None] + _SIGN[:, None, None] * joint_height * up,
        )
