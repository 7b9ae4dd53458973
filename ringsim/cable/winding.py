"""Winding laws: how much rope a winch has taken up, and how fast."""

import math
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ringsim.units import (
    Ampere,
    GearRatio,
    ListIn,
    Metre,
    Model,
    MotorSpeed,
    PositiveSpeed,
    PositiveTorque,
    Ratio,
    RotorInertia,
    Second,
    SecondOrZero,
    SignedMetre,
    Speed,
    Tension,
    TorqueConstant,
    Unit,
)

# The family of winding laws: how much rope a winch has taken up, and how fast.


class WinchReading(NamedTuple):
    """Readings of a winch at the end of a step that is tried."""

    path_rate: float
    """Rate of the path length and of another winch on the same rope, in m/s: negative while
    the structure gives rope free."""
    path_slope: float
    """Derivative of the ideal path length after the measured opening angle, in m/rad."""
    time: float = math.inf
    """Since the winch has started, at the end of the step, s."""
    lagging: float = 0.0
    """Speed from which the winch has come: at a speed v (m/s) its acceleration is (v - lagging) /
    lag by backward differences."""
    lag: float = math.inf
    """See ``lagging``, s; 0 where no time has passed, so that the speed is what it was."""


class Winding(Model):
    """Any winding law; time counts from the start of its winch."""

    commandable: ClassVar[bool] = False
    """Whether a controller can command its speed."""

    @property
    def motor(self) -> "MotorWinding | None":
        """The motor with its gears, of a law that has one."""
        return None

    @property
    def told_before(self) -> bool:
        """Whether it has what only a run writes, which no scene may give."""
        return False

    def usual_speed(self) -> float:
        """Speed of the winch for most of its time, m/s, as far as known beforehand; never negative.

        The friction of the pulleys is regularised below it (``ringsim.cable.friction``).
        """
        raise NotImplementedError

    def breaks(self) -> tuple[float, ...]:
        """Times at which the law is not smooth, s: steps end there."""
        return ()

    def told(self, speed: float, time: float) -> Self:
        """The law from a time (s) on at which a controller commands a speed (m/s); itself if it
        takes no commands.
        """
        return self

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """Tension against which the winch still winds, N, at its commanded speed or however slowly;
        infinite if it is any.  ``losses`` is how many times the losses of its gear count.
        """
        return math.inf

    def commanded_speed(self) -> float:
        """Speed that the winch is told to keep, in m/s; 0 if none is."""
        return 0.0


class PrescribedWinding(Winding):
    """A law of time alone."""

    def rests_from(self) -> float:
        """Time after which the drum never turns again, s; infinite if it always does."""
        return 0.0 if self.usual_speed() == 0.0 else math.inf

    def wound(self, time: float) -> float:
        """Rope taken up since the start, in metre."""
        raise NotImplementedError

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; the value from the right where it jumps."""
        raise NotImplementedError


class FeedbackWinding(Winding):
    """A law whose speed depends on the tension, solved within the step.

    The rope is so stiff that a speed chosen from the present tension would overshoot within one
    step: the law uses the tension at the end of the step, see ``ringsim.core.winches``.
    """

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s; must not grow with the tension."""
        raise NotImplementedError

    def limits(self) -> tuple[float, float]:
        """Lowest and highest speed that the motor can run at, in m/s."""
        raise NotImplementedError


# Winding at constant speed.


class ConstantWinding(PrescribedWinding):
    """wound = speed * t; a negative speed pays rope out.  Source: paper 000, eq. 32."""

    kind: Literal["constant"] = "constant"
    speed: Speed
    """Rope taken up per second; negative pays out."""

    def usual_speed(self) -> float:
        """The speed, in m/s."""
        return abs(self.speed)

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        return self.speed * time

    def wound_rate(self, time: float) -> float:
        """The speed, in m/s."""
        return self.speed


# Winding by a motor behind a gear.


_BACKWARDS = 10.0
"""Speed up to which a rope turns a motor back, over the motor's without a load: feedback needs a
bound, and where the line has eleven times the torque at standstill no motor is meant any more.
What pulls harder is braked."""


_LEAST_COMMAND = 1e-6
"""Share of the speed without a load that a command keeps from standstill and from that speed: the
command of a motor must lie between them."""
_FOLLOWS = 1e-9
"""Share of its command below which a rotor lags behind it: its speed is the command's number where
it follows."""


class MotorWinding(FeedbackWinding):
    """A motor with a straight torque-speed line, a gear and a drum.

    At the shaft's speed w the motor has at most the torque

        m(w) = derating * min(limit, stall_torque * (voltage - w / no_load_speed)),

    and a rope of tension T asks for T r / (n e) of it while it is wound, for T r e' / n while it
    turns the motor back (r the drum's radius, n the gear's ratio, e and e' its efficiencies).  What
    is over accelerates the rotor, J dw/dt = m(w) - load, up to the commanded speed; without
    ``rotor_inertia`` the motor is in balance with its rope at any time.  The drum stands where the
    motor is too weak to wind and the rope to turn it back, always so if the gear locks itself.
    Turned back it goes along its line, up to ten times its speed without a load.

    >>> motor = MotorWinding(
    ...     no_load_speed=500.0, stall_torque=0.02, gear_ratio=1000.0, efficiency=0.5,
    ...     drum_radius=0.01,
    ... )
    >>> round(motor.stall_tension, 9)  # 0.02 N m * 1000 * 0.5 / 0.01 m
    1000.0
    >>> round(motor.speed_at(500.0), 9)  # half the stalling tension: half the speed of 5 mm/s
    0.0025
    """

    kind: Literal["motor"] = "motor"
    commandable: ClassVar[bool] = True
    no_load_speed: MotorSpeed
    """Of the motor's shaft at the rated voltage."""
    stall_torque: PositiveTorque
    """Of the motor's shaft at the rated voltage."""
    voltage: Annotated[float, Field(gt=0.0, le=2.0), Unit("1")] = 1.0
    """Applied over rated voltage: the line shifts with it, its slope stays."""
    speed: MotorSpeed | None = None
    """Commanded speed of the shaft, kept while the motor has the torque for it; left out, the motor
    runs on its voltage alone."""
    ramp: Second | None = None
    """Time in which the command rises from standstill to ``speed``, as a quintic step; left out, it
    is there at once."""
    rotor_inertia: RotorInertia | None = None
    """Moment of inertia J about the shaft of all that turns with it: rotor, brake, and gear and
    drum divided by their ratios squared; left out, none."""
    torque_limit: PositiveTorque | None = None
    """Largest torque that the motor's drive lets the shaft have."""
    current_limit: Ampere | None = None
    """The same as a current, without that which flows without a load; needs ``torque_constant``."""
    torque_constant: TorqueConstant | None = None
    """Torque of the shaft over current above that without a load; with it a run tells the motor's
    current and electrical power."""
    no_load_current: Ampere | None = None
    """What the motor draws while it turns without a load; left out, none."""
    derating: Ratio = 1.0
    """Share of its torque that the motor has left when hot (or cold)."""
    gear_ratio: GearRatio = 1.0
    """Turns of the shaft for one of the drum."""
    efficiency: Ratio = 1.0
    """Of gear and drum while the motor winds."""
    back_efficiency: Ratio | None = None
    """Of gear and drum while the rope turns the motor back; left out, the gear locks itself."""
    drum_radius: Metre
    """Of the drum that winds the rope."""
    band: Ratio = 0.05
    """Width of the passage to the limited torque, over that torque: the motor has its full speed
    below it and stands still at the limit.  A rotor with inertia needs none."""

    @model_validator(mode="after")
    def _usable(self) -> "MotorWinding":
        for given in ("current_limit", "no_load_current"):
            if getattr(self, given) is not None and self.torque_constant is None:
                raise ValueError(f"{given} needs torque_constant: give both, or neither")
        if self.current_limit is not None and self.torque_limit is not None:
            raise ValueError(
                f"torque_limit = {self.torque_limit} N m and current_limit = {self.current_limit} "
                "A limit the same torque: leave one of them out"
            )
        if self.speed is not None and self.speed >= self.free_speed:
            raise ValueError(
                f"speed = {self.speed} rad/s must be below voltage * no_load_speed = "
                f"{self.free_speed:g} "
                "rad/s: the motor has no torque at its speed (lower it, or raise the voltage)"
            )
        if self.ramp is not None and self.speed is None:
            raise ValueError(
                f"ramp = {self.ramp} s needs speed, the command that rises: give both, or neither"
            )
        return self

    @property
    def motor(self) -> Self:
        """Itself."""
        return self

    @property
    def limit(self) -> float:
        """Largest torque of the shaft before derating, N m; infinite without a limit."""
        if self.current_limit is not None and self.torque_constant is not None:
            return self.current_limit * self.torque_constant
        return math.inf if self.torque_limit is None else self.torque_limit

    @property
    def resistance(self) -> float:
        """Of the winding, ohm: the slope of the line is k_t^2 / R; NaN without torque_constant."""
        constant = math.nan if self.torque_constant is None else self.torque_constant
        return constant**2 * self.no_load_speed / self.stall_torque

    def current(self, torque: Any, shaft: Any) -> Any:
        """I = T / k_t + I_0 at a torque (N m) and a speed of the shaft (rad/s), A; the losses of a
        motor that does not turn need no I_0.  NaN without torque_constant.
        """
        constant = math.nan if self.torque_constant is None else self.torque_constant
        idle = (self.no_load_current or 0.0) * np.sign(shaft)
        return np.asarray(torque) / (self.derating * constant) + idle

    def electrical_power(self, torque: Any, shaft: Any) -> Any:
        """U I with U = R I + k_t w at the motor's terminals, W: all of ``voltage`` on its line,
        less where its drive holds a command or a limit.
        """
        current = self.current(torque, shaft)
        back = 0.0 if self.torque_constant is None else self.torque_constant
        return current * (self.resistance * current + back * np.asarray(shaft))

    def breaks(self) -> tuple[float, ...]:
        """The end of the ramp, s."""
        return () if self.ramp is None else (self.ramp,)

    def commanded(self, time: Any) -> tuple[Any, Any]:
        """Speed (rad/s) that the shaft shall not exceed so long after the start of its winch (s),
        and its rate (rad/s^2).
        """
        if self.ramp is None:
            return self.fastest, 0.0
        # Root finders ask for one instant some ten thousand times a run; numpy is slow with one.
        alone = isinstance(time, float)
        phase = min(max(time / self.ramp, 0.0), 1.0) if alone else np.clip(time / self.ramp, 0, 1)
        # The quintic step of ``RampWinding``, of many instants at once.
        share = phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)
        return self.fastest * share, self.fastest * 30.0 * (phase * (1.0 - phase)) ** 2 / self.ramp

    @property
    def free_speed(self) -> float:
        """Speed of the shaft without a load at its voltage, rad/s."""
        return self.voltage * self.no_load_speed

    @property
    def fastest(self) -> float:
        """Highest speed of the shaft, rad/s: the commanded one, or that without a load."""
        return self.free_speed if self.speed is None else self.speed

    @property
    def travel(self) -> float:
        """Rope that a turn of the shaft winds, m/rad."""
        return self.drum_radius / self.gear_ratio

    @property
    def stall_tension(self) -> float:
        """Tension at which the drum comes to a standstill, N."""
        return float(self.available(0.0)) * self.efficiency / self.travel

    def available(self, shaft: Any) -> Any:
        """Largest torque of the motor at a speed of its shaft (rad/s), N m; negative above that
        without a load.
        """
        line = self.stall_torque * (self.voltage - np.asarray(shaft) / self.no_load_speed)
        found = self.derating * np.minimum(self.limit, line)
        return found if np.ndim(shaft) else float(found)

    def loads(self, tension: Any) -> tuple[Any, Any]:
        """Torques of the shaft that hold and that wind a tension (N), N m."""
        torque = tension * self.travel
        return torque * (self.back_efficiency or 0.0), torque / self.efficiency

    def torque(self, tension: Any, speed: Any, time: Any = math.inf) -> Any:
        """Torque of the motor while it winds at a speed (m/s) against a tension (N), so long after
        its winch has started (s), N m.

        What the motor does not need it does not give; what it gives beyond its load while it stands
        is held by the gear.  What turns it back with more than its largest torque meets a brake.  A
        rotor below its command takes all that is over; on its command what that asks for.
        """
        shaft, load = np.asarray(speed) / self.travel, self.loads(tension)[1]
        most = self.available(shaft)
        if self.rotor_inertia is not None:
            command, rate = self.commanded(time)
            follows = (shaft >= command * (1.0 - _FOLLOWS)) | (shaft == 0.0)
            load = np.where(follows, load + self.rotor_inertia * np.asarray(rate), np.inf)
        return np.clip(most, 0.0, load)

    def largest_power(self, low: Any, high: Any) -> Any:
        """Largest power of a shaft that runs up from a speed to another (rad/s) with all the torque
        that it has, W.  Along the line power is a parabola of the speed, largest at half of that
        without a load; below the speed at which a limit ends it grows in proportion.
        """
        half = 0.5 * self.free_speed
        knee = self.free_speed - self.no_load_speed * self.limit / self.stall_torque
        speeds = [low, high, *(np.clip(one, low, high) for one in (half, max(knee, 0.0)))]
        return np.max([one * self.available(one) for one in speeds], axis=0)

    def runs_up(self, speed: Any, time: Any) -> Any:
        """Whether a rotor at a speed (m/s) is below its command, so long after its winch has
        started (s), so that it takes all the torque that there is if it can move.
        """
        command = self.commanded(time)[0] * np.ones_like(np.asarray(speed, dtype=float))
        below = np.asarray(speed) / self.travel < command * (1.0 - _FOLLOWS)
        return below & (self.rotor_inertia is not None)

    def speed_at(self, tension: float) -> float:
        """Speed of the drum's rope at a tension (N), in m/s; see the class."""
        holding, winding = self.loads(tension)
        forward, back = self._shaft_at(winding), self._shaft_at(holding)
        wanted = forward if forward > 0.0 else min(back, 0.0)
        low, high = self.limits()
        return min(max(self.travel * wanted, low), high)

    def _shaft_at(self, load: float) -> float:
        """Speed of the shaft (rad/s) at which the motor has the torque of a load (N m)."""
        load /= self.derating
        free = self.free_speed
        on_line = free - self.no_load_speed * load / self.stall_torque
        return min(on_line, free * (1.0 - load / self.limit) / self.band)

    def usual_speed(self) -> float:
        """The commanded speed, or that at half the stalling torque, in m/s."""
        half = 0.5 * self.free_speed
        return self.travel * (half if self.speed is None else min(self.speed, half))

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """Tension at which it stalls, or that it winds at its commanded speed, in N.

        Gear and drum take T (1 / e - 1) of what comes in for T that goes out; so many times that
        are counted as ``losses``.
        """
        torque = self.available(0.0)
        if at_speed and self.speed is not None:
            share = self.speed / self.free_speed
            limited = self.limit * (1.0 - self.band * share)
            torque = min(self.available(self.speed), self.derating * limited)
        return float(torque) / self.travel / (1.0 + losses * (1.0 / self.efficiency - 1.0))

    def told(self, speed: float, time: float) -> Self:
        """See ``Winding``: the motor winds, and has no torque at its speed without a load."""
        free = self.free_speed
        shaft = min(max(speed / self.travel, _LEAST_COMMAND * free), (1.0 - _LEAST_COMMAND) * free)
        if shaft == self.speed:
            if self.ramp is None:
                return self
            shaft = math.nextafter(shaft, 0.0)  # or a command of its own speed would not be seen
        return self.model_copy(update={"speed": shaft, "ramp": None})

    def commanded_speed(self) -> float:
        """The command, in m/s; 0 without one."""
        return 0.0 if self.speed is None else self.travel * self.speed

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed of the motor at a tension (N), in m/s."""
        most = self.travel * float(self.commanded(reading.time)[0])
        if self.rotor_inertia is None:
            return min(self.speed_at(tension), most)
        if reading.lag == 0.0:
            return reading.lagging
        holding, winding = self.loads(tension)
        forward, back = (self._accelerated(load, reading) for load in (winding, holding))
        return min(self.travel * (forward if forward > 0.0 else min(back, 0.0)), most)

    def _accelerated(self, load: float, reading: WinchReading) -> float:
        """Speed of the shaft (rad/s) at the end of a step at which J dw/dt = m(w) - load (N m)."""
        # The torque is the smaller of limit and line, both fall with w: so is the speed of both.
        by, before = (self.rotor_inertia or 0.0) / reading.lag, reading.lagging / self.travel
        torque = self.derating * self.stall_torque
        line = (torque * self.voltage - load + by * before) / (torque / self.no_load_speed + by)
        return min(line, before + (self.derating * self.limit - load) / by)

    def limits(self) -> tuple[float, float]:
        """Standstill, or the most that a rope turns it back, to full speed."""
        back = 0.0 if self.back_efficiency is None else _BACKWARDS * self.voltage
        return -self.travel * back * self.no_load_speed, self.travel * self.fastest


# Winding with a smooth start.


# Coefficients by power; a motor's ramp is the same quintic (tests/cable/test_motor_law.py).
_RATE = {"cubic": (0.0, 0.0, 3.0, -2.0), "quintic": (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)}


class RampWinding(PrescribedWinding):
    """Speed rising as a smooth step p(s), s = t / duration, and constant from then on.

    cubic: p = 3 s^2 - 2 s^3 (acceleration continuous); quintic: p = 10 s^3 - 15 s^4 + 6 s^5
    (jerk continuous).  Either winds half of speed * duration during the ramp.

    >>> winding = RampWinding(speed=0.1, duration=2.0)
    >>> winding.wound(2.0), winding.wound_rate(2.0)
    (0.1, 0.1)
    """

    kind: Literal["ramp"] = "ramp"
    speed: Speed
    """Speed after the ramp; negative pays out."""
    duration: Second
    """Time from standstill to full speed."""
    shape: Literal["cubic", "quintic"] = "quintic"
    """How smooth the ramp is: continuous acceleration (cubic) or jerk (quintic)."""

    def usual_speed(self) -> float:
        """The speed after the ramp, in m/s."""
        return abs(self.speed)

    def breaks(self) -> tuple[float, ...]:
        """The end of the ramp, s."""
        return (self.duration,)

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        phase = max(time / self.duration, 0.0)
        if phase >= 1.0:  # most of a run
            return self.speed * (0.5 * self.duration + (time - self.duration))
        ramp = sum(c * phase ** (k + 1) / (k + 1) for k, c in enumerate(_RATE[self.shape]))
        return self.speed * (self.duration * ramp)

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s."""
        phase = max(time / self.duration, 0.0)
        if phase >= 1.0:
            return self.speed
        return self.speed * sum(c * phase**k for k, c in enumerate(_RATE[self.shape]))


# Winding by a motor that stalls.


class StallWinding(FeedbackWinding):
    """Constant speed up to a maximum tension, constant tension from there.

    speed(T) = speed * (T_max - T) / (band * T_max), cut to 0 .. speed: full speed below
    T_max (1 - band), standstill at T_max.  A winch that can be driven backwards goes on along
    that line to -speed, so that the rope's tension pulls rope off it.
    """

    kind: Literal["stall"] = "stall"
    speed: PositiveSpeed
    """Speed while the tension is low."""
    max_tension: Tension
    """Tension at which the motor stands still."""
    band: Ratio = 0.05
    """Width of the passage from constant speed to constant tension, over max_tension."""
    backdrivable: bool = False
    """Whether rope can be pulled off the winch; if not, it holds."""

    def usual_speed(self) -> float:
        """The speed below the stall, in m/s."""
        return self.speed

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """The maximum tension, or that up to which the speed is kept, in N."""
        return self.max_tension * (1.0 - self.band * at_speed)

    def commanded_speed(self) -> float:
        """The speed below the stall, in m/s."""
        return self.speed

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed of the motor at a tension (N), in m/s."""
        return self.speed * (1.0 - tension / self.max_tension) / self.band

    def limits(self) -> tuple[float, float]:
        """Standstill, or full speed backwards, to full speed."""
        return (-self.speed if self.backdrivable else 0.0), self.speed


# Winding by a table of measured or optimised lengths.


class TableWinding(PrescribedWinding):
    """Lengths at times, joined by monotone cubics (PCHIP); held before the first, after the last.

    The speed is continuous between the first and the last time, and the length never
    overshoots the table: slopes are the weighted harmonic means of neighbouring secants, 0 at
    an extremum.  Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984), with the
    three-point end slopes of Moler, Numerical Computing with MATLAB (2004), sec. 3.6.
    """

    kind: Literal["table"] = "table"
    times: Annotated[tuple[SecondOrZero, ...], ListIn, Field(min_length=2)]
    """Increasing, in s after the start of the winch."""
    lengths: Annotated[tuple[SignedMetre, ...], ListIn]
    """Rope wound at those times, in metre; the first is 0."""

    @model_validator(mode="after")
    def _usable(self) -> "TableWinding":
        if len(self.lengths) != len(self.times):
            raise ValueError(
                f"lengths has {len(self.lengths)} values, but times has {len(self.times)}: "
                "give one length for each time"
            )
        late = [b for a, b in zip(self.times, self.times[1:], strict=False) if b <= a]
        if late:
            raise ValueError(f"times = ... {late[0]:g} s must be above the time before it")
        if self.lengths[0] != 0.0:
            raise ValueError(
                f"lengths = {self.lengths[0]:g} m, ... must start at 0: rope wound before the "
                "start counts as initial slack of the cable"
            )
        return self

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import PchipInterpolator  # here: reading scenes must not load scipy

        return PchipInterpolator(self.times, self.lengths)

    def usual_speed(self) -> float:
        """Median over time of the mean speeds between the table's times at which it moves, m/s."""
        step, speed = np.diff(self.times), np.abs(np.diff(self.lengths) / np.diff(self.times))
        order = [k for k in np.argsort(speed) if speed[k] > 0.0]
        if not order:
            return 0.0
        elapsed = np.cumsum(step[order])
        return float(speed[order[np.searchsorted(elapsed, 0.5 * elapsed[-1])]])

    def breaks(self) -> tuple[float, ...]:
        """The times of the table, s."""
        return self.times

    def rests_from(self) -> float:
        """The last time of the table, s."""
        return self.times[-1]

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        return float(self._curve(min(max(time, self.times[0]), self.times[-1])))

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; 0 outside the table."""
        inside = self.times[0] <= time < self.times[-1]
        return float(self._curve(time, 1)) if inside else 0.0
