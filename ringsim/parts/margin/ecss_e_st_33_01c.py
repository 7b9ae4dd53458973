"""The margin of the European standard for mechanisms."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.margin.family import Factor, MarginStandard
from ringsim.units import Unit


class EcssMechanisms(MarginStandard):
    """Actuation at least 2 (1.1 I + 1.2 S + 1.5 H_M + 3 (F_R + H_Y + H_A + H_D)) + 1.25 F_D + F_L,
    no help of speed.

    Source: ECSS-E-ST-33-01C (6 March 2009), 4.7.5.3: I inertia in an accelerated frame, S springs,
    F_R friction, also of gears; F_D inertia at a motion that is asked for (``keep_speed``).  Motor
    losses H_M belong to the motor's line here, hysteresis, adhesion and harness have no model, and
    no force F_L is delivered.  Rev. 1 (2017) and Rev. 2 (2019) have not been read: check the
    factors against the edition that a project names.
    """

    kind: Literal["ecss-e-st-33-01c"] = "ecss-e-st-33-01c"
    inertia: Factor = 1.25
    """F_D of the clause."""
    spring: Factor = 1.2
    friction: Factor = 3.0
    """1.5 for friction that was measured on the part in its environment; gears with it."""
    gravity: Factor = 1.1
    """Inferred: the clause is for flight; weight is known as well as inertia is."""
    load: Factor = 1.1
    """Inferred: the clause has no such line on the resisting side; a prescribed force is known as
    well as inertia is."""
    latch: Factor = 3.0
    """Inferred: taken like friction."""
    driving_spring: Factor = 0.8
    motorisation: Annotated[float, Field(ge=1.0, le=100.0), Unit("1")] = 2.0
