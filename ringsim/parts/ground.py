"""What acts from outside: gravity, loads, and the lines and trolleys of a ground test."""

from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field

from ringsim.parts.laws import Array
from ringsim.units import (
    KilogramOrZero,
    ListIn,
    Model,
    Newton,
    PerSection,
    PositiveSpeed,
    Second,
    SpringRate,
    Unit,
)

if TYPE_CHECKING:
    from ringsim.scene import Scene

# Gravity.


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

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError where nothing would carry the weight, or lines would carry what they
        are not meant to.
        """
        if scene.held:
            return
        where = f"gravity.vector = {list(self.vector)} m/s^2 on a free base"
        if scene.offload is None:
            if scene.spacecraft is not None:
                raise ValueError(
                    f"{where} with a spacecraft: the structure would fall: leave gravity out; or "
                    'leave [spacecraft] out and fix the structure (boom.base = "fixed") or '
                    "suspend it ([offload])"
                )
            raise ValueError(
                f'{where}: the structure would fall: fix it (boom.base = "fixed"), suspend it '
                "([offload]), or leave gravity out"
            )
        if scene.spacecraft is not None:
            raise ValueError(
                f"{where} with a spacecraft of {scene.spacecraft.mass:g} kg: the lines of "
                "[offload] would carry it: leave [spacecraft] out, or leave gravity out"
            )
        residual = scene.offload.mean_residual  # of values that sum to zero round-off is left
        if abs(residual) > 1e-12 and scene.offload.stiffness == 0.0:
            raise ValueError(
                f"offload.residual = {residual:g} (mean) on a free base: nothing carries the "
                "rest of the weight, and the structure would "
                f"{'fall' if residual > 0.0 else 'rise'}: give offload.stiffness, a mean "
                'residual of 0, or hold the base (boom.base = "fixed")'
            )


# Prescribed forces.


class Loads(Model):
    """Constant forces on the V-joints along z: +force on the upper, -force on the lower ones.

    Positive forces open the ring, negative ones fold it.  They keep their direction in space: a
    free ring that pitches turns under them, so that each pair of forces +F and -F, a height h apart
    in the ring and pitched by t, has the moment F h sin(t) that turns it back, and does the work of
    h cos(t) instead of h.  docs/guide/loads.md says how much that is.  Source: paper 002.
    """

    force: PerSection[Newton]
    """Force on the V-joints of a section, up on the upper and down on the lower one."""
    reversal_time: Second | None = None
    """From this time on all forces act the other way round, as where a ring is folded and then
    deployed in one run, which no stop that it reaches before ends.  Left out, they never do."""


# The suspension that carries a structure's weight in a ground test.


_Share = Annotated[float, Field(ge=-1.0, le=1.0), Unit("1")]


class Hold(NamedTuple):
    """What lines do to their corners, n of them: forces (n, 3), N, of which ``friction`` resists
    the corners' motion; and energy of the springs, J.
    """

    force: Array
    friction: Array
    stored: float


class Offload(Model):
    """Lines from trolleys on an ideal rail grid above to corners; lines hang along gravity.

    Every chosen corner's line carries its hinge assembly and an equal share of all that hangs
    between the chosen corners, less ``residual`` of both; where the base is fixed, it carries the
    share of its own corner.  A line pulls with T = that + stiffness * drop, and its trolley
    follows at once: the corner feels its mass along the grid, and friction * |T| against its
    velocity v there, smooth below ``friction_speed``: v / sqrt(|v|^2 + friction_speed^2).
    """

    planes: Literal["upper", "lower", "both"] = "upper"
    """Planes whose corners hang on lines."""
    corners: Annotated[tuple[Annotated[int, Field(ge=1)], ...], ListIn] = ()
    """Numbers of the corners in each plane, from 1 (at the boom) on; none given: all."""
    stiffness: SpringRate = 0.0
    """Of each line with what it hangs on: a counterweight has none."""
    residual: PerSection[_Share] = 0.0
    """Share of its weight that a line does not carry (negative: carries too much)."""
    friction: Annotated[float, Field(ge=0.0, le=1.0), Unit("1")] = 0.0
    """Friction of a trolley over the tension of its line."""
    friction_speed: PositiveSpeed = 1e-3
    """Speed below which the friction passes smoothly through zero."""
    trolley_mass: KilogramOrZero = 0.0
    """Of each trolley, which its corner moves along the grid."""

    @property
    def mean_residual(self) -> float:
        """Of the chosen corners."""
        each = np.atleast_1d(self.residual)
        chosen = [corner - 1 for corner in self.corners] if len(each) > 1 else []
        return float(each[chosen or slice(None)].mean())

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError where there is no weight, or no such corner."""
        if scene.gravity is None:
            raise ValueError(
                "offload compensates gravity, and the scene has none: add [gravity], or leave "
                "offload out"
            )
        count = scene.structure.sections + (0 if scene.structure.closed else 1)
        for k, corner in enumerate(self.corners, 1):
            if corner > count:
                raise ValueError(
                    f"offload.corners[{k}] = {corner} must be at most {count}: this structure has "
                    "no such corner"
                )
        for k, corner in enumerate(self.corners, 1):
            if corner in self.corners[: k - 1]:
                raise ValueError(
                    f"offload.corners[{k}] = {corner} names a corner twice: leave one of them out"
                )

    def hold(self, up: Array, lifts: Array, moved: Array, rates: Array) -> Hold:
        """Of lines that carry ``lifts`` (n,), N, at the start, of corners that have moved since, m,
        and move, m/s, shape (n, 3) each; ``up`` is a unit vector.
        """
        drop = -moved @ up
        tension = lifts + self.stiffness * drop
        across = rates - (rates @ up)[:, None] * up
        speed = np.sqrt(np.sum(across**2, axis=1) + self.friction_speed**2)
        friction = -(self.friction * np.abs(tension) / speed)[:, None] * across
        stored = 0.5 * self.stiffness * float(drop @ drop)
        return Hold(tension[:, None] * up + friction, friction, stored)

    def slopes(
        self, up: Array, lifts: Array, moved: Array, rates: Array, rate_by_place: float
    ) -> Array:
        """Derivatives of the forces after the places, whose rates follow them, (n, 3, 3), N/m."""
        tension = lifts - self.stiffness * (moved @ up)
        level = np.eye(3) - np.outer(up, up)
        across = rates @ level
        speed = np.sqrt(np.sum(across**2, axis=1) + self.friction_speed**2)
        along = across / speed[:, None]
        bent = (level - along[:, :, None] * along[:, None, :]) / speed[:, None, None]
        # Where a line pushes its trolley does not drive it.
        pressed, rises = self.friction * np.abs(tension), self.friction * np.sign(tension)[:, None]
        found = -self.stiffness * (up - rises * along)[:, :, None] * up
        return np.asarray(found - pressed[:, None, None] * rate_by_place * bent)
