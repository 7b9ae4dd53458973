"""Gravity."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from ringsim.units import ListIn, Model, Unit


def _some(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError(
            f"gravity.vector = {list(vector)} m/s^2 must not be zero: leave gravity out"
        )
    return vector


_Acceleration = Annotated[float, Field(ge=-1e3, le=1e3), Unit("m/s^2")]


class Gravity(Model):
    """A uniform field: every mass m has the weight m times ``vector``, in the axes of space.

    z is the ring's own axis at the start, and z = 0 where its boom ends: ``[0.0, 0.0, -9.81]`` is a
    ring whose axis stands upright on the ground.
    """

    vector: Annotated[
        tuple[_Acceleration, _Acceleration, _Acceleration], ListIn, AfterValidator(_some)
    ]
    """Acceleration of what falls freely, along x, y and z of space."""

    def check(self, scene: Any) -> None:
        """Raise a ValueError where nothing would carry the weight."""
        if not scene.held and scene.offload is None:
            raise ValueError(
                f"gravity.vector = {list(self.vector)} m/s^2 on a free base: the structure would "
                'fall: hold it (boom.base = "fixed"), hang it up ([offload]), or leave gravity out'
            )
