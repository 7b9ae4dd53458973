"""A spring with a measured torque."""

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.parts.hinge_spring.family import HingeSpring
from ringsim.parts.springs import Reaction
from ringsim.units import ListIn, Unit

Angle = Annotated[float, Field(ge=0.0, le=180.0), Unit("deg")]
SignedTorque = Annotated[float, Field(ge=-1e5, le=1e5), Unit("N m")]


class TableSpring(HingeSpring):
    """Torques at opening angles, joined by lines; as at the ends before and behind them."""

    kind: Literal["table"] = "table"
    angles: Annotated[tuple[Angle, ...], ListIn, Field(min_length=2, max_length=50)]
    """Opening angles, increasing."""
    torques: Annotated[tuple[SignedTorque, ...], ListIn]
    """Torques there; positive ones open the joint."""

    @model_validator(mode="after")
    def _usable(self) -> "TableSpring":
        if len(self.torques) != len(self.angles):
            raise ValueError(
                f"torques has {len(self.torques)} values, but angles has {len(self.angles)}: give "
                "one torque for each angle"
            )
        late = [b for a, b in pairwise(self.angles) if b <= a]
        if late:
            raise ValueError(f"angles = ... {late[0]:g} deg must be above the angle before it")
        return self

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """See ``HingeSpring``: one table for all."""
        return self

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        # From the deployed end on: each piece adds what lies within its own angles.
        points = [
            (math.radians(180.0 - angle), torque)
            for angle, torque in zip(self.angles[::-1], self.torques[::-1], strict=True)
        ]
        torque, stored = points[0][1] + 0.0 * folded, points[0][1] * folded
        for (near, first), (far, last) in pairwise(points):
            slope = (last - first) / (far - near)
            inside = xp.minimum(xp.maximum(folded - near, 0.0), far - near)
            beyond = xp.maximum(folded - far, 0.0)
            torque = torque + slope * inside
            stored = stored + slope * inside * (0.5 * inside + beyond)
        return Reaction(torque, 0.0 * folded, stored)
