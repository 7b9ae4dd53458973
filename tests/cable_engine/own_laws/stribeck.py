"""Friction laws that ringsim does not ship: they depend on the rope's speed, and on its tension."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np

from ringsim.cable.friction import Bearing, PulleyFriction, Pulleys
from ringsim.units import Newton, PositiveSpeed, Ratio


class StribeckFriction(Bearing):
    """A bearing whose friction falls from ``coefficient`` at rest to a share of it, as its
    lubricant begins to carry: f = coefficient (kinetic + (1 - kinetic) exp(-(s / speed)^2)).

    Source: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083, eq. 4.
    """

    kind: Literal["stribeck"] = "stribeck"
    kinetic: Ratio
    speed: PositiveSpeed
    moves: ClassVar[bool] = True

    def decay(self, pulleys: Pulleys, radius: float) -> Any:
        faded = np.exp(-np.square(pulleys.speed / self.speed))
        lever = self.coefficients * (self.kinetic + (1.0 - self.kinetic) * faded)
        return -2.0 * np.arctanh(lever / radius * np.cos(0.5 * pulleys.angle))


class SealDrag(PulleyFriction):
    """Each pulley takes the same force from the rope, whatever its tension: a rubbing seal.

    With T the mean of both sides, T_before - T_behind = drag is ln(eta) = -2 artanh(drag / (2 T)).
    """

    kind: Literal["seal-drag"] = "seal-drag"
    drag: Newton
    loads: ClassVar[bool] = True

    def factored(self, factor: float) -> SealDrag:
        return self.model_copy(update={"drag": factor * self.drag})

    def decay(self, pulleys: Pulleys, radius: float) -> Any:
        # Rope that carries less than the drag does not move the pulley: most that artanh knows.
        return -2.0 * np.arctanh(np.minimum(0.5 * self.drag / pulleys.tension, 0.999))
