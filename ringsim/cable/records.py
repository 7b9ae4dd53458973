"""Records of the cables of a scene and their winches."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ringsim.cable import regularisation
from ringsim.cable.bracket.bisector import BisectorBracket
from ringsim.cable.bracket.family import Bracket
from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.friction.frictionless import Frictionless
from ringsim.cable.winding.family import FeedbackWinding, PrescribedWinding, Winding
from ringsim.cable.winding.stall import StallWinding
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

LEAST_HELD = 1e-3
"""Tension that a winch keeps whose rope is slack when its plane locks, N: next to nothing."""
RESTING = 1e-2
"""A motor that answers to the tension stands still below this share of its usual speed: it comes to
rest exponentially, never quite, and a ring that just counts as resting takes up 0.7 % on
``ring18-motor`` (``ringsim.stepping.rest``)."""


class Winch(Model):
    """A motor with a drum: a winding law between a start and a stop."""

    winding: AnyWinding
    """Rope taken up over time, or as the tension asks."""
    start_time: SecondOrZero = 0.0
    """Start of the law's time; the drum stands still before."""
    stop_time: SecondOrZero | None = None
    """The drum stands still from here on."""
    after_lock: Literal["stop", "hold", "pull"] = "stop"
    """What the winch does once all V-joints of its plane have locked, with latches once these hold:
    stand still, keep the tension that it has then (by winding alone where rope cannot turn it
    back), or go on with its law."""

    @model_validator(mode="after")
    def _in_order(self) -> "Winch":
        if self.stop_time is not None and self.stop_time < self.start_time:
            raise ValueError(
                f"stop_time = {self.stop_time} s must not be before start_time = "
                f"{self.start_time} s"
            )
        return self

    def breaks(self) -> list[float]:
        """Times at which the winch starts or stops, or its law bends, s."""
        bends = [self.start_time + time for time in (0.0, *self.winding.breaks())]
        if self.stop_time is None:
            return bends
        return [*(time for time in bends if time < self.stop_time), self.stop_time]

    def turns(self, time: float) -> bool:
        """Whether the motor is switched on at a time (s)."""
        return self.start_time <= time and (self.stop_time is None or time < self.stop_time)

    def at(
        self, time: float, held: float = 0.0, *, moment: float | None = None
    ) -> tuple[float, float]:
        """Rope wound (m) and its rate (m/s) at a time (s) by a prescribed law.

        A law with feedback prescribes neither: the drum holds the rope that it has, ``held``.
        Where the rate jumps it is that of a ``moment`` (s) beside that time.
        """
        moment = time if moment is None else moment
        if not isinstance(self.winding, PrescribedWinding):
            return held, 0.0
        last = time if self.stop_time is None else min(time, self.stop_time)
        clock = max(last - self.start_time, 0.0)
        running = max(moment - self.start_time, 0.0)
        rate = self.winding.wound_rate(running) if self.turns(moment) else 0.0
        return self.winding.wound(clock), rate

    def locked(self, time: float, tension: float) -> Self:
        """The winch after its plane has locked at a time (s), when it had this tension (N)."""
        speed = self.winding.usual_speed()
        if self.after_lock == "pull" or (self.stop_time is not None and self.stop_time <= time):
            return self
        if self.after_lock == "stop" or speed == 0.0 or time < self.start_time:
            return self.model_copy(update={"stop_time": max(time, self.start_time)})
        # A winch of prescribed speed has a motor for it; a gear that locks itself gives no rope.
        back = not isinstance(self.winding, FeedbackWinding) or self.winding.limits()[0] < 0.0
        hold = StallWinding(speed=speed, max_tension=max(tension, LEAST_HELD), backdrivable=back)
        # "pull": this law is what it does after the lock, and stays as it is.
        return self.model_copy(update={"winding": hold, "after_lock": "pull"})

    def drives(self, time: float, rate: float) -> bool:
        """Whether the drum turns at a time (s), at a rate (m/s), or will turn."""
        if not self.turns(time):
            return time < self.start_time and self.start_time != self.stop_time
        if isinstance(self.winding, PrescribedWinding):
            return time - self.start_time < self.winding.rests_from()
        return abs(rate) > RESTING * self.winding.usual_speed()


class Cable(Model):
    """A cable over the pulleys of its plane; see ``ringsim.cable.chain`` for the equations."""

    end: Literal["first", "last", "both"] = "first"
    """Where the winch is: at section 1, at the last section, or one at either end."""
    winch: Winch
    """Motor at the beginning of the path, or, with two, the one at section 1."""
    far_winch: Winch | None = None
    """With end = "both", the winch at the last section; left out, it is like the first."""
    axial_stiffness: AxialStiffness = 1e5
    """Young's modulus times cross-section (EA)."""
    damping_time: SecondOrZero = 0.0
    """Kelvin-Voigt time t_d: stress = E (strain + t_d * strain rate)."""
    pulley_radius: Metre = 0.01
    """Radius R of the pulleys in the laws of friction; spans run between their centres."""
    friction: AnyFriction = Frictionless()
    """Law by which tension falls over a pulley."""
    slip_speed: PositiveSpeed | None = None
    """Rope speed over a pulley at which 76 % of its friction acts; left out, it follows the winding
    (``ringsim.cable.regularisation``)."""
    slack_width: Annotated[Tension, Field(ge=1e-6)] = 0.05
    """Width of the transition from slack to taut; tension at the natural length is 0.69 of it."""
    initial_slack: SignedMetre = 0.0
    """Natural length minus path length at the start; negative: the cable is pre-stretched."""
    block_offset: MetreOrZero = 0.105
    """Distance of the V pulleys from the V-joint's axis; at 0 a cable does no work.  Source: h in
    paper 000, fig. 3, with a value inferred from its deployment time."""
    bracket: AnyBracket = BisectorBracket()
    """What holds the V pulleys: a block on the bisector, or an element fixed to a bar half."""

    @model_validator(mode="after")
    def _usable(self) -> "Cable":
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

    @property
    def winches(self) -> tuple[Winch, ...]:
        """The winch at the path's beginning, and the one at its end if there is one."""
        return (self.winch, self.far_winch or self.winch)[: 1 + (self.end == "both")]


class Cables(Model):
    """Driving cables along the ring, each with its own winch, friction and faults.

    The path of a cable: winch, then for every section the pulleys on its first hinge assembly, its
    V-joint's block and its second hinge assembly.  With one winch the last of these holds the
    cable's end: N sections have 3 N spans and 3 N - 1 pulleys.  With a winch at either end the rope
    runs over it as well: 3 N + 1 spans and 3 N pulleys.  Source: paper 000, figs 1-3.
    """

    upper: Cable | None = None
    """Cable in the upper plane."""
    lower: Cable | None = None
    """Cable in the lower plane."""
    winch_distance: Metre = 0.3
    """From a winch to its nearest pulley, along the boom; that span keeps its length."""

    @model_validator(mode="after")
    def _any(self) -> "Cables":
        if self.upper is None and self.lower is None:
            raise ValueError("upper or lower must hold a cable (or leave out the whole table)")
        return self

    def present(self) -> list[tuple[int, Cable]]:
        """The cables that there are, with the number of their plane (0 upper, 1 lower)."""
        both = ((0, self.upper), (1, self.lower))
        return [(plane, cable) for plane, cable in both if cable is not None]
