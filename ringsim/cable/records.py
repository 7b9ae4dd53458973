"""Records of a cable and its winches."""

from __future__ import annotations

from typing import Annotated, Literal

from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from ringsim.cable import regularisation
from ringsim.cable.bracket.bisector import BisectorBracket
from ringsim.cable.bracket.family import Bracket
from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.friction.frictionless import Frictionless
from ringsim.cable.ropes import Array
from ringsim.cable.winding.family import PrescribedWinding, WinchState, Winding
from ringsim.choice import OneOf
from ringsim.units import (
    AxialStiffness,
    Metre,
    MetreOrZero,
    Model,
    PositiveSpeed,
    SecondOrZero,
    SignedMetre,
    Tension,
)

AnyBracket = Annotated[Bracket, OneOf()]
AnyFriction = Annotated[PulleyFriction, OneOf()]
AnyWinding = Annotated[Winding, OneOf()]


class Winch(Model):
    """A motor with a drum: a winding law between a start and a stop."""

    winding: AnyWinding
    start_time: SecondOrZero = 0.0
    """Start of the law's time; the drum stands still before."""
    stop_time: SecondOrZero | None = None
    """The drum stands still from here on."""

    @model_validator(mode="after")
    def _in_order(self) -> Winch:
        if self.stop_time is not None and self.stop_time < self.start_time:
            raise ValueError(
                f"stop_time = {self.stop_time} s must not be before start_time = "
                f"{self.start_time} s"
            )
        return self

    @property
    def feedback(self) -> bool:
        """Whether its law depends on the tension (``ringsim.cable.winches``)."""
        return self.winding.feedback

    def turns(self, time: float) -> bool:
        """Whether the motor is switched on at a time (s)."""
        return self.start_time <= time and (self.stop_time is None or time < self.stop_time)

    def at(self, time: float, state: WinchState) -> WinchState:
        """Rope wound and its rate at a time within the present step.

        A prescribed law answers exactly and ignores ``state``; one with feedback goes on from
        ``state`` at the speed held.
        """
        if isinstance(self.winding, PrescribedWinding):
            last = time if self.stop_time is None else min(time, self.stop_time)
            clock = max(last - self.start_time, 0.0)
            rate = self.winding.wound_rate(clock) if self.turns(time) else 0.0
            return WinchState(time, self.winding.wound(clock), rate)
        return state.at(time)


class Cable(Model):
    """A cable over the pulleys of its plane, with a winch at one end or both.

    Its tension falls from the winch on; see ``ringsim.cable.chain`` for the equations.
    """

    end: Literal["first", "last", "both"] = "first"
    """Where the winch is: at section 1, at the last section, or one at either end."""
    winch: Winch
    far_winch: Winch | None = None
    """With end = "both", the winch at the last section, as far from its pulley as the first one
    from its own; left out, it is like the first."""
    axial_stiffness: AxialStiffness = 1e5
    """Young's modulus times cross-section (EA)."""
    damping_time: SecondOrZero = 0.0
    """Kelvin-Voigt time t_d: stress = E (strain + t_d * strain rate)."""
    pulley_radius: Metre = 0.01
    friction: AnyFriction = Frictionless()
    slip_speed: PositiveSpeed | None = None
    """Rope speed over a pulley at which 76 % of its friction acts (regularisation).  Left out, it
    follows the winding: see ``ringsim.cable.regularisation``."""
    slack_width: Annotated[Tension, Field(ge=1e-6)] = 0.05
    """Width of the transition from slack to taut; tension at the natural length is 0.69 of it."""
    initial_slack: SignedMetre = 0.0
    """Natural length minus path length at the start; negative: the cable is pre-stretched."""
    block_offset: MetreOrZero = 0.105
    """Distance of the V pulleys from the V-joint's axis; the bracket says in which direction.

    Without it the V pulley would sit on the axis, its spans would keep their lengths and the
    cable would do no work.  Source: h in paper 000, fig. 3; the value is inferred from its
    deployment time.
    """

    bracket: AnyBracket = BisectorBracket()
    """What holds the V pulleys: a block on the bisector, or an element fixed to a bar half."""

    @model_validator(mode="after")
    def _usable(self) -> Cable:
        reason = self.friction.refusal(self.pulley_radius)
        if reason is not None:
            raise ValueError(reason)
        if self.far_winch is not None and self.end != "both":
            raise ValueError(
                f'far_winch needs end = "both", but end = "{self.end}" (leave one of them out)'
            )
        return self

    def slip_speed_over(self, pulleys: int) -> float:
        """The slip speed of the scene, or the one that follows the winding, m/s."""
        if self.slip_speed is not None:
            return self.slip_speed
        winding = sum(winch.winding.usual_speed() for winch in self.winches)
        return regularisation.slip_speed(winding, pulleys)

    def path_slope(self, half_bar: float, opening: ArrayLike) -> Array:
        """Derivative of one section's path after its opening angle (rad), m/rad."""
        return self.bracket.path_slope(half_bar, self.block_offset, opening)

    @property
    def winches(self) -> tuple[Winch, ...]:
        """The winch at the path's beginning, and the one at its end if there is one."""
        if self.end != "both":
            return (self.winch,)
        return (self.winch, self.far_winch or self.winch)
