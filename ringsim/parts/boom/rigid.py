"""A rigid boom."""

from typing import Literal

from ringsim.parts.boom.family import Boom


class RigidBoom(Boom):
    """A boom without deformation: its inertia joins the upper hinge assembly's."""

    kind: Literal["rigid"] = "rigid"
