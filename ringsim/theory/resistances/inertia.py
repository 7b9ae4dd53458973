"""Inertia of all moving parts, trolleys of a ground test among them."""

from ringsim.theory.configuration import Configuration
from ringsim.theory.resistances.family import Opening, Resistance

_STEP = 1e-4
"""Change of the coordinate for the slope of the inertia, rad: 1e-8 of it is left."""


class InertiaResistance(Resistance):
    """I a'' + I' a'^2 / 2, nothing at rest nor where that drives: speed must not help."""

    kind = "inertia"
    category = "inertia"

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        if opening.rate == 0.0 and opening.acceleration == 0.0:
            return 0.0
        q = opening.now.place
        beside = [self._inertia(self.mechanism.at(q + by)) for by in (-_STEP, _STEP)]
        slope = -0.5 * (beside[1] - beside[0]) / (2.0 * _STEP)
        own = self._inertia(opening.now)
        # Half of the coordinate's rate goes with the angle's: a quarter of the inertia.
        force = 0.25 * (own * opening.acceleration + 0.5 * slope * opening.rate**2)
        return max(force, 0.0)

    def _inertia(self, now: Configuration) -> float:
        found = self.mechanism.inertia(now)
        if (offload := self.scene.offload) is not None and offload.trolley_mass > 0.0:
            ways = 2.0 * self.carried.at(now).ways
            found += offload.trolley_mass * float(ways @ ways)
        return found
