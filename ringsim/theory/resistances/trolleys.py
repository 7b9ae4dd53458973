"""Friction of the trolleys of a ground test."""

from ringsim.theory.resistances.family import Opening, Resistance


class TrolleyResistance(Resistance):
    """Friction times the pull of each line times the way of its trolley on the rail grid, in full
    at any rate.
    """

    kind = "trolleys"
    category = "friction"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.offload is not None and self.scene.offload.friction > 0.0

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        lines = self.carried.at(opening.now)
        return lines.law.friction * float(lines.pulls @ lines.ways)
