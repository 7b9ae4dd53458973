"""Loads that fold the ring."""

from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.resistances.family import Opening, Resistance
from ringsim.theory.section_loads import SectionLoads


class LoadResistance(Resistance):
    """Forces on the V-joints of the sections in which they resist; where they open, they drive."""

    kind = "loads"
    category = "load"

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        super().__init__(scene, mechanism)
        self._loads = SectionLoads(mechanism)

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.loads is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        return float((-self._loads.at(opening.now)).clip(min=0.0).sum())
