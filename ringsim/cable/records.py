"""Records of the cables of a scene: sheaves, places, brackets, winches."""

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from ringsim.cable import friction as regularisation
from ringsim.cable.friction import Frictionless, PulleyFriction
from ringsim.cable.ropes import Array
from ringsim.cable.winding import FeedbackWinding, PrescribedWinding, StallWinding, Winding
from ringsim.choice import OneOf, kind_of
from ringsim.parts.faults import AT_ONCE
from ringsim.units import (
    AxialStiffness,
    Metre,
    MetreOrZero,
    Model,
    PositiveSpeed,
    SecondOrZero,
    SignedMetre,
    Tension,
    Unit,
)

# The family of brackets: where the V pulley stands beside its V-joint.
#
# In the plane of an ideal section, with the bars at phi = (pi - delta) / 2 from the line of the
# hinge pulleys, the joint stands l cos(phi) along that line from either of them and l sin(phi)
# inwards. With the pulley a (along, to the second hinge pulley) and b (inwards) from the joint the
# spans on either side of it have the lengths
#
#     L_1, L_2 = sqrt((l cos(phi) +- a)^2 + (l sin(phi) + b)^2).
#
# A kind gives a and b; b is the h of paper 000, eqs 20 and 21.


_STEP = 1e-30
"""rad; its square, which the complex step neglects, is nothing beside any angle."""


class Bracket(Model):
    """Any bracket; the pulley's distance from the V-joint's axis is the cable's block_offset."""

    on_rod: ClassVar[bool] = False
    """Whether it is fixed across a bar half, not to the V-joint."""

    def refusal(self, opening_angle: float) -> str | None:
        """Why it cannot open a ring that is stowed at this angle (deg), or None if it can."""
        return None

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a and b in m at bar angles (rad), of their shape.

        Analytic in phi, which may be complex: ``path_slope`` differentiates it so.
        """
        raise NotImplementedError

    def spans(self, half_bar: float, distance: float, opening: ArrayLike) -> tuple[Array, Array]:
        """Lengths L_1 and L_2 at opening angles in rad, m."""
        phi = 0.5 * (np.pi - np.asarray(opening))
        aside, inward = self.place(phi, distance)
        reach, drop = half_bar * np.cos(phi), half_bar * np.sin(phi) + inward
        return np.sqrt((reach + aside) ** 2 + drop**2), np.sqrt((reach - aside) ** 2 + drop**2)

    def path_slope(self, half_bar: float, distance: float, opening: ArrayLike) -> Array:
        """Derivative of L_1 + L_2 after the opening angle, m/rad; a cable opens where negative."""
        # Complex step: no difference of nearby lengths, hence exact to round-off.
        lengths = self.spans(half_bar, distance, np.asarray(opening) + 1j * _STEP)
        return np.asarray(sum(lengths).imag / _STEP)


# A bracket that a gear keeps on the bisector of the bar halves.


class BisectorBracket(Bracket):
    """The pulley at a constant distance h from the joint, away from the bars on their bisector.

    Both spans are alike at every angle.  Source: paper 000, eq. 20 and fig. 3 with constant h.
    """

    kind: Literal["bisector"] = "bisector"

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a = 0, b = h."""
        size = np.shape(phi)
        return np.zeros(size), np.full(size, distance)


# Records of the cables of a scene and their winches.


AnyBracket = Annotated[Bracket, OneOf()]
AnyFriction = Annotated[PulleyFriction, OneOf()]
AnyWinding = Annotated[Winding, OneOf()]

LEAST_HELD = 1e-3
"""Tension that a winch keeps whose rope is slack when its plane locks, N: next to nothing."""
RESTING = 1e-2
"""A motor that answers to the tension stands still below this share of its usual speed: it comes to
rest exponentially, never quite, and a ring that just counts as resting takes up 0.7 % on
``ring18-motor`` (``ringsim.stepping.ending``)."""

_JUMP = 1e-3
"""Jump of a prescribed speed over the usual one that counts: a ramp of 0.1 ms changes by less
within ``AT_ONCE``."""


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

    def jumps(self) -> set[float]:
        """Times (s) at which the winch starts or stops, or its prescribed speed jumps."""
        found = {self.start_time} if self.stop_time is None else {self.start_time, self.stop_time}
        slight = _JUMP * self.winding.usual_speed()
        for time in self.breaks():
            rates = [self.at(time, moment=time + side)[1] for side in (-AT_ONCE, AT_ONCE)]
            if abs(rates[1] - rates[0]) > slight:
                found.add(time)
        return found

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

    def drives(self, time: float, rate: float, end: float) -> bool:
        """Whether the drum turns at a time (s), at a rate (m/s), or will turn before an end (s)."""
        if not self.turns(time):
            return time < self.start_time < end and self.start_time != self.stop_time
        if isinstance(self.winding, PrescribedWinding):
            return time - self.start_time < self.winding.rests_from()
        if time - self.start_time < max(self.winding.breaks(), default=0.0):
            return True  # a command that still rises
        return abs(rate) > RESTING * self.winding.usual_speed()


class Cable(Model):
    """A cable over the pulleys of its plane; see ``ringsim.core.tension`` for the equations."""

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
    (``ringsim.cable.friction``)."""
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
            raise ValueError("upper or lower must be given (or leave out the whole table)")
        return self

    def present(self) -> list[tuple[int, Cable]]:
        """The cables that there are, with the number of their plane (0 upper, 1 lower)."""
        both = ((0, self.upper), (1, self.lower))
        return [(plane, cable) for plane, cable in both if cable is not None]


# Names of the points of a cable's path and of its spans, in inputs, outputs and messages.


CABLES = ("upper", "lower")
OF_SECTION = ("first hinge", "V", "second hinge")
"""Pulleys of a section; its first hinge assembly is the one next to the section before."""


def points_along(sections: int) -> tuple[str, ...]:
    """What a cable runs along, from section 1 on.

    >>> points_along(1)
    ('section 1 first hinge', 'section 1 V', 'section 1 second hinge')
    """
    return tuple(f"section {k} {place}" for k in range(1, sections + 1) for place in OF_SECTION)


def path_of(points: Sequence[str], end: str) -> tuple[str, ...]:
    """The path from the winch on: the winch, its pulleys, and the cable's end or other winch.

    ``points`` are in the order of the sections, ``end`` is that of ``Cable``.

    >>> path_of(points_along(1), "last")
    ('winch', 'section 1 second hinge', 'section 1 V', 'section 1 first hinge')
    """
    path = points[::-1] if end == "last" else points
    return ("winch", *path, *(("far winch",) if end == "both" else ()))


def spans_of(path: Sequence[str]) -> tuple[str, ...]:
    """Names of the spans by their ends; the section stands there once if both have the same.

    >>> spans_of(path_of(points_along(1), "first"))[:2]
    ('winch to section 1 first hinge', 'section 1 first hinge to V')
    """
    return tuple(f"{one} to {_short(one, other)}" for one, other in pairwise(path))


def _short(before: str, name: str) -> str:
    section = " ".join(name.split()[:2]) + " "
    return name.removeprefix(section) if before.startswith(section) else name


def number_of(name: str, names: Sequence[str], where: str, end: str = "") -> int:
    """Number, from 1, of a named pulley or span; ValueError with the nearest name if unknown, or if
    it is that of the cable's ``end``.
    """
    if name in names:
        return names.index(name) + 1
    if name == end:
        raise ValueError(
            f'{where}: the cable is fixed there and has no pulley: the last pulley is "{names[-1]}"'
        )
    begun = [each for each in names if each.startswith(f"{name} ")]  # a span by its pulley
    near = begun or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    hint = f'did you mean "{near[0]}"?' if near else f'the first is "{names[0]}"'
    raise ValueError(f"{where}: there is no pulley or span of that name ({hint})")


def numbered(table: dict[str, Any], points: Sequence[str]) -> dict[str, Any]:
    """A scene's table with numbers and lists for the pulleys and spans that it names.

    These are ``cable``, ``pulley`` and ``span`` of faults, and tables of coefficients: ``default``
    and one value for each named pulley.  ValueError if a name is unknown, or there is no default.
    """
    cables, faults = table.get("cables"), table.get("faults")
    known = cables if isinstance(cables, dict) else {}
    paths, present, changed = [], [], dict(known)
    for name in CABLES if points else ():
        if not isinstance(cable := known.get(name), dict):
            continue
        present.append(name)
        paths.append(path_of(points, cable.get("end", "first")))
        law = cable.get("friction")
        if isinstance(law, dict) and isinstance(law.get("coefficient"), dict):
            listed = _listed(law["coefficient"], paths[-1], f"cables.{name}.friction.coefficient")
            changed[name] = cable | {"friction": law | {"coefficient": listed}}
    if changed != known:
        table = table | {"cables": changed}
    if points and isinstance(faults, (list, tuple)):
        table = table | {
            "faults": [_fault(fault, present, paths, k) for k, fault in enumerate(faults, 1)]
        }
    return table


def _listed(given: dict[str, Any], path: Sequence[str], where: str) -> list[Any]:
    if "default" not in given:
        raise ValueError(f"{where}.default is missing: give the value for all other pulleys")
    values = [given["default"]] * (len(path) - 2)
    for name, value in given.items():
        if name != "default":
            values[number_of(name, path[1:-1], f'{where}."{name}"', path[-1]) - 1] = value
    return values


def _fault(fault: Any, present: Sequence[str], paths: Sequence[Sequence[str]], number: int) -> Any:
    """A fault with numbers; on a cable that is not there any will do, since that is refused."""
    if not isinstance(fault, dict):
        return fault
    made = dict(fault)
    if fault.get("cable") in present:
        made["cable"] = present.index(fault["cable"]) + 1
    elif isinstance(given := fault.get("cable"), str) and present:
        words = [*(f'"{name}"' for name in present), *map(str, range(1, len(present) + 1))]
        known = f"{', '.join(words[:-1])} or {words[-1]}"
        raise ValueError(f'faults[{number}].cable = "{given}" must be {known}')
    cable = made.get("cable", 1)
    path = paths[cable - 1] if cable in range(1, len(paths) + 1) else ()
    for key, names, end in (("pulley", path[1:-1], path[-1:]), ("span", spans_of(path), ())):
        if isinstance(name := fault.get(key), str):
            where = f'faults[{number}].{key} = "{name}"'
            made[key] = number_of(name, names, where, *end) if path else 1
    return made


# A bracket that is a part of one bar half.


class BarHalfBracket(Bracket):
    r"""The pulley at the end of an element of length H that is fixed to one bar half.

    From the bar to the element are theta + 90 deg, turned across the other half, so that with the
    opening angle delta

        b = H sin((2 theta - delta) / 2),   a = +-H cos((2 theta - delta) / 2)

    (+ on the first half).  b is h of paper 000, eq. 21, which neglects a (docs/theory/truss2.md).
    The span to that half's own hinge pulley keeps its length, and the other has

        L^2 = l^2 + H^2 + 2 l H sin(theta - delta),

    which falls from the stowed angle on all the way if 90 deg <= theta <= 90 deg + delta.
    """

    kind: Literal["bar-half"] = "bar-half"
    on_rod: ClassVar[bool] = True
    angle: Annotated[float, Field(ge=90.0, le=270.0), Unit("deg")]
    """Angle theta."""
    half: Literal["first", "second"] = "first"
    """The half towards the section's first or second corner, seen from the boom."""

    def refusal(self, opening_angle: float) -> str | None:
        """See ``Bracket``."""
        most = 90.0 + opening_angle
        if self.angle <= most:
            return None
        return (
            f"bracket.angle = {self.angle} deg must be at most {most:g} deg, 90 deg above "
            "structure.opening_angle: the cable would first fold the bars (lower it, or raise "
            "structure.opening_angle)"
        )

    def place(self, phi: ArrayLike, distance: float) -> tuple[Array, Array]:
        """Offsets a and b with theta - delta / 2 = theta - 90 deg + phi."""
        turn = np.radians(self.angle - 90.0) + np.asarray(phi)
        sign = 1.0 if self.half == "first" else -1.0
        return sign * distance * np.cos(turn), distance * np.sin(turn)


# What a cable's path runs over; its winch and far end are points as well.
#
# A node names a moving frame where the path is used: a mount of a layout, or a node of an engine.


@dataclass(frozen=True)
class FixedSheave:
    """A sheave, winch or end of a rope fixed on the body of a node."""

    node: Any
    arm: Array
    """From the node to the point in the node's axes, m, shape (3,)."""

    @property
    def nodes(self) -> tuple[Any, ...]:
        """All nodes that carry it."""
        return (self.node,)


@dataclass(frozen=True)
class BlockSheave:
    """A V pulley on a block that stays on the bisector of two bar halves."""

    nodes: tuple[Any, ...]
    """Nodes of the first and the second half at their V-joint."""
    sense: float
    """+1 in the upper plane, -1 in the lower: the block stands inside of the joint."""
    offset: float
    """Distance from the joint's axis, m."""


Sheave = FixedSheave | BlockSheave


# Whether a drive has a limit, without which it has no margin.


def why_unlimited(cables: Cables | None, planes: tuple[str, ...]) -> str:
    """Which winch pulls with any force, and the cure; empty if none does."""
    for plane, cable in [] if cables is None else cables.present():
        for end, winch in zip(("winch", "far_winch"), cable.winches, strict=False):
            if not math.isfinite(winch.winding.available_tension()):
                return (
                    f'cables.{planes[plane]}.{end}.winding.kind = "{kind_of(winch.winding)}": '
                    "its force is not limited, so that no drive margin can be calculated (choose "
                    'kind = "motor" or "stall", or leave margin out)'
                )
    return ""
