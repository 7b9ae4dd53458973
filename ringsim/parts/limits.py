"""What the antenna must not be driven past."""

import math
from typing import Annotated

from pydantic import Field

from ringsim.units import Degree, Model, Stress, Tension


class Limits(Model):
    """Bounds past which a run has the outcome "overloaded".

    A V-joint driven past ``overrun`` ends the run: the model of joint and stop means nothing
    beyond.  The other two are allowables: the run goes on and shows by how much they are passed.
    """

    overrun: Annotated[Degree, Field(gt=0.0, le=90.0)] = 10.0
    """Angle by which a V-joint may be past its stop: impacts of rings that open as they should go
    0.2 to 1 deg deep into the default stop, 35 N m hold it at 10 deg."""
    tension: Tension | None = None
    """Largest tension of any span of a cable, at any time of the run."""
    rod_stress: Stress | None = None
    """Largest axial + bending stress of any rod; needs ``record.stress = true``."""

    @property
    def farthest(self) -> float:
        """``overrun`` in rad."""
        return math.radians(self.overrun)
