"""The winches of all cables, turning within every Newton iteration."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.records import Cable, Cables, Winch
from ringsim.cable.ropes import Array, Ropes
from ringsim.cable.winding import FeedbackWinding, PrescribedWinding, WinchReading
from ringsim.choice import kind_of
from ringsim.parts.faults import AT_ONCE

# The winches of all cables, turning within every Newton iteration.
#
# A prescribed law gives the length wound at any time.  A feedback law depends on the tension at the
# end of the step, which depends on the rope wound during the step and on where the structure gets
# to: with V the speed of all such winches of a rope, h the time into the step, S its path and M its
# natural length without V,
#
#     V = sum_i command_i(r_i(V) q(y)),   y = EA (S / (M - W(V)) - 1 + t_d de/dt),
#
# r_i(V) the ratio of the tension at a winch to the rope's mean tension, were the n winches of the
# rope to turn at V / n each while the structure moves as at the beginning of the step.  The rope
# that they wind in the step follows from backward differences of second order, with g the mean
# speed of the step before and r = h over its length,
#
#     W(V) = h ((1 + r) V + r median(0, g, 2 V)) / (1 + 2 r);   W(V) = h V behind a jump.
#
# The median lets a drum that comes to a standstill wind nothing more: W has the sign of V.
# Commands fall with the tension, W and y grow with V, so there is one solution for any EA and step.
# A law that follows the structure takes for its rate the same differences of the path P = S_0 - S
# that it has given free so far in the step, with g* its mean rate in the step before: the V* for
# which P = h ((1 + r) V* + r median(0, g*, 2 V*)) / (1 + 2 r).  With the drum's g in place of g*
# its gain would count by two thirds.
#
# A law that has inertia takes for its acceleration the same differences of its own speed v:
#
#     dv/dt = (v - v*) / l,   l = h (1 + r) / (1 + 2 r),
#     v* = ((1 + r)^2 v_0 - r^2 v_-1) / (1 + 2 r),
#
# v_0 and v_-1 the speeds at the beginnings of this step and of the one before; v* stays between 0
# and 2 v_0, so that no drum that stands is thrown back.  Behind a jump l = h, v* = v_0.
#
# A step has the winches that turn behind its begin; where prescribed speeds jump, its end has those
# before the jump.  So steps must end where a law begins, bends or ends (``Winch.breaks``).


_NUDGE = 1e-8
"""Change of path in m by which the answer of the winches to the structure is measured: a hundred
million roundings of a path of 1 m, and still a force of 1e-3 N at EA = 1e5 N."""

_SECANTS = 8
"""Secants before Brent's method: from the last answer three or four are enough."""
_SAME, _ALIKE = 1e-15, 1e-11
"""Speeds (m/s, and relative) that are one: over a step of 0.1 s they wind 1e-14 m more or less, of
which a rope of EA = 1e5 N takes no notice (1e-10 N)."""


class _Member(NamedTuple):
    """A winch that answers: its law, with the least and largest speed (m/s), what it read at the
    beginning of the step, and how fast ``path_slope`` changes (m/rad/s).
    """

    law: FeedbackWinding
    least: float
    most: float
    begun: WinchReading
    bend: float


@dataclass
class _Rope:
    """A rope that winches with feedback wind in this step, as it was at the beginning."""

    path: float
    natural: float
    """Path (m), and natural length outside of the drums (m)."""
    material: list[float]
    """EA (N), Kelvin-Voigt time (s) and width of the passage from slack to taut (N)."""
    members: dict[tuple[int, int], _Member]
    """By cable and end (0 first, 1 far)."""
    speeds_at: dict[tuple[int, int], tuple[float, float]]
    """Speeds of the members at the beginnings of this step and of the one before, m/s."""
    total: float
    """Speed of all members at which they last balanced the rope, m/s."""
    before: tuple[float, float, float] | None = None
    """Time (s), rope wound (m) and path given free (m) for the same members in the step before;
    None behind a jump."""
    gain: float = 1.0
    """How fast their excess over the commands rose with it there."""
    known: tuple[tuple[float, ...], Array] | None = None
    """The last question and its answer: a tangent asks what its residual has asked."""

    def weights(self, elapsed: float) -> tuple[float, float, float, float]:
        """So long after the beginning of the step (s): times (s) for which a speed and its mean in
        the step before count, and these means of the rope wound and of the path given free (m/s).
        """
        if self.before is None or elapsed == 0.0:
            return elapsed, 0.0, 0.0, 0.0
        last, wound, freed = self.before
        ratio = elapsed / last
        past = elapsed * ratio / (1.0 + 2.0 * ratio)
        return elapsed - past, past, wound / last, freed / last

    def lagging(self, place: tuple[int, int], elapsed: float) -> tuple[float, float]:
        """What the speed of a member is compared with (m/s), and over what time (s), for its
        acceleration so long after the beginning of the step (s).
        """
        now, last = self.speeds_at[place]
        if self.before is None or elapsed == 0.0:
            return now, elapsed
        ratio = elapsed / self.before[0]
        share = 1.0 + 2.0 * ratio
        found = ((1.0 + ratio) ** 2 * now - ratio**2 * last) / share
        return _median(0.0, found, 2.0 * now), elapsed * (1.0 + ratio) / share

    def wound(self, elapsed: float, total: float) -> float:
        """Rope that all members have wound since the beginning of the step, m."""
        own, past, mean, _ = self.weights(elapsed)
        return own * total + past * _median(0.0, mean, 2.0 * total)

    def freed(self, path: float, natural: float) -> float:
        """Path (m) that the structure has given free for the members since the step began, but for
        what other winches have wound; from the present path and natural length without them (m).
        """
        return self.path - path - (self.natural - natural)

    def takeup(self, elapsed: float, path: float, natural: float, rate: float) -> float:
        """Rate of ``freed``, m/s; ``rate`` (m/s) if no time has passed."""
        if elapsed == 0.0:
            return rate
        own, past, _, mean = self.weights(elapsed)
        freed = self.freed(path, natural)
        # Where a structure stops, limited as ``wound`` is: both then follow it without a jerk.
        return _median(freed / own, (freed - past * mean) / own, freed / (own + 2.0 * past))

    def speeds(
        self, elapsed: float, path: float, rate: float, natural: float, rest: float
    ) -> Array:
        """Speed of every member (m/s) so long after the beginning of the step (s).

        ``natural`` is the rope's natural length (m) had they not wound since, and ``rest`` the
        speed of its other winches (m/s).
        """
        question = elapsed, path, rate, natural, rest
        if self.known is None or self.known[0] != question:
            self.known = question, self._balanced(*question)
        return self.known[1]

    def _balanced(
        self, elapsed: float, path: float, rate: float, natural: float, rest: float
    ) -> Array:
        """The answer, by a search from the last one."""
        count, (stiffness, damping_time, width) = len(self.members), self.material
        follow = -self.takeup(elapsed, path, natural, -rate - rest)
        laws, low, high = [], 0.0, 0.0
        for place, (law, least, most, begun, bend) in self.members.items():
            lagging, lag = self.lagging(place, elapsed)
            # ``replace`` would take several times as long.
            seen = WinchReading(
                tension_ratio=begun.tension_ratio, path_rate=follow / count,
                path_slope=begun.path_slope + elapsed * bend, time=begun.time + elapsed,
                lagging=lagging, lag=lag,
            )  # fmt: skip
            laws.append((law, seen, least, most))
            low, high = low + least, high + most

        def commands(total: float) -> list[float]:
            left = natural - self.wound(elapsed, total)
            strain_rate = (rate + path / left * (total + rest)) / left
            force = stiffness * (path / left - 1.0 + damping_time * strain_rate)
            # ``smooth`` of ropes.c for one number, which a call of the core would only delay; see
            # tests/cable/test_winding_laws.py for both.
            mean = max(force, 0.0) + width * math.log1p(math.exp(-abs(force) / width))
            return [
                min(max(law.command(mean * now.tension_ratio(total / count), now), least), most)
                for law, now, least, most in laws
            ]

        total, self.gain = root_of_rising(
            lambda v: v - sum(commands(v)), min(max(self.total, low), high), self.gain, low, high
        )
        self.total = total
        if count == 1:
            return np.array([total])
        found = np.array(commands(total))
        # Steep commands amplify the last bits of the total: share these out.
        return np.asarray(found + (total - found.sum()) / count)


def _median(a: float, b: float, c: float) -> float:
    return max(min(a, b), min(max(a, b), c))


def root_of_rising(
    excess: Callable[[float], float], guess: float, gain: float, low: float, high: float
) -> tuple[float, float]:
    """Where a function, that rises by at least its argument, is zero, and how fast it rises there.

    By secants from a guess and a slope: an iteration or a step ago the answer was nearly the same,
    and Brent's method would search all speeds of the motor each time.  It decides where bends of
    the function lead secants astray.  Speeds in m/s; ``excess`` is not positive at ``low``, nor
    negative at ``high``.

    Raises
    ------
    ValueError
        If the function has no number.
    """
    at, value = guess, excess(guess)
    for _ in range(_SECANTS):
        same = _SAME + _ALIKE * abs(at)
        low, high = (low, at) if value > 0.0 else (at, high)
        if abs(value) <= same or high - low <= 2.0 * same:
            return at, gain
        # Never a shorter way, so that the root is passed and held from both sides: a step that is
        # short since the gain was too large proves nothing.
        way = max(abs(value) / gain, same)
        to, before = min(max(at - math.copysign(way, value), low), high), value
        value = excess(to)
        at, gain = to, max((value - before) / (to - at), 1.0)
    from scipy.optimize import brentq  # here: it is rarely needed, and slow to load

    return float(brentq(excess, low, high, xtol=_SAME, rtol=_ALIKE)), gain


def driving(winches: Mapping[tuple[int, int], Winch], time: float, state: ChainState) -> bool:
    """Whether any winch, by cable and end, turns or will turn on a rope that is whole."""
    whole, rate = state.ropes.alive[state.ropes.of_end], state.wound_rate
    return any(
        whole[place] and winch.drives(time, float(rate[place])) for place, winch in winches.items()
    )


class Winches:
    """Rope wound and speeds at both ends of each cable."""

    def __init__(self, cables: Sequence[Cable]) -> None:
        self._winches = {
            (number, end): winch
            for number, cable in enumerate(cables)
            for end, winch in enumerate(cable.winches)
        }
        self._given = dict(self._winches)
        self._start, self._held = 0.0, np.zeros((len(cables), 2))
        self._rates = np.zeros_like(self._held)
        self._slopes = np.zeros(len(cables))
        self._turning: dict[tuple[int, int], FeedbackWinding] = {}
        self._ahead: dict[tuple[int, int], float] = {}
        self._ropes: dict[int, _Rope] = {}
        self._begun: dict[int, tuple[float, float]] = {}
        """Path and natural length (m) of every rope that answers, where the step began."""

    def path_slopes(self, slope: Callable[[int], float]) -> Array:
        """Derivatives of the cables' ideal paths after the opening angle, m/rad, shape (cables,),
        by a function of the cable's number; 0 where no winch asks for it.
        """
        asking = {
            n for (n, _), w in self._winches.items() if isinstance(w.winding, FeedbackWinding)
        }
        found = [slope(n) if n in asking else 0.0 for n in range(len(self._held))]
        return np.array(found)

    @property
    def answering(self) -> bool:
        """Whether any winch answers to its rope in this step."""
        return bool(self._ropes)

    def at(
        self, time: float, ropes: Ropes, paths: Array | None, rates: Array | None
    ) -> tuple[Array, Array]:
        """Rope wound (m) and its rate (m/s) at both ends of each cable, shape (cables, 2) each.

        The paths of the ropes (m) and their rates (m/s) are not needed if no winch answers.
        """
        wound, speed = self._prescribed(time)
        if not self._ropes or paths is None or rates is None:
            return wound, speed
        elapsed, asked = self._asked(time, ropes, paths, rates, wound, speed)
        for k, rope in self._ropes.items():
            answer = rope.speeds(elapsed, *asked[k])
            total = float(answer.sum())
            # All share what they wind together by their speeds.
            lasting = rope.wound(elapsed, total) / total if total else elapsed
            for place, found in zip(rope.members, answer, strict=True):
                speed[place] = found
                wound[place] += found * lasting
        return wound, speed

    def _prescribed(self, time: float) -> tuple[Array, Array]:
        """As ``at``, while all that answer to their ropes stand still."""
        wound, speed, begin = self._held.copy(), np.zeros(self._held.shape), self._start
        inside = max(time - AT_ONCE, 0.5 * (begin + time))
        moment = inside if time > begin else time + AT_ONCE
        for place, winch in self._winches.items():
            if isinstance(winch.winding, PrescribedWinding):
                wound[place], speed[place] = winch.at(time, moment=moment)
        for place, more in self._ahead.items():
            wound[place] += more
        return wound, speed

    def _asked(
        self, time: float, ropes: Ropes, paths: Array, rates: Array, wound: Array, speed: Array
    ) -> tuple[float, list[tuple[float, ...]]]:
        """What ``_Rope.speeds`` asks: the time since the step began, and the rest of each rope."""
        natural = ropes.content - ropes.per_rope(wound)
        asked = (paths, rates, natural, ropes.per_rope(speed))
        return time - self._start, [*zip(*(each.tolist() for each in asked), strict=True)]

    def memory(self) -> dict[str, Any]:
        """Every winch as it is by now: cable, end, table, what it has wound beyond its law, and
        whether it answered in the last step; and from what that began.
        """
        rows = [
            [*place, winch.model_dump(mode="json"), self._ahead.get(place, 0.0),
             place in self._turning]
            for place, winch in self._winches.items()
        ]  # fmt: skip
        ropes = [[k, *lengths] for k, lengths in self._begun.items()]
        begun = [self._start, self._held, self._rates, self._slopes, ropes]
        return {"winches": rows, "begun": begun}

    def go_on(
        self,
        memory: dict[str, Any],
        before: Sequence[Cable],
        time: float,
        wound: Array,
        rate: Array,
    ) -> None:
        """Go on at a time (s) from a memory of winches that were those of the cables ``before``.

        Rope wound (m) and its rate (m/s) are of shape (cables, 2).  A winch that is another one now
        begins with the rope that is on its drum; its rate is entered.
        """
        self._start, self._held, self._rates, self._slopes, ropes = memory["begun"]
        self._begun = {k: (path, natural) for k, path, natural in ropes}
        for number, end, table, ahead, turning in memory["winches"]:
            place = number, end
            # As the scene has it: a controller has commanded the winch of this run already.
            self._winches[place] = self._given[place]
            if self._winches[place] == before[number].winches[end]:
                winch = self._winches[place] = Winch.model_validate(table)
                if turning and isinstance(winch.winding, FeedbackWinding):
                    self._turning[place] = winch.winding
            elif isinstance(self._winches[place].winding, FeedbackWinding):
                continue
            else:
                by_law, rate[place] = self._winches[place].at(time, moment=time + AT_ONCE)
                ahead = float(wound[place]) - by_law
            if ahead and not isinstance(self._winches[place].winding, FeedbackWinding):
                self._ahead[place] = ahead

    def command(self, time: float, speeds: Mapping[tuple[int, int], float]) -> bool:
        """Let winches have the speeds (m/s) that a controller commands at a time (s), or have them
        from their start on; returns whether any law has changed.
        """
        changed = False
        for place, speed in speeds.items():
            winch = self._winches[place]
            early = time + AT_ONCE < winch.start_time
            if early or winch.turns(time + AT_ONCE):
                law = winch.winding.told(speed, max(time - winch.start_time, 0.0))
                if law is not winch.winding:
                    changed = True
                    self._winches[place] = winch.model_copy(update={"winding": law})
        return changed

    def next_bend(self, time: float) -> float:
        """Where a law bends next after a time (s), s; infinite if none does."""
        bends = (bend for winch in self._winches.values() for bend in winch.breaks())
        return min((bend for bend in bends if bend > time + AT_ONCE), default=math.inf)

    def commands(self) -> Array:
        """Speeds that winches are told by a controller, or could be, m/s, shape (cables, 2); NaN of
        others.
        """
        found = np.full(self._held.shape, math.nan)
        for place, winch in self._winches.items():
            if winch.winding.commandable:
                found[place] = winch.winding.commanded_speed()
        return found

    def lock(self, number: int, time: float, state: ChainState) -> None:
        """The plane of a cable has locked at a time (s): its winches do what they do then."""
        for place, winch in self._winches.items():
            if place[0] == number and winch.after_lock != "pull":
                tension = float(state.winch_tensions[place])
                self._winches[place] = winch.locked(time, tension)

    def driving(self, time: float, state: ChainState) -> bool:
        """Whether any winch turns or will turn on a rope that is whole."""
        return driving(self._winches, time + AT_ONCE, state)

    def stiffness_left(self, time: float, ropes: Ropes, paths: Array, rates: Array) -> Array:
        """Share of a change of path that stretches the rope, not answered by its winches."""
        left = np.ones(len(ropes.starts))
        elapsed, asked = self._asked(time, ropes, paths, rates, *self._prescribed(time))
        for k, rope in self._ropes.items():
            path, *rest = asked[k]
            near, far = (
                rope.wound(elapsed, float(rope.speeds(elapsed, at, *rest).sum()))
                for at in (path, path + _NUDGE)
            )
            left[k] += (far - near) / _NUDGE
        return np.minimum(np.maximum(left, 0.0), 1.0)

    def advance(self, time: float, state: ChainState, slopes: Array) -> None:
        """Begin a step at ``time`` (s) in a state of the chain.

        ``slopes`` are those of ``path_slopes``.  Called twice at one time it begins anew, as behind
        a jump: what turned before no longer counts.
        """
        last, moved, past = time - self._start, state.wound - self._held, self._turning
        rates = self._rates
        begun, natural = self._begun, state.ropes.content - state.ropes.per_rope(state.wound)
        bends = (slopes - self._slopes) / last if last > 0.0 else 0.0 * slopes
        self._start, self._held, self._slopes, self._ropes = time, state.wound, slopes, {}
        self._rates = state.wound_rate
        for place, winch in self._winches.items():
            if isinstance(winch.winding, FeedbackWinding) and winch.turns(time + AT_ONCE):
                k = int(state.ropes.of_end[place])
                anew = _Rope(
                    float(state.paths[k]), float(natural[k]), state.material[:, k].tolist(),
                    {}, {}, 0.0,
                )  # fmt: skip
                reading = state.reading(*place, float(slopes[place[0]]))
                reading = replace(reading, time=time - winch.start_time)
                rope = self._ropes.setdefault(k, anew)
                law, bend = winch.winding, float(bends[place[0]])
                rope.members[place] = _Member(law, *law.limits(), reading, bend)
                now = float(state.wound_rate[place])
                rope.speeds_at[place] = now, float(rates[place])
                rope.total += now
        self._turning = {}
        for k, rope in self._ropes.items():
            laws = {place: member.law for place, member in rope.members.items()}
            if last > 0.0 and k in begun and all(past.get(p) is law for p, law in laws.items()):
                wound, (path, length) = sum(float(moved[p]) for p in laws), begun[k]
                rope.before = last, wound, path - rope.path - (length - rope.natural - wound)
            self._turning |= laws
        self._begun = {k: (rope.path, rope.natural) for k, rope in self._ropes.items()}


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
