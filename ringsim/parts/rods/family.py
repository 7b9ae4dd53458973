"""The family of rod formulations, with what they have in common."""

from typing import Annotated

from pydantic import Field

from ringsim.parts.persection import PerSection
from ringsim.parts.rods.length_error import LengthError
from ringsim.parts.tube import Tube
from ringsim.units import Density, Model, Pascal, PoissonRatio, SecondOrZero


class Rods(Model):
    """Elastic rods: diagonals and halves of the folding bars."""

    elements: Annotated[int, Field(ge=1, le=64)] = 1
    """Elements per rod half."""
    young_modulus: PerSection[Pascal] = 120e9
    """Young's modulus of the rods of a section."""
    bar_young_modulus: PerSection[Pascal] | None = None
    """That of the folding bars, if it is another one."""
    density: Density = 1800.0
    """Mass over volume of the rods' material."""
    poisson_ratio: PoissonRatio = 0.3
    """Poisson's ratio, which gives shear modulus and shear coefficient."""
    damping: SecondOrZero = 0.0
    """Stiffness-proportional (Kelvin-Voigt) damping: stress = E (strain + damping * rate)."""
    diagonal: Tube = Tube(outer_diameter=0.010, inner_diameter=0.00915)
    """Cross-section of the diagonals."""
    bar: Tube = Tube(outer_diameter=0.012, inner_diameter=0.01115)
    """Cross-section of the folding bars."""
    length_error: LengthError | None = None
    """How much longer rods are made than they are drawn; left out, they are not."""

    def young_of(self, group: str) -> float | tuple[float, ...]:
        """Young's modulus of a group, "diagonal" or "bar", Pa."""
        own = self.bar_young_modulus if group == "bar" else None
        return self.young_modulus if own is None else own

    @property
    def shear_modulus_ratio(self) -> float:
        """Shear over Young's modulus of an isotropic material."""
        return 0.5 / (1.0 + self.poisson_ratio)
