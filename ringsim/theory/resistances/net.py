"""The net's pull."""

from ringsim.theory.resistances.family import Opening, Resistance


class NetResistance(Resistance):
    """Tension of the net's strings or cables; dampers are left out."""

    kind = "net"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.net is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        folding = opening.now.rate
        return 0.5 * float(self.mechanism.net(opening.now, 0.0 * folding).force @ folding)
