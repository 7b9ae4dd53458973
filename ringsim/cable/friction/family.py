"""The family of friction laws: the loss of tension over a pulley."""

from typing import Self

import numpy as np

from ringsim.cable.ropes import Array
from ringsim.units import Model


class PulleyFriction(Model):
    """Ratio eta of the tension behind a pulley to the tension before it, seen from the winch.

    It holds while rope runs to the winch and depends on the angle a between the two pulls
    alone: a = pi where the rope runs straight through, a = 0 where it turns back on itself.  A
    kind defines ln(eta), at most 0, and its derivative; the logarithm keeps long products of
    weak pulleys exact.
    """

    @property
    def coefficients(self) -> Array:
        """Its field ``coefficient``, if it has one: shape (), or (pulleys,) for one each."""
        return np.asarray(getattr(self, "coefficient", 0.0), dtype=float)

    def refusal(self, radius: float) -> str | None:
        """Why the law has no solution on pulleys of this radius (m), or None if it has."""
        return None

    def factored(self, factor: float) -> Self:
        """The law with its coefficients multiplied; see ``bound_decay`` for what that may break."""
        if "coefficient" not in type(self).model_fields:
            return self
        own = self.coefficients * factor
        return self.model_copy(update={"coefficient": tuple(own) if own.ndim else float(own)})

    def bound_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) of a law that was factored: minus infinity where it has no solution any more."""
        if self.refusal(radius) is not None:
            with np.errstate(all="ignore"):
                return np.nan_to_num(self.log_decay(angle, radius), nan=-np.inf, neginf=-np.inf)
        return self.log_decay(angle, radius)

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) for the angles (rad, shape (pulleys,)) on pulleys of ``radius`` (m)."""
        raise NotImplementedError

    def log_slope(self, angle: Array, radius: float) -> Array:
        """Derivative of ln(eta) after the angle, in 1/rad; same shapes."""
        raise NotImplementedError
