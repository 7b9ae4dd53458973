"""Controllers: what samples sensors during a run and commands the speeds of winches."""

import math
import struct
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from ringsim.cable.ropes import Array
from ringsim.cable.winding import FeedbackWinding, PrescribedWinding, WinchReading
from ringsim.choice import kind_of
from ringsim.parts.faults import AT_ONCE, LAST, SILENT
from ringsim.units import (
    AngularRate,
    ControlGain,
    Model,
    PositiveSpeed,
    SecondOrZero,
    SignedMetre,
    Speed,
    SpeedOrZero,
    Tension,
    Unit,
)

if TYPE_CHECKING:
    from ringsim.scene import Scene

Place = tuple[int, int]
"""A winch: the number of its cable, and its end (0 first, 1 far)."""


# Winding as a controller commands it.


_JUMP = 1e-3
"""Changes of speed that take less, s, are at once: a step would have to end there.  At 0.1 m/s^2
they leave out 5e-8 m of rope."""


class CommandedWinding(PrescribedWinding):
    """Speed as commanded last, held until the next command, with a limited acceleration.

    From ``begun`` on the speed goes from ``from_speed`` to ``speed`` at the acceleration, or at
    once without one; the rope wound is its integral and ``wound_before``.

    >>> law = CommandedWinding(max_speed=0.2, acceleration=0.1).told(0.1, 2.0)
    >>> law.wound(3.0), law.wound_rate(2.5), round(law.wound(4.0), 9)
    (0.05, 0.05, 0.15)
    """

    kind: Literal["commanded"] = "commanded"
    max_speed: PositiveSpeed
    """Fastest winding: commands beyond are cut."""
    max_payout: SpeedOrZero = 0.0
    """Fastest paying out; 0: it never pays out."""
    acceleration: Annotated[float, Field(gt=0.0, le=1e4), Unit("m/s^2")] | None = None
    """Of the drum's rope from one command to the next; left out, the speed jumps."""
    speed: Speed = 0.0
    """Commanded last; until the first command, from the start on."""
    begun: SecondOrZero = 0.0
    """Written by runs: when that was, since the start of the winch."""
    from_speed: Speed = 0.0
    """Written by runs: the speed that it had then."""
    wound_before: SignedMetre = 0.0
    """Written by runs: the rope that it had wound by then."""
    commandable: ClassVar[bool] = True

    def usual_speed(self) -> float:
        """Half of the fastest, or the speed before the first command, in m/s."""
        return abs(self.speed) or 0.5 * self.max_speed

    @model_validator(mode="after")
    def _within(self) -> "CommandedWinding":
        if not -self.max_payout <= self.speed <= self.max_speed:
            raise ValueError(
                f"speed = {self.speed} m/s must lie between -max_payout = {-self.max_payout} and "
                f"max_speed = {self.max_speed} m/s"
            )
        return self

    def told(self, speed: float, time: float) -> Self:
        """See ``Winding``."""
        cut = min(max(speed, -self.max_payout), self.max_speed)
        if cut == self.speed:
            return self
        now = {"begun": time, "from_speed": self.wound_rate(time), "wound_before": self.wound(time)}
        return self.model_copy(update={**now, "speed": cut})

    @property
    def told_before(self) -> bool:
        """See ``Winding``."""
        return bool(self.begun or self.from_speed or self.wound_before)

    def commanded_speed(self) -> float:
        """Commanded last, in m/s."""
        return self.speed

    def breaks(self) -> tuple[float, ...]:
        """Where the commanded speed is reached, s."""
        return (self.begun + self._rise,)

    @property
    def _rise(self) -> float:
        """Time that the change of speed takes, s."""
        if self.acceleration is None:
            return 0.0
        found = abs(self.speed - self.from_speed) / self.acceleration
        return found if found > _JUMP else 0.0

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        elapsed = max(time - self.begun, 0.0)
        rising = min(elapsed, self._rise)
        mean = 0.5 * (self.from_speed + self.wound_rate(self.begun + rising)) if rising else 0.0
        return self.wound_before + mean * rising + self.speed * (elapsed - rising)

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s."""
        elapsed = max(time - self.begun, 0.0)
        if elapsed >= self._rise:
            return self.speed
        return self.from_speed + (self.speed - self.from_speed) * elapsed / self._rise


# Sensors, and what they tell a controller.


Deviation = Annotated[float, Field(ge=0.0, le=1e6)]


class Encoder(Model):
    """Errors of the encoders of all V-joints."""

    resolution: Annotated[Deviation, Unit("deg")] = 0.0
    """Step to which readings are rounded; 0: they are not."""
    standard_deviation: Annotated[Deviation, Unit("deg")] = 0.0
    """Of the noise, which is normal and independent from sample to sample and joint to joint."""
    bias: Annotated[float, Field(ge=-180.0, le=180.0), Unit("deg")] = 0.0
    """Added to every reading."""


class LoadCell(Model):
    """Errors of the load cells at all winches."""

    resolution: Annotated[Deviation, Unit("N")] = 0.0
    """Step to which readings are rounded; 0: they are not."""
    standard_deviation: Annotated[Deviation, Unit("N")] = 0.0
    """Of the noise, as of ``Encoder``."""
    bias: Annotated[float, Field(ge=-1e6, le=1e6), Unit("N")] = 0.0
    """Added to every reading."""


def _read(true: Array, sensor: Encoder | LoadCell, noise: Array) -> Array:
    """What sensors show."""
    shown = true + sensor.bias + sensor.standard_deviation * noise
    step = sensor.resolution
    return np.round(shown / step) * step if step > 0.0 else shown


@dataclass(frozen=True)
class Readings:
    """What a controller knows at a sample; winches are "upper", "lower", and with two on a cable
    also "upper far" and "lower far".
    """

    opening_angle: Array
    """Of every V-joint as its encoder shows it, shape (planes, sections), deg; NaN where a sensor
    has failed and is silent."""
    tension: dict[str, float]
    """At every winch as its load cell shows it, N."""
    wound: dict[str, float]
    """Rope that every drum has taken up, m, without errors."""
    speed: dict[str, float]
    """Its rate, m/s, without errors."""


# The family of controllers.


class Controller(Model):
    """Any controller.  It samples every ``period`` from the start on; what it commands takes effect
    ``delay`` later and holds until the next command does.

    A kind has its own fields, ``step``, and, if it remembers anything, ``reset``.  A run has a copy
    of its own, so that what ``state`` holds begins anew in each.
    """

    outside: ClassVar[bool] = False
    """Whether a program that steps the run commands in its place."""

    period: Annotated[float, Field(ge=1e-4, le=1e6), Unit("s")]
    """Time from one sample to the next."""
    delay: SecondOrZero = 0.0
    """From a sample until winches obey its command."""
    encoder: Encoder = Encoder()
    """Of every V-joint."""
    load_cell: LoadCell = LoadCell()
    """At every winch."""
    seed: Annotated[float, Field(ge=0.0, le=1e15), Unit("1")] = 0.0
    """Of the noise: another number gives another noise, the same one the same, in either engine."""

    _scene: Any = PrivateAttr(None)
    _state: dict[str, Any] = PrivateAttr(default_factory=dict)

    def begin(self, scene: "Scene") -> Self:
        """A copy for one run of a scene."""
        own = self.model_copy(deep=True)
        own._scene, own._state = scene, {}
        own.reset()
        return own

    @property
    def scene(self) -> "Scene":
        """What is run."""
        scene: Scene = self._scene
        return scene

    @property
    def state(self) -> dict[str, Any]:
        """What it remembers from step to step: names, with numbers, texts, arrays, or lists of
        these, which stored states of a run keep.
        """
        return self._state

    def reset(self) -> None:
        """Fill ``state`` as it is before the first step."""

    def step(self, time: float, readings: Readings) -> Mapping[str, float] | None:
        """Speeds (m/s) for winches by name; those that it leaves out keep what they were told.

        ``time`` is that of the sample, s.
        """
        raise NotImplementedError

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError where a scene has no winch that it could command."""
        if not any(winch.winding.commandable for winch in named_winches(scene).values()):
            raise ValueError(
                "controller: no winch of this scene takes commands: give one a winding of kind "
                '"commanded" or "motor", or leave controller out'
            )
        for name, winch in named_winches(scene).items():
            if winch.winding.motor is not None and winch.winding.motor.ramp is not None:
                raise ValueError(
                    f"controller: commands the motor of the {name} winch, whose command must then "
                    "not rise by itself: leave its ramp out, or controller"
                )
            if winch.winding.motor is not None and winch.winding.motor.speed is None:
                raise ValueError(
                    f"controller: commands the motor of the {name} winch, which would run at full "
                    "voltage until the first command: give its speed"
                )

    def sampler(self, scene: "Scene") -> "Sampler":
        """What lets it sample in one run of a scene."""
        return Sampler(self.begin(scene), scene)


def named_winches(scene: "Scene") -> dict[str, Any]:
    """The winches of a scene by the names that controllers use."""
    return {name: winch for name, (_, winch) in places_of(scene).items()}


def places_of(scene: "Scene") -> dict[str, tuple[Place, Any]]:
    """The same, each with its place."""
    cables = [] if scene.cables is None else scene.cables.present()
    return {
        f"{scene.structure.planes[plane]}{' far' if end else ''}": ((number, end), winch)
        for number, (plane, cable) in enumerate(cables)
        for end, winch in enumerate(cable.winches)
    }


# Winding that controls the tension of the rope, from measured bar angles.


class TensionFeedbackWinding(FeedbackWinding):
    """Wind as fast as the ideal geometry takes up rope, corrected by the tension's error.

        speed = take-up + gain * (target - T),   cut to -max_payout .. max_speed

    The measured angles give the path of the rope, hence its stretch and its tension, without
    a force sensor.  The take-up is -dS/d(delta) * opening_rate, the speed that lets the sections
    open at that rate: almost nothing at the stowed end, where a constant speed starts with a jerk.
    Without an opening rate it is the measured -dS/dt: T then settles at the target within a time
    of S / (EA * gain), whatever the structure does below max_speed.

    Paper 000 proposes control on measured angles as further work; the law is this project's.
    """

    kind: Literal["tension-feedback"] = "tension-feedback"
    target: Tension
    """Tension wanted at the winch."""
    gain: ControlGain = 0.02
    """Added speed per newton of missing tension."""
    max_speed: PositiveSpeed
    """Fastest winding of the motor."""
    max_payout: SpeedOrZero = 0.0
    """Fastest paying out; 0: it never pays out."""
    opening_rate: AngularRate | None = None
    """Wanted rate of the opening angle; left out, the winch follows the structure."""

    def usual_speed(self) -> float:
        """The speed, in m/s, at which it takes up a slack rope while nothing else moves."""
        return min(self.gain * self.target, self.max_speed)

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s."""
        if self.opening_rate is None:
            takeup = -reading.path_rate
        else:
            takeup = -reading.path_slope * self.opening_rate
        return takeup + self.gain * (self.target - tension)

    def limits(self) -> tuple[float, float]:
        """From paying out to winding in."""
        return -self.max_payout, self.max_speed


# Two planes that open alike.


class Synchronise(Controller):
    """The winch of the plane that is behind winds faster, that of the plane ahead more slowly.

        speed of a plane's winches = speed * (1 + gain * (mean - own)),

    with the mean opening angles of both planes and of the plane, deg, of the sensors that show
    something.
    """

    kind: Literal["synchronise"] = "synchronise"
    speed: PositiveSpeed
    """Of planes that open alike."""
    gain: Annotated[float, Field(ge=0.0, le=1e3), Unit("1/deg")]
    """Share of the speed for each degree that a plane is behind."""

    def step(self, time: float, readings: Readings) -> Mapping[str, float]:
        """See ``Controller``."""
        shown = readings.opening_angle
        known = np.isfinite(shown)
        count = np.maximum(known.sum(axis=1), 1)
        own = np.where(known.any(axis=1), np.where(known, shown, 0.0).sum(axis=1) / count, np.nan)
        behind = np.nan_to_num(np.nanmean(own) - own) if known.any() else np.zeros(len(own))
        speeds = self.speed * (1.0 + self.gain * behind)
        planes = self.scene.structure.planes
        return {name: float(speeds[planes.index(name.split()[0])]) for name in readings.speed}

    def check(self, scene: "Scene") -> None:
        """See ``Controller``."""
        super().check(scene)
        if len({name.split()[0] for name in named_winches(scene)}) < 2:
            raise ValueError(
                'controller.kind = "synchronise" needs a cable in either plane: add the other '
                "one, or leave controller out"
            )


# The tension of the ropes.


class SampledTension(Controller):
    """The law of "tension-feedback" windings as a computer has it, with new values at each sample.

        speed = take-up + gain * (target - T),   take-up = -dS/d(delta) * opening_rate,

    with the tension T that the load cell shows and the path S of the rope at the angles that the
    encoders show; see ``TensionFeedbackWinding``.  Held from sample to sample it is stable for
    period * gain < 2 S / EA at most, without delay.  A plane whose encoders are all silent counts
    as open.
    """

    kind: Literal["sampled-tension"] = "sampled-tension"
    target: Tension
    """Tension wanted at the winches."""
    gain: ControlGain = 0.02
    """Added speed per newton of missing tension."""
    opening_rate: AngularRate
    """Wanted rate of the opening angle."""

    def step(self, time: float, readings: Readings) -> Mapping[str, float]:
        """See ``Controller``."""
        scene, speeds = self.scene, {}
        for plane, cable in scene.cables.present() if scene.cables else []:
            shown = readings.opening_angle[plane]
            known = np.isfinite(shown)
            mean = float(shown[known].mean()) if known.any() else 180.0
            angles = np.radians(np.where(known, shown, mean))
            takeup = -scene.structure.path_slope(cable, angles) * self.opening_rate
            for name, tension in readings.tension.items():
                if name.split()[0] == scene.structure.planes[plane]:
                    speeds[name] = takeup + self.gain * (self.target - tension)
        return speeds


# Commands from outside of the run.


OUTSIDE = threading.local()
"""``ask`` of the thread that runs a scene: gives the time (s) and readings away, and waits for
commands."""


class Outside(Controller):
    """Commanded by the program that steps the run (``ringsim.steps``)."""

    kind: Literal["outside"] = "outside"
    outside: ClassVar[bool] = True

    def step(self, time: float, readings: Readings) -> Mapping[str, float] | None:
        """See ``Controller``."""
        ask: Callable[[float, Readings], Mapping[str, float]] = OUTSIDE.ask  # see simulation
        return ask(time, readings)

    def check(self, scene: "Scene") -> None:
        """Whoever steps a run may only look on."""


# Sampling in a run.


def checked(told: Any, winches: Mapping[str, tuple[Place, Any]], where: str) -> dict[str, float]:
    """Commands as plain numbers; ValueError, which begins with ``where``, if they are none."""
    if not isinstance(told, Mapping):
        raise ValueError(f"{where}: gives {told!r}: must be speeds (m/s) by winch, or None")
    for name, speed in told.items():
        if name not in winches:
            known = ", ".join(winches) or "none"
            raise ValueError(f'{where}: commands a winch "{name}" (there are: {known})')
        if not winches[name][1].winding.commandable:
            kind = kind_of(winches[name][1].winding)
            raise ValueError(
                f'{where}: commands the winch "{name}", whose winding of kind "{kind}" takes no '
                'commands: choose "commanded" or "motor"'
            )
        if not isinstance(speed, (int, float, np.number)) or not math.isfinite(speed):
            raise ValueError(
                f'{where}: commands {speed!r} for the winch "{name}": must be a number of m/s'
            )
    return {name: float(speed) for name, speed in told.items()}


class Sampler:
    """Samples a controller in one run.

    Attributes
    ----------
    controller
        A copy for this run.
    encoders
        Whether each is sound (0), shows its last reading for ever (``LAST``) or nothing
        (``SILENT``), shape (planes, sections).
    """

    def __init__(self, controller: Controller, scene: "Scene") -> None:
        self.controller = controller
        self._winches = places_of(scene)
        self.encoders = np.zeros((len(scene.structure.planes), scene.structure.sections))
        self._shown = np.full(self.encoders.shape, math.nan)
        self._next = 0
        self._sent: list[tuple[float, dict[str, float]]] = []

    @property
    def next_time(self) -> float:
        """Time of the next sample, or of the next command that takes effect, s."""
        sample = self._next * self.controller.period
        return min(sample, self._sent[0][0]) if self._sent else sample

    def due(self, time: float, angles: Array, chain: Any) -> dict[Place, float]:
        """Sample if it is time (s); returns the speeds (m/s) that winches are to have from now on.

        ``angles`` are the opening angles, shape (planes, sections), rad, and ``chain`` the state of
        the ropes, or None.
        """
        own = self.controller
        while (now := self._next * own.period) <= time + AT_ONCE:
            told = own.step(now, self._readings(angles, chain))
            self._next += 1
            if told is not None:
                where = f'controller.kind = "{kind_of(own)}" at {now:.6g} s'
                self._sent.append((now + own.delay, checked(told, self._winches, where)))
        found: dict[Place, float] = {}
        while self._sent and self._sent[0][0] <= time + AT_ONCE:
            found |= {self._winches[name][0]: v for name, v in self._sent.pop(0)[1].items()}
        return found

    def _readings(self, angles: Array, chain: Any) -> Readings:
        # Noise follows from the number of the sample alone: runs that go on need no memory of it.
        key = int.from_bytes(struct.pack("<d", self.controller.seed), "little")
        source = np.random.Generator(np.random.Philox(key=key, counter=[0, 0, 0, self._next]))
        fresh = _read(
            np.degrees(angles), self.controller.encoder, source.standard_normal(angles.shape)
        )
        kept = (self.encoders == LAST) & np.isfinite(self._shown)
        self._shown = np.where(kept, self._shown, fresh)
        shown = np.where(self.encoders == SILENT, np.nan, self._shown)
        if chain is None:
            return Readings(shown, {}, {}, {})
        noise = source.standard_normal(chain.winch_tensions.shape)
        tensions = _read(chain.winch_tensions, self.controller.load_cell, noise)
        told = (
            {name: float(values[place]) for name, (place, _) in self._winches.items()}
            for values in (tensions, chain.wound, chain.wound_rate)
        )
        return Readings(shown, *told)

    def memory(self) -> dict[str, Any]:
        """What it remembers, as numbers, texts, arrays, lists and tables."""
        sent = [[time, list(told), list(told.values())] for time, told in self._sent]
        shown = [self.encoders, self._shown]
        return {"next": self._next, "sent": sent, "shown": shown, "state": self.controller.state}

    def recall(self, memory: Mapping[str, Any] | None, time: float, *, same: bool) -> None:
        """Go on at a time (s) from the memory of another one; one that is not the ``same``
        controller begins with its next sample.
        """
        self._next = math.ceil((time - AT_ONCE) / self.controller.period)
        # What failed encoders show is the stand's, whoever reads it.
        unread = np.full(self.encoders.shape, math.nan)
        self._shown = unread if memory is None else memory["shown"][1]
        if memory is None or not same:
            self.controller, self._sent = self.controller.begin(self.controller.scene), []
            return
        self._next = memory["next"]
        self._sent = [(at, dict(zip(*told, strict=True))) for at, *told in memory["sent"]]
        self.controller.state.clear()
        self.controller.state.update(memory["state"])
