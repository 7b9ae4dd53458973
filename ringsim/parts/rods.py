"""Rods: their tubes, their formulations, and errors of their lengths."""

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from ringsim.units import (
    Density,
    Metre,
    MetreOrZero,
    Model,
    Pascal,
    PerSection,
    PoissonRatio,
    SecondOrZero,
    Unit,
    spread,
)

# Tubular cross-sections and their elastic and inertial constants.


class Tube(Model):
    """A circular tube; inner_diameter = 0 is a solid rod."""

    outer_diameter: Metre
    """Outer diameter of the tube."""
    inner_diameter: MetreOrZero
    """Inner diameter; 0 for a solid rod."""

    @model_validator(mode="after")
    def _inside(self) -> Self:
        self.require_below("inner_diameter", "outer_diameter")
        return self

    @property
    def area(self) -> float:
        """Cross-section area in m^2."""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter in m^4."""
        return math.pi / 64.0 * (self.outer_diameter**4 - self.inner_diameter**4)

    def shear_factor(self, poisson_ratio: float) -> float:
        """Timoshenko shear coefficient of a hollow circle.

        Source: Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33
        (1966), with m = inner over outer diameter.
        """
        m2, nu = (self.inner_diameter / self.outer_diameter) ** 2, poisson_ratio
        wall = (1.0 + m2) ** 2
        return 6.0 * (1.0 + nu) * wall / ((7.0 + 6.0 * nu) * wall + (20.0 + 12.0 * nu) * m2)


# Rods that are longer or shorter than drawn.


Elongation = Annotated[float, Field(ge=-0.01, le=0.01), Unit("1")]


class LengthError(Model):
    """How much longer rods are made than they are drawn, (L - L_drawn) / L_drawn.

    The structure is put together with the least elastic energy at the mean opening angle with which
    it starts (``ringsim.rigid.assembling``), and released at rest; masses stay those that are
    drawn.  ``diagonal_falling`` runs from the upper pin on the left to the lower one on the right.
    """

    diagonal_rising: PerSection[Elongation] = 0.0
    """Of the rising diagonal of a section."""
    diagonal_falling: PerSection[Elongation] = 0.0
    """Of the falling diagonal of a section."""
    bar_upper_left: PerSection[Elongation] = 0.0
    """Of the left half of the upper folding bar of a section."""
    bar_upper_right: PerSection[Elongation] = 0.0
    """Of the right half of the upper folding bar of a section."""
    bar_lower_left: PerSection[Elongation] = 0.0
    """Of the left half of the lower folding bar of a section."""
    bar_lower_right: PerSection[Elongation] = 0.0
    """Of the right half of the lower folding bar of a section."""


def errors_of(rods: "Rods", sections: int) -> dict[str, list[float]]:
    """By the names of rods, one a section; all zero if there are none."""
    errors = rods.length_error or LengthError()
    return {name: spread(value, sections).tolist() for name, value in errors}


# The family of rod formulations, with what they have in common.


class Rods(Model):
    """Elastic rods: diagonals and halves of the folding bars."""

    oriented: ClassVar[bool] = True
    """Whether its nodes have an orientation, and its elements tell their forces; only such rods may
    be strained as they are built, hold what is fixed across them, and be run by frames."""
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


# Absolute nodal coordinate beams, as in the papers.


class AncfRods(Rods):
    """Two-node beams with position and two slope vectors per node (18 coordinates).

    Source: papers 000 and 002, eq. 1; exudyn ObjectANCFBeam.  It does not tell what its damping
    takes: with damping there is no stress, the dissipation and the energy error are NaN, and steps
    are not judged by their energy.  Its damping works against the integrator's own velocities,
    which brake a rod that turns along its axis where steps are long (``ringsim.exudyn.assembly``
    cures that for the other kind of rods): leave damping out, or take steps of some milliseconds.

    An element has constant curvature: a rod half in one is a quarter too stiff in bending, in n
    of them by 1 / 4 n^2.
    """

    kind: Literal["ancf"] = "ancf"
    oriented: ClassVar[bool] = False


# Geometrically exact (Simo-Reissner) beams.


class GeometricallyExactRods(Rods):
    """Shear-deformable beams with rigid-body nodes, interpolated on SE(3).

    Source: exudyn ObjectBeamGeometricallyExact; Simo and Vu-Quoc (1986).
    """

    kind: Literal["geometrically-exact"] = "geometrically-exact"
