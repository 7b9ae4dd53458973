"""Fold states of the pantograph ring: every point as a function of one angle.

Two planes (0 upper, 1 lower), ``sections`` sections, and ``corners`` corners (one more than the
sections in an open arc).  phi is the angle of a bar half from the horizontal; the opening angle
between the halves is delta = pi - 2 phi.  With half bar l and half diagonal d, the width between
the pins of a section is w = 2 l cos(phi) and its height h = sqrt(4 d^2 - w^2): every fold state
keeps all rod lengths, so each is an exact, stress-free configuration.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_UP = np.array([0.0, 0.0, 1.0])
_SIGNED = np.array([_UP, -_UP])[:, None]
"""Outward in the upper and in the lower plane, shape (2, 1, 3)."""


@dataclass(frozen=True)
class Fold:
    """Point positions of one fold state, in metre."""

    corners: Array
    """Centres of the hinge assemblies, shape (2, corners, 3)."""
    left: Array
    """Pins of a section at its first corner, shape (2, sections, 3)."""
    right: Array
    """Pins of a section at its second corner, shape (2, sections, 3)."""
    pivots: Array
    """Crossing points of the diagonals, shape (sections, 3)."""
    vjoints: Array
    """Middle joints of the folding bars, shape (2, sections, 3)."""


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
        **lengths: float,
    ) -> "RingGeometry":
        """A closed ring, or the first ``sections`` sides of a polygon left open; with its
        ``lengths`` half_bar, half_diagonal and hinge_offset.
        """
        sides = sections if closed else polygon_sections
        corners = np.arange(sections if closed else sections + 1) % sides
        return cls(polygon_corners(sides, aspect_ratio)[corners], closed, **lengths)

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
        return np.cross(self.directions, _UP)

    def width(self, phi: Any) -> Any:
        """Horizontal distance between the pins of a section, in metre."""
        return 2.0 * self.half_bar * np.cos(phi)

    def height(self, phi: Any) -> Any:
        """Vertical distance between upper and lower corners, in metre."""
        return np.sqrt(4.0 * self.half_diagonal**2 - self.width(phi) ** 2)

    def fold(self, phi: Any) -> Fold:
        """Positions at the bar angle ``phi`` (rad, 0 deployed .. pi/2 stowed), complex at complex
        ``phi``, whose imaginary part carries derivatives.
        """
        half_height, half_chord = 0.5 * self.height(phi), 0.5 * self.width(phi) + self.hinge_offset
        lift, offset = half_height * _SIGNED, self.hinge_offset * self.directions
        chord = 2.0 * half_chord
        first, second = self.plan[: self.sections], np.roll(self.plan, -1, axis=0)[: self.sections]
        pivots = half_chord * (first + second)
        return Fold(
            corners=chord * self.plan + lift,
            left=chord * first + offset + lift,
            right=chord * second - offset + lift,
            pivots=pivots,
            vjoints=pivots + (half_height - self.half_bar * np.sin(phi)) * _SIGNED,
        )


@functools.lru_cache(maxsize=64)  # the scenes of a campaign ask for the same ones again and again
def polygon_corners(sides: int, aspect_ratio: float) -> Array:
    """Corners of the closed polygon with equal chords of length 1, inscribed in an ellipse.

    The first corner lies on the major axis (+x), the polygon runs anticlockwise and is centred on
    the origin.  Read-only, shape (sides, 3), in units of the chord, z = 0.  The unknowns are the
    ellipse parameters of the other corners and the chord; Newton's method starts from the regular
    polygon.

    Raises
    ------
    ValueError
        With less than 3 sides, minor over major axis not in (0, 1], or no polygon found.
    """
    if sides < 3:
        raise ValueError(f"a closed polygon needs at least 3 sides, not {sides}")
    if not 0.0 < aspect_ratio <= 1.0:
        raise ValueError(f"aspect_ratio = {aspect_ratio} must be in (0, 1]")
    parameters = 2.0 * np.pi * np.arange(sides) / sides
    steps = 1 + int(np.ceil(8 * np.log(1.0 / aspect_ratio)))
    for ratio in (aspect_ratio ** (np.arange(1, steps + 1) / steps)).tolist():
        parameters, chord = _equal_chords(parameters, ratio)
    points = np.stack([np.cos(parameters), ratio * np.sin(parameters), 0.0 * parameters], axis=-1)
    found: Array = points / chord
    found.flags.writeable = False
    return found


def _equal_chords(t: Array, ratio: float) -> tuple[Array, float]:
    """Newton's method on |r(t_k+1) - r(t_k)|^2 = c^2, k = 0..sides-1, with t_0 = 0 fixed."""
    sides = len(t)
    square = 4.0 * np.sin(np.pi / sides) ** 2 * (0.5 * (1.0 + ratio**2))
    this, following = np.arange(sides), (np.arange(sides) + 1) % sides
    for _ in range(60):
        place = np.stack([np.cos(t), ratio * np.sin(t)])
        slope = np.stack([-np.sin(t), ratio * np.cos(t)])
        run = place[:, following] - place
        jacobian = np.zeros((sides, sides + 1))
        jacobian[this, this] = -2.0 * np.sum(run * slope, axis=0)
        jacobian[this, following] += 2.0 * np.sum(run * slope[:, following], axis=0)
        jacobian[:, sides] = -1.0
        change = np.linalg.solve(jacobian[:, 1:], square - np.sum(run**2, axis=0))
        largest = np.abs(change[:-1]).max()
        change *= min(1.0, np.pi / sides / max(largest, 1e-300))
        t = t + np.append(0.0, change[:-1])
        square += change[-1]
        if largest < 1e-14 * sides:
            break
    if not (np.all(np.diff(t) > 0.0) and t[-1] < 2.0 * np.pi and square > 0.0):
        raise ValueError(f"no equal-chord polygon with {sides} sides and axis ratio {ratio:.6g}")
    return t, float(np.sqrt(square))
