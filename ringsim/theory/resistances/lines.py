"""Stiffness of the lines of a ground test."""

from ringsim.theory.resistances.family import Opening, Resistance


class LineResistance(Resistance):
    """What lines pull less, or more, than at the start, times how far they are let up: beside
    gravity, which counts what they carry at the start.
    """

    kind = "lines"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.offload is not None and self.scene.offload.stiffness > 0.0

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        lines = self.carried.at(opening.now)
        return lines.law.stiffness * float(lines.heights @ lines.climbs)
