"""Friction of the joint families."""

from typing import Annotated

from ringsim.choice import OneOf
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.units import Model

AnyJointFriction = Annotated[JointFriction, OneOf(default="viscous-coulomb")]


class Joints(Model):
    """Friction of each joint family; a family left out is free of friction."""

    pivot: AnyJointFriction | None = None
    """Crossing of the diagonals."""
    hinge: AnyJointFriction | None = None
    """The four revolutes of every hinge assembly."""
    vjoint: AnyJointFriction | None = None
    """Middle of the folding bars."""

    def present(self) -> dict[str, JointFriction]:
        """The laws that there are, by family."""
        return {family: law for family, law in self if law is not None}
