"""Gravity."""

from ringsim.theory.resistances.family import Opening, Resistance


class WeightResistance(Resistance):
    """What gravity takes, or gives where it helps the ring to open."""

    kind = "gravity"
    category = "gravity"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.gravity is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``; the held body stays where it is."""
        mechanism, now = self.mechanism, opening.now
        return 0.5 * float(mechanism.rates(now) @ mechanism.weight(now))
