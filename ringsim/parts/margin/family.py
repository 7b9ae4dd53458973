"""The family of standards for the margin of a drive."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.units import Model, Unit

Factor = Annotated[float, Field(ge=0.0, le=100.0), Unit("1")]
Category = Literal["inertia", "spring", "friction", "gravity", "load", "latch"]
"""What a standard tells apart; every kind of resistance belongs to one."""


class MarginStandard(Model):
    """Factors by which a standard takes resistances as larger than computed.

    With Q what the drive gives, R_k the resistances, I the inertia of parts that a commanded speed
    accelerates, f the factors:

        margin = Q / (motorisation * sum f_k R_k + f_I I) - 1,   required: >= 0.

    Q is computed with the friction of the pulleys, and what gears and drums lose, multiplied by
    ``friction``: what they take is a share of the tension, so that losses multiply along the chain.
    Springs that drive are part of Q, times ``driving_spring``.
    """

    inertia: Factor
    """Of the moving parts where ``keep_speed`` accelerates them; beside the sum that
    ``motorisation`` multiplies."""
    spring: Factor
    """Elastic parts that resist: net, springs, cables of the antenna."""
    friction: Factor
    """Dry and viscous friction in joints; the coefficients of the pulleys; losses of gears and
    drums."""
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
