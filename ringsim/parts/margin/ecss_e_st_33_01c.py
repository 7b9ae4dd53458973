"""The margin of the European standard for mechanisms."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.margin.family import Factor, MarginStandard
from ringsim.units import Unit


class EcssMechanisms(MarginStandard):
    """Actuation at least 2 (1.1 I + 1.2 S + 1.5 H_M + 3 (F_R + H_Y + H_A + H_D)), no help of speed.

    Source: ECSS-E-ST-33-01C (6 March 2009), 4.7.5.3: I inertia, S springs, F_R friction; motor
    losses H_M belong to the motor's line here, hysteresis, adhesion and harness have no model.
    Rev. 1 (2017) and Rev. 2 (2019) have not been read: check the factors against the edition that
    a project names.  The standard's deliverable outputs (1.25 F_D + F_L) are none on a ring.
    """

    kind: Literal["ecss-e-st-33-01c"] = "ecss-e-st-33-01c"
    inertia: Factor = 1.1
    spring: Factor = 1.2
    friction: Factor = 3.0
    """1.5 for friction that was measured on the part in its environment."""
    gravity: Factor = 1.1
    """Inferred: the clause is for flight; weight is known as well as inertia is."""
    load: Factor = 1.1
    """Inferred: the clause has no such line on the resisting side; a prescribed force is known as
    well as inertia is."""
    latch: Factor = 3.0
    """Inferred: taken like friction."""
    driving_spring: Factor = 0.8
    motorisation: Annotated[float, Field(ge=1.0, le=100.0), Unit("1")] = 2.0
