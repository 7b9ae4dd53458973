"""The family of resistances to the opening of a ring of rigid rods."""

from functools import cached_property
from typing import ClassVar, NamedTuple

from ringsim.choice import load_package
from ringsim.layout.pose import Array
from ringsim.parts.margin.family import Category
from ringsim.scene import Scene
from ringsim.theory.carried import Carried
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism


class Opening(NamedTuple):
    """The ring at an opening angle (rad) while it opens at a rate (rad/s) and an acceleration.

    ``now`` is the mechanism at its coordinate q = (pi - angle) / 2;
    ``sprung`` is 1 where the spring of a V-joint is whole, one for all or shape (planes, sections).
    """

    angle: float
    rate: float
    acceleration: float
    now: Configuration
    sprung: Array | float = 1.0


class Resistance:
    """A kind of resistance: one file in this folder with a subclass.

    All joints open alike; forces are generalised: power over the rate of the opening angle, N m.
    """

    kind: ClassVar[str]
    """Its name in results."""
    category: ClassVar[Category]
    """The factor of a standard that it takes."""

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self.scene, self.mechanism = scene, mechanism

    @cached_property
    def carried(self) -> Carried:
        """The corners on lines of a scene that has an offload."""
        return Carried(self.scene, self.mechanism)

    @property
    def present(self) -> bool:
        """Whether the scene has it."""
        return True

    def force(self, opening: Opening) -> float:
        """What resists opening, N m; negative where it drives."""
        raise NotImplementedError


def resistances(scene: Scene, mechanism: Mechanism) -> list[Resistance]:
    """All that a scene has, by name."""
    load_package(__name__.rpartition(".")[0])
    found = [kind(scene, mechanism) for kind in Resistance.__subclasses__()]
    return sorted((one for one in found if one.present), key=lambda one: one.kind)
