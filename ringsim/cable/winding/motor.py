"""Winding by a motor behind a gear."""

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from ringsim.cable.winding.family import FeedbackWinding, WinchReading
from ringsim.units import (
    Ampere,
    GearRatio,
    Metre,
    MotorSpeed,
    PositiveTorque,
    Ratio,
    TorqueConstant,
    Unit,
)

_BACKWARDS = 10.0
"""Speed up to which a rope turns a motor back, over the motor's without a load: feedback needs a
bound, and where the line has eleven times the torque at standstill no motor is meant any more.
What pulls harder is braked."""


class MotorWinding(FeedbackWinding):
    """A motor with a straight torque-speed line, a gear and a drum.

    At the shaft's speed w the motor has at most the torque

        m(w) = derating * min(limit, stall_torque * (voltage - w / no_load_speed)),

    and a rope of tension T asks for T r / (n e) of it while it is wound, for T r e' / n while it
    turns the motor back (r the drum's radius, n the gear's ratio, e and e' its efficiencies).  The
    drum turns at the speed at which both are equal, not above the commanded one; it stands where
    the motor is too weak to wind and the rope to turn it back, always so if the gear locks itself.
    Turned back it goes along its line, up to ten times its speed without a load.
    The inertias of rotor and gear are left out: the motor is in balance with its rope at any time.

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
    no_load_speed: MotorSpeed
    """Of the motor's shaft at the rated voltage."""
    stall_torque: PositiveTorque
    """Of the motor's shaft at the rated voltage."""
    voltage: Annotated[float, Field(gt=0.0, le=2.0), Unit("1")] = 1.0
    """Applied over rated voltage: the line shifts with it, its slope stays."""
    speed: MotorSpeed | None = None
    """Commanded speed of the shaft, kept while the motor has the torque for it; left out, the motor
    runs on its voltage alone."""
    torque_limit: PositiveTorque | None = None
    """Largest torque that the motor's drive lets the shaft have."""
    current_limit: Ampere | None = None
    """The same as a current; needs ``torque_constant``."""
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
    below it and stands still at the limit."""

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
        fastest = self.voltage * self.no_load_speed
        if self.speed is not None and self.speed >= fastest:
            raise ValueError(
                f"speed = {self.speed} rad/s must be below voltage * no_load_speed = {fastest:g} "
                "rad/s: the motor has no torque at its speed (lower it, or raise the voltage)"
            )
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

    @property
    def fastest(self) -> float:
        """Highest speed of the shaft, rad/s: the commanded one, or that without a load."""
        return self.voltage * self.no_load_speed if self.speed is None else self.speed

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

    def torque(self, tension: Any, speed: Any) -> Any:
        """Torque of the motor while it winds at a speed (m/s) against a tension (N), N m.

        What the motor does not need it does not give; what it gives beyond its load while it stands
        is held by the gear.  What turns it back with more than its largest torque meets a brake.
        """
        return np.clip(self.available(np.asarray(speed) / self.travel), 0.0, self.loads(tension)[1])

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
        free = self.voltage * self.no_load_speed
        on_line = free - self.no_load_speed * load / self.stall_torque
        return min(on_line, free * (1.0 - load / self.limit) / self.band)

    def usual_speed(self) -> float:
        """The commanded speed, or that at half the stalling torque, in m/s."""
        half = 0.5 * self.voltage * self.no_load_speed
        return self.travel * (half if self.speed is None else min(self.speed, half))

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """Tension at which it stalls, or that it winds at its commanded speed, in N.

        Gear and drum take T (1 / e - 1) of what comes in for T that goes out; so many times that
        are counted as ``losses``.
        """
        torque = self.available(0.0)
        if at_speed and self.speed is not None:
            share = self.speed / (self.voltage * self.no_load_speed)
            limited = self.limit * (1.0 - self.band * share)
            torque = min(self.available(self.speed), self.derating * limited)
        return float(torque) / self.travel / (1.0 + losses * (1.0 / self.efficiency - 1.0))

    def commanded_speed(self) -> float:
        """The command, in m/s; 0 without one."""
        return 0.0 if self.speed is None else self.travel * self.speed

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed of the motor at a tension (N), in m/s."""
        return self.speed_at(tension)

    def limits(self) -> tuple[float, float]:
        """Standstill, or the most that a rope turns it back, to full speed."""
        back = 0.0 if self.back_efficiency is None else _BACKWARDS * self.voltage
        return -self.travel * back * self.no_load_speed, self.travel * self.fastest
