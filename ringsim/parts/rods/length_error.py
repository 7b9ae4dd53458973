"""Rods that are longer or shorter than drawn."""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ringsim.parts.persection import PerSection, spread
from ringsim.units import Model, Unit

if TYPE_CHECKING:
    from ringsim.parts.rods.family import Rods

Elongation = Annotated[float, Field(ge=-0.01, le=0.01), Unit("1")]


class LengthError(Model):
    """How much longer rods are made than they are drawn, (L - L_drawn) / L_drawn.

    The structure is put together with the least elastic energy at the mean opening angle with which
    it starts (``ringsim.theory.assembled``), and released at rest; masses stay those that are
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
