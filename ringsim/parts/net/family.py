"""The family of nets."""

from ringsim.units import Model


class Net(Model):
    """What the corners stretch as the ring opens."""

    @property
    def point_mass(self) -> float:
        """Mass of points that are its own, kg."""
        return 0.0

    @property
    def lossless(self) -> bool:
        """Whether it gives back all that it takes."""
        return True
