"""The boom that a structure stands on, and the spacecraft that carries it."""

from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.parts.rods import Tube
from ringsim.units import Density, Kilogram, ListIn, Metre, Model, Pascal, SignedMetre, Unit

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The family of booms.


class Boom(Model):
    """The vertical tube at the first corner: fixed to the upper hinge assembly, while the
    lower one slides along it.

    Source: papers 000 and 002.  The length is inferred: the printed 0.2889 m is shorter than
    the ring is high, so the lower hinge assembly would slide off.
    """

    base: Literal["free", "fixed"] = "free"
    """free: the ring floats with its boom; fixed: the boom's upper end is clamped."""
    length: Metre = 0.9
    """Length of the tube, at least that of a diagonal: the height of a ring folded wholly."""
    tube: Tube = Tube(outer_diameter=0.06, inner_diameter=0.058)
    """Cross-section."""
    density: Density = 1800.0
    """Mass over volume of the tube's material."""

    @property
    def sliding(self) -> Literal["sleeve", "prismatic"] | None:
        """The joint of a boom without deformation, which is a part of the body at its top; None of
        one that is a chain of elements.
        """
        return None

    @property
    def mass(self) -> float:
        """Mass in kg."""
        return self.density * self.tube.area * self.length


# A flexible boom.


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


# A rigid boom.


class RigidBoom(Boom):
    """A boom without deformation: its inertia joins the upper hinge assembly's."""

    kind: Literal["rigid"] = "rigid"
    joint: Literal["sleeve", "prismatic"] = "sleeve"
    """How the lower hinge assembly slides along the boom.

    sleeve: on its axis, free to turn (a point on a line); prismatic: it cannot turn against the
    boom, as paper 002 has it (eq. 8)."""

    @property
    def sliding(self) -> Literal["sleeve", "prismatic"]:
        """See ``Boom``."""
        return self.joint


# The spacecraft that carries the boom.


_Moment = Annotated[float, Field(gt=0.0, le=1e7), Unit("kg m^2")]


class Spacecraft(Model):
    """A rigid body at the boom's upper end, which moves and turns freely.

    ``inertia`` are the moments about its centre of mass along x, y and z at the start, which are
    its principal axes; ``centre`` is the place of that centre from the boom's upper end then.
    """

    mass: Kilogram
    """Of the body without boom and ring."""
    inertia: Annotated[tuple[_Moment, _Moment, _Moment], ListIn]
    """About its centre of mass, along x, y and z at the start."""
    centre: Annotated[tuple[SignedMetre, SignedMetre, SignedMetre], ListIn] = (0.0, 0.0, 0.0)
    """Place of its centre of mass from the boom's upper end, at the start."""

    @model_validator(mode="after")
    def _a_body(self) -> Self:
        for k, moment in enumerate(self.inertia):
            rest = sum(self.inertia) - moment
            if moment > rest * (1.0 + 1e-12):
                raise ValueError(
                    f"inertia[{k + 1}] = {moment} kg m^2 must be at most the sum of the others, "
                    f"{rest:.6g} kg m^2: no body has such moments"
                )
        return self

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError where a scene has nothing that a spacecraft could carry."""
        if scene.boom is None:
            raise ValueError(
                "spacecraft needs a boom, whose upper end it is fixed to: add [boom], or leave "
                "the spacecraft out"
            )
        if scene.boom.base != "free":
            raise ValueError(
                f'boom.base = "{scene.boom.base}" must be "free" with a spacecraft, which moves: '
                'change it, or leave the spacecraft out (spacecraft = "none")'
            )

    @property
    def inertia_at_mount(self) -> NDArray[np.float64]:
        """Inertia about the boom's upper end, shape (3, 3), kg m^2."""
        c = np.array(self.centre)
        away = c @ c * np.eye(3) - np.outer(c, c)
        return np.asarray(np.diag(self.inertia) + self.mass * away)
