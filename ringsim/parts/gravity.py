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
        """Raise a ValueError where nothing would carry the weight, or lines would carry what they
        are not meant to.
        """
        if scene.held:
            return
        where = f"gravity.vector = {list(self.vector)} m/s^2 on a free base"
        if scene.offload is None:
            raise ValueError(
                f"{where}: the structure would fall: hold it "
                '(boom.base = "fixed"), hang it up ([offload]), or leave gravity out'
            )
        if scene.spacecraft is not None:
            raise ValueError(
                f"{where} with a spacecraft of {scene.spacecraft.mass:g} kg: the lines of "
                "[offload] would carry it: leave [spacecraft] out, or leave gravity out"
            )
        residual = scene.offload.mean_residual  # of values that sum to zero round-off is left
        if abs(residual) > 1e-12 and scene.offload.stiffness == 0.0:
            raise ValueError(
                f"offload.residual = {residual:g} (mean) on a free base: lines of constant force "
                "leave that share of the weight to nothing, and the structure would "
                f"{'fall' if residual > 0.0 else 'rise'}: give offload.stiffness, a mean residual "
                'of 0, or hold the base (boom.base = "fixed")'
            )
