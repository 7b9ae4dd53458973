"""A rigid boom."""

from typing import Literal

from ringsim.parts.boom.family import Boom


class RigidBoom(Boom):
    """A boom without deformation: its inertia joins the upper hinge assembly's."""

    kind: Literal["rigid"] = "rigid"
    joint: Literal["sleeve", "prismatic"] = "sleeve"
    """How the lower hinge assembly slides along the boom.

    sleeve: on its axis, free to turn (a point on a line); prismatic: it cannot turn against the
    boom, as paper 002 has it (eq. 8)."""
