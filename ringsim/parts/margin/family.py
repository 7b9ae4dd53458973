"""The family of standards for the margin of a drive."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.units import Model, Unit

Factor = Annotated[float, Field(ge=0.0, le=100.0), Unit("1")]
Category = Literal["inertia", "spring", "friction", "gravity", "load", "latch"]
"""What a standard tells apart; every kind of resistance belongs to one."""


class MarginStandard(Model):
    """Factors by which a standard takes resistances as larger than computed.

    With Q what the drive gives, R_k the resistances, f the factors:

        margin = Q / (motorisation * sum f_k R_k) - 1,   required: >= 0.

    Q is computed with the friction of the pulleys multiplied by ``friction``: what a pulley takes
    is a share of the tension before it, so that losses multiply along the chain.
    """

    inertia: Factor
    """Of the moving parts, where they are accelerated."""
    spring: Factor
    """Elastic parts that resist: net, springs, cables of the antenna."""
    friction: Factor
    """Dry and viscous friction in joints; the coefficients of the pulleys."""
    gravity: Factor
    """Weight that the drive lifts, on ground."""
    load: Factor
    """Forces on the V-joints that fold the ring."""
    latch: Factor
    """What latches take until they catch."""
    driving_spring: Factor
    """Share of a spring's computed torque that counts as drive."""
    motorisation: Annotated[float, Field(ge=1.0, le=100.0), Unit("1")]
    """Of the sum of all factored resistances."""

    keep_speed: bool = False
    """Whether winches must keep their commanded speed, with the viscous friction that comes of it;
    else it is enough that they wind, however slowly."""

    def factor(self, category: Category) -> float:
        """The factor of a category of resistance."""
        return float(getattr(self, category))
