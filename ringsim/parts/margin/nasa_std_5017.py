"""The margin of NASA's standard for mechanisms."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.margin.family import Factor, MarginStandard
from ringsim.units import Unit


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
