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
        # The angle opens by two for one that the coordinate falls.
        return 0.5 * self.mechanism.net(opening.now).force
