"""The cable's path along one section of an ideal ring.

From a hinge pulley over the V pulley to the next hinge pulley it is 2 L, with

    L(phi) = sqrt(l^2 + h^2 + 2 l h sin(phi)),   phi = (pi - delta) / 2,

l the bar half and h the block's offset: the V pulley stands l sin(phi) + h inside the line of
the hinge pulleys and l cos(phi) from either.  dL/dphi = l h cos(phi) / L vanishes when stowed:
a winch then moves the ring ever faster for the same rope.  Source: paper 000, eq. 20 and fig. 3.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def span_length(half_bar: float, offset: float, opening: ArrayLike) -> Array:
    """Length L of the span on either side of the V pulley, m, at opening angles in rad."""
    fold = 0.5 * (np.pi - np.asarray(opening, dtype=float))
    return np.asarray(np.sqrt(half_bar**2 + offset**2 + 2.0 * half_bar * offset * np.sin(fold)))


def path_slope(half_bar: float, offset: float, opening: ArrayLike) -> Array:
    """Derivative of the section's path 2 L after the opening angle, m/rad, never positive."""
    fold = 0.5 * (np.pi - np.asarray(opening, dtype=float))
    length: Any = span_length(half_bar, offset, opening)
    return np.asarray(-half_bar * offset * np.cos(fold) / length)
