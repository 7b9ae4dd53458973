"""What the antenna must not be driven past."""

import math
from typing import Annotated

from pydantic import Field

from ringsim.units import Degree, MetreOrZero, Model, SecondOrZero, Stress, Tension


class Limits(Model):
    """Bounds past which a run has the outcome "overloaded", or "slackened" by slack ropes.

    A V-joint past ``overrun`` or a rope past ``rope_strain`` ends the run: the model means nothing
    beyond.  The others are allowables: the run goes on and shows by how much they are passed.
    """

    overrun: Annotated[Degree, Field(gt=0.0, le=90.0)] = 3.0
    """Angle by which a V-joint may be past its stop: rings that open as they should go 0.1 to
    0.2 deg deep into the default stop, 10 N m hold it at 3 deg."""
    rope_strain: Annotated[float, Field(gt=0.0, le=1.0)] = 0.25
    """Largest strain of a rope: aramid breaks at 2 to 4 %, but models may have soft ropes.  It ends
    the run: a winch that pulls at a jammed pulley next to it would reach any tension."""
    tension: Tension | None = None
    """Largest tension of any span of a cable, at any time of the run."""
    rod_stress: Stress | None = None
    """Largest axial + bending stress of any rod; needs ``record.stress = true``."""
    slack_duration: SecondOrZero | None = None
    """Longest time for which any span may be slack without a break, before its plane has locked: a
    rope that is slack for longer may leave its pulleys, and the outcome is "slackened"."""
    slack_length: MetreOrZero = 1e-4
    """Free rope in a span, beyond its length, from which on that counts.  With s of it L metre of
    span sag by sqrt(3 L s / 8), 0.4 m with 0.1 mm by 4 mm, about as deep as the groove of a small
    pulley."""

    @property
    def farthest(self) -> float:
        """``overrun`` in rad."""
        return math.radians(self.overrun)
