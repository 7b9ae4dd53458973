"""Pins of hinge assemblies that do not stand where they are drawn."""

from typing import Annotated

from pydantic import Field

from ringsim.parts.persection import PerSection
from ringsim.units import Model, Unit

Shift = Annotated[float, Field(ge=-0.01, le=0.01), Unit("m")]


class HingeError(Model):
    """How much further than ``hinge_offset`` pins stand from the line of their hinge assembly.

    Each pin carries an end of a diagonal and one of a folding bar; pulleys stay where they are
    drawn.  The structure is put together as with errors of its rods (``rods.length_error``).
    """

    upper_left: PerSection[Shift] = 0.0
    """Of the upper pin at the first corner of a section."""
    upper_right: PerSection[Shift] = 0.0
    """Of the upper pin at the second corner of a section."""
    lower_left: PerSection[Shift] = 0.0
    """Of the lower pin at the first corner of a section."""
    lower_right: PerSection[Shift] = 0.0
    """Of the lower pin at the second corner of a section."""
