"""The spacecraft that carries the boom."""

from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.units import Kilogram, ListIn, Model, SignedMetre, Unit

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

    def check(self, scene: Any) -> None:
        """Raise a ValueError where a scene has nothing that a spacecraft could carry."""
        if scene.boom is None:
            raise ValueError(
                "spacecraft needs a boom, whose upper end it holds: add [boom], or leave the "
                "spacecraft out"
            )
        if scene.boom.base != "free":
            raise ValueError(
                f'boom.base = "{scene.boom.base}" must be "free" with a spacecraft, which moves: '
                "change it, or leave the spacecraft out"
            )

    @property
    def inertia_at_mount(self) -> NDArray[np.float64]:
        """Inertia about the boom's upper end, shape (3, 3), kg m^2."""
        c = np.array(self.centre)
        away = c @ c * np.eye(3) - np.outer(c, c)
        return np.asarray(np.diag(self.inertia) + self.mass * away)
