r"""The family of brackets: where the V pulley stands beside its V-joint.

In the plane of an ideal section, with the bars at phi = (pi - delta) / 2 from the line of the hinge
pulleys, the joint stands l cos(phi) along that line from either of them and l sin(phi) inwards.
With the pulley a (along, to the second hinge pulley) and b (inwards) from the joint the spans on
either side of it have the lengths

    L_1, L_2 = sqrt((l cos(phi) +- a)^2 + (l sin(phi) + b)^2).

A kind gives a and b; b is the h of paper 000, eqs 20 and 21.
"""

import numpy as np
from numpy.typing import ArrayLike

from ringsim.cable.ropes import Array
from ringsim.units import Model

_STEP = 1e-30
"""rad; its square, which the complex step neglects, is nothing beside any angle."""


class Bracket(Model):
    """Any bracket; the pulley's distance from the V-joint's axis is the cable's block_offset."""

    def refusal(self, opening_angle: float) -> str | None:
        """Why it cannot open a ring that is stowed at this angle (deg), or None if it can."""
        return None

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a and b in m at bar angles (rad), of their shape.

        Analytic in phi, which may be complex: ``path_slope`` differentiates it so.
        """
        raise NotImplementedError

    def spans(self, half_bar: float, distance: float, opening: ArrayLike) -> tuple[Array, Array]:
        """Lengths L_1 and L_2 at opening angles in rad, m."""
        phi = 0.5 * (np.pi - np.asarray(opening))
        aside, inward = self.place(phi, distance)
        reach, drop = half_bar * np.cos(phi), half_bar * np.sin(phi) + inward
        return np.sqrt((reach + aside) ** 2 + drop**2), np.sqrt((reach - aside) ** 2 + drop**2)

    def path_slope(self, half_bar: float, distance: float, opening: ArrayLike) -> Array:
        """Derivative of L_1 + L_2 after the opening angle, m/rad; a cable opens where negative."""
        # Complex step: no difference of nearby lengths, hence exact to round-off.
        lengths = self.spans(half_bar, distance, np.asarray(opening) + 1j * _STEP)
        return np.asarray(sum(lengths).imag / _STEP)
