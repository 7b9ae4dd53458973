"""A flexible boom."""

from typing import Annotated, Literal

from pydantic import Field

from ringsim.parts.boom.family import Boom
from ringsim.units import Pascal


class FlexibleBoom(Boom):
    """A chain of ANCF cable elements (axial and bending stiffness, no torsion).

    Torsion is not needed: the lower hinge assembly slides in a sleeve, which transmits no torque.
    Only a rigid boom can hold its rotations, too.
    """

    kind: Literal["flexible"] = "flexible"
    elements: Annotated[int, Field(ge=1, le=64)] = 4
    """Beam elements along the boom."""
    young_modulus: Pascal = 120e9
    """Young's modulus of the tube."""
