"""Standards for the margin of a drive."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.units import Model, Unit

# The family of standards for the margin of a drive.


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


# The margin of the European standard for mechanisms.


class EcssMechanisms(MarginStandard):
    """Actuation at least 2 (1.1 inertia + 1.2 springs + 1.5 losses of the motor + 3 (friction +
    hysteresis + adhesion + harness)) + 1.25 inertia of a motion that is asked for + force to be
    delivered, no help of speed.

    Source: ECSS-E-ST-33-01C (6 March 2009), 4.7.5.3, where these are I, S, H_M, F_R, H_Y, H_A,
    H_D, F_D and F_L.  I is of parts in an accelerated frame.  Gears count as friction.  Losses of
    the motor belong to the motor's line here; hysteresis, adhesion and harness have no model, and
    no force is delivered.  Rev. 1 (2017) and Rev. 2 (2019) have not been read: check the factors
    against the edition that a project names.
    """

    kind: Literal["ecss-e-st-33-01c"] = "ecss-e-st-33-01c"
    inertia: Factor = 1.25
    """F_D of the clause, the inertia of a motion that is asked for; its I, of parts in an
    accelerated frame, has no model."""
    spring: Factor = 1.2
    friction: Factor = 3.0
    """1.5 for friction that was measured on the part in its environment; gears with it."""
    gravity: Factor = 1.1
    """Inferred: the clause is for flight; weight is known as well as inertia is."""
    load: Factor = 1.1
    """Inferred: F_L of the clause is a force to be delivered, and none is; a prescribed force that
    folds the ring has no line there, and is known as well as inertia is."""
    latch: Factor = 3.0
    """Inferred: taken like friction."""
    driving_spring: Factor = 0.8
    motorisation: Annotated[float, Field(ge=1.0, le=100.0), Unit("1")] = 2.0


# The margin of NASA's standard for mechanisms.


class NasaMechanisms(MarginStandard):
    """Available torque over the sum of factored resisting torques, less 1, at least 0.

    Source: NASA-STD-5017B (6 December 2022), torque margin, second-hand: variable torques 3, fixed
    ones 1.5, accelerations 1.25 where shown by analysis (2, 1.25 and 1.1 by an acceptance test at
    the extremes).  To be checked against the standard's text.  That friction and latches are
    variable, springs, weight and loads fixed, is inferred.
    """

    kind: Literal["nasa-std-5017b"] = "nasa-std-5017b"
    inertia: Factor = 1.25
    spring: Factor = 1.5
    friction: Factor = 3.0
    gravity: Factor = 1.5
    load: Factor = 1.5
    latch: Factor = 3.0
    driving_spring: Factor = 1.0
    """Inferred: no share is named in what was read."""
    motorisation: Annotated[float, Field(ge=1.0, le=100.0), Unit("1")] = 1.0
