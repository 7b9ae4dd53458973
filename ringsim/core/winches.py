"""The winches of all cables, turning within every Newton iteration."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.friction import Friction, Pulleys
from ringsim.cable.records import Cable, Winch
from ringsim.cable.ropes import Array, Indices, Ropes
from ringsim.cable.winding import FeedbackWinding, PrescribedWinding, WinchReading
from ringsim.core.library import ask, call
from ringsim.core.tension import RopeTable
from ringsim.parts.faults import AT_ONCE

# The winches of all cables, turning within every Newton iteration.
#
# A prescribed law gives the length wound at any time.  A feedback law depends on the tension at the
# end of the step, which depends on the rope wound during the step and on where the structure gets
# to: with V the speed of all such winches of a rope, h the time into the step, S its path and M its
# natural length without V,
#
#     V = sum_i command_i(r_i q(y)),   y = EA (S / (M - W(V)) - 1 + t_d de/dt),
#
# r_i the ratio of the tension at a winch to the rope's mean tension, were its winches to turn as
# their laws command while the structure moves as at the beginning of the step: of two, the speeds
# (V + D) / 2 and (V - D) / 2, where D is the difference of what is commanded at them.  It rises by
# less than D does, since the winch that is ahead has the larger tension: one D for each V.  The
# rope that they wind in the step follows from backward differences of second order, with g the mean
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


LAWS = 2
"""Number from which on the core asks for what laws of winches say (core.h)."""


class Answering(NamedTuple):
    """Winches that answer to their ropes in a step, which the core lets turn (winches.c).

    Winches are told by cable and end, shape (cables, 2).
    """

    on: Indices
    """Whether each answers."""
    moves: bool
    """Whether ln(eta) of any pulley changes with its speed."""
    held: Array
    """Rope wound (m) and speeds (m/s) while those that answer stand, (2, cables, 2)."""
    turned: Array
    """The same with their answers."""
    paths: Array
    """Lengths (m) and rates (m/s) of the paths, (2, ropes)."""
    elapsed: Array
    """Time since the step began, s, (1,)."""
    began: Array
    """Path and natural length outside of the drums as the step began, m, (ropes, 2)."""
    past: Array
    """Of the step before its length (s; 0 behind a jump), rope wound and path given free (m),
    (ropes, 3)."""
    balance: Array
    """Speed of all its winches at which they last balanced a rope (m/s), how fast their excess over
    the commands rose there, and both of the speed by which the first is the faster one,
    (ropes, 4)."""
    asked: Array
    """What was asked last, (ropes, 5)."""
    limits: Array
    """Least and largest speed, m/s, (cables, 2, 2)."""
    speeds: Array
    """At the beginnings of this step and of the one before, m/s, (cables, 2, 2)."""
    slopes: Array
    """Of the ideal path (m/rad) as the step began, and its rate, (cables, 2, 2)."""
    since: Array
    """Time since each has started, as the step began, s."""
    found: Array
    """Speeds that answer, m/s."""
    lengths: Array
    """Of the spans as the step began, m."""
    sliding: Array
    """Speeds of the ropes over the pulleys as the step began, m/s."""
    decays: Array
    """ln(eta) of the pulleys."""
    seen: Array
    """Speeds over the pulleys that are foreseen, m/s."""
    logs: Array
    """Room, (spans,)."""
    told: Array
    """What a law sees, and what it says, (7,)."""

    @classmethod
    def of(cls, ropes: Ropes, *, moves: bool) -> "Answering":
        """Of ropes that nothing winds yet."""
        cables, count, pulleys = len(ropes.points_per_cable), len(ropes.starts), len(ropes.behind)
        ends = cables, 2
        shapes = [
            (2, *ends), (2, *ends), (2, count), (1,), (count, 2), (count, 3), (count, 4),
            (count, 5), (*ends, 2), (*ends, 2), (*ends, 2), ends, ends, (ropes.spans,), (pulleys,),
            (pulleys,), (pulleys,), (ropes.spans,), (7,),
        ]  # fmt: skip
        numbers = [np.zeros(shape) for shape in shapes]
        return cls(np.zeros(ends, dtype=np.int64), moves, *numbers)


def driving(
    winches: Mapping[tuple[int, int], Winch], time: float, state: ChainState, end: float
) -> bool:
    """Whether any winch, by cable and end, turns or will turn before an end (s) on a rope that is
    whole.
    """
    ropes, rate = state.ropes, state.wound_rate
    return any(
        winch.drives(time, float(rate[place]), end) and bool(ropes.alive[ropes.of_end[place]])
        for place, winch in winches.items()
    )


class Winches:
    """Rope wound and speeds at both ends of each cable.

    Attributes
    ----------
    commands
        Speeds that winches are told by a controller, or could be, m/s, shape (cables, 2); NaN of
        others.
    """

    commands: Array

    def __init__(self, cables: Sequence[Cable]) -> None:
        self._winches = {
            (number, end): winch
            for number, cable in enumerate(cables)
            for end, winch in enumerate(cable.winches)
        }
        self._given = dict(self._winches)
        self._start, self._held = 0.0, np.zeros((len(cables), 2))
        self._rates = np.zeros_like(self._held)
        self._moves = any(cable.friction.moves for cable in cables)
        self._slopes = np.zeros(len(cables))
        self._turning: dict[tuple[int, int], FeedbackWinding] = {}
        self._ahead: dict[tuple[int, int], float] = {}
        self._begun: dict[int, tuple[float, float]] = {}
        """Path and natural length (m) of every rope that answers, where the step began."""
        self._known: tuple[Ropes, Answering] | None = None
        self._at: _Begun | None = None
        self._tell()

    def path_slopes(self, slope: Callable[[int], float]) -> Array:
        """Derivatives of the cables' ideal paths after the opening angle, m/rad, shape (cables,),
        by a function of the cable's number; 0 where no winch asks for it.
        """
        asking = {
            n for (n, _), w in self._winches.items() if isinstance(w.winding, FeedbackWinding)
        }
        found = np.zeros(len(self._held))
        for n in asking:
            found[n] = slope(n)
        return found

    @property
    def answering(self) -> bool:
        """Whether any winch answers to its rope in this step."""
        return self._at is not None and bool(self._turning)

    def table(self, ropes: Ropes) -> Answering:
        """Those of ropes as the core takes them."""
        if self._known is None or self._known[0] is not ropes:
            self._known = ropes, Answering.of(ropes, moves=self._moves)
        return self._known[1]

    def at(
        self, time: float, paths: Array | None = None, rates: Array | None = None
    ) -> tuple[Array, Array]:
        """Rope wound (m) and its rate (m/s) at both ends of each cable, shape (cables, 2) each.

        The paths of the ropes (m) and their rates (m/s) are not needed if no winch answers.
        """
        if paths is None or rates is None or self._at is None or not self.answering:
            return self._prescribed(time)
        table = self.hold(time)
        table.paths[:] = paths, rates
        self._ask("turn_winches", self._at)
        return table.turned[0].copy(), table.turned[1].copy()

    def hold(self, time: float) -> Answering:
        """Enter a time (s) in the step, with what winches have wound by then that do not answer."""
        assert self._at is not None
        table = self._at.table
        table.held[:], table.elapsed[0] = self._prescribed(time), time - self._start
        return table

    def stiffness_left(self, time: float, paths: Array, rates: Array) -> Array:
        """Share of a change of path that stretches the rope, not answered by its winches."""
        assert self._at is not None
        left = np.ones(len(paths))
        self.hold(time).paths[:] = paths, rates
        self._ask("find_left", self._at, left)
        return left

    def _ask(self, name: str, begun: "_Begun", *given: Array) -> None:
        self.answer_in(lambda function: call(name, begun.table, begun.ropes, function, *given))

    def answer_in(self, function: Callable[[Any], int]) -> None:
        """Call a function of the core with what it may ask; ValueError if a law says no number."""
        if ask(lambda what: self.answer(what - LAWS), function):
            raise ValueError("a winding law commands a speed that is no number")

    def answer(self, what: int) -> None:
        """What the core asks of a winch: the speed that its law commands, or ln(eta)."""
        assert self._at is not None
        table = self._at.table
        winch, decays = divmod(what, 2)
        if decays:
            seen = self._at.pulleys._replace(speed=np.abs(table.seen))
            table.decays[:] = self._at.friction.decays(seen)
            return
        tension, *seen, _ = table.told.tolist()
        law = self._turning[divmod(winch, 2)]
        table.told[-1] = law.command(tension, WinchReading(*seen))

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
                if not self._winches[place].turns(time + AT_ONCE):
                    rate[place] = 0.0
                continue
            else:
                by_law, rate[place] = self._winches[place].at(time, moment=time + AT_ONCE)
                ahead = float(wound[place]) - by_law
            if ahead and not isinstance(self._winches[place].winding, FeedbackWinding):
                self._ahead[place] = ahead
        self._tell()

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
        self._tell()
        return changed

    def next_bend(self, time: float) -> float:
        """Where a law bends next after a time (s), s; infinite if none does."""
        bends = (bend for winch in self._winches.values() for bend in winch.breaks())
        return min((bend for bend in bends if bend > time + AT_ONCE), default=math.inf)

    def _tell(self) -> None:
        """Note what winches are told, since another law has come to some."""
        self.commands = np.full(self._held.shape, math.nan)
        for place, winch in self._winches.items():
            if winch.winding.commandable:
                self.commands[place] = winch.winding.commanded_speed()

    def lock(self, number: int, time: float, state: ChainState) -> None:
        """The plane of a cable has locked at a time (s): its winches do what they do then."""
        for place, winch in self._winches.items():
            if place[0] == number and winch.after_lock != "pull":
                tension = float(state.winch_tensions[place])
                now = self._winches[place] = winch.locked(time, tension)
                if isinstance(now.winding, FeedbackWinding):  # it begins with what is on its drum
                    self._ahead.pop(place, None)
        self._tell()

    def driving(self, time: float, state: ChainState, end: float) -> bool:
        """See the function of this name; from a time (s) on."""
        return driving(self._winches, time + AT_ONCE, state, end)

    def advance(
        self, time: float, state: ChainState, slopes: Array, ropes: Ropes | None = None,
        roped: RopeTable | None = None,
    ) -> None:  # fmt: skip
        """Begin a step at ``time`` (s) in a state of the chain.

        ``slopes`` are those of ``path_slopes``; ``ropes`` are those that faults have just made of
        the state's, with their table.  Called twice at one time it begins anew, as behind a jump:
        what turned before no longer counts.
        """
        ropes, roped = ropes or state.ropes, roped or state.table
        last, before, past = time - self._start, self._held, self._turning
        rates, begun, turned = self._rates, self._begun, self._slopes
        self._start, self._held, self._slopes = time, state.wound, slopes
        self._rates, self._turning, self._begun = state.wound_rate, {}, {}
        for place, winch in self._winches.items():
            if isinstance(winch.winding, FeedbackWinding) and winch.turns(time + AT_ONCE):
                self._turning[place] = winch.winding
        if not self._turning:
            return
        moved = self._held - before
        paths, natural = ropes.along(state.lengths), ropes.content - ropes.per_rope(self._held)
        bends = (slopes - turned) / last if last > 0.0 else 0.0 * slopes
        table = self.table(ropes)
        self._at = _Begun(table, roped, state.friction, state.pulleys)
        for own in (table.on, table.past, table.balance):
            own[...] = 0
        table.asked[:] = math.nan
        table.lengths[:], table.sliding[:] = state.lengths, state.speeds
        table.decays[:] = state.log_decays
        for place, law in self._turning.items():
            number = place[0]
            table.on[place], table.limits[place] = 1, law.limits()
            table.speeds[place] = state.wound_rate[place], rates[place]
            table.slopes[place] = slopes[number], bends[number]
            table.since[place] = time - self._winches[place].start_time
        by_rope: dict[int, dict[tuple[int, int], FeedbackWinding]] = {}
        for place, law in self._turning.items():
            by_rope.setdefault(int(ropes.of_end[place]), {})[place] = law
        for k, laws in by_rope.items():
            path, length = self._begun[k] = float(paths[k]), float(natural[k])
            table.began[k] = path, length
            speeds = [float(state.wound_rate[place]) for place in sorted(laws)]
            table.balance[k] = sum(speeds), 1.0, speeds[0] - speeds[-1], 1.0
            if last > 0.0 and k in begun and all(past.get(p) is law for p, law in laws.items()):
                wound, (from_path, from_length) = sum(float(moved[p]) for p in laws), begun[k]
                table.past[k] = last, wound, from_path - path - (from_length - length - wound)


class _Begun(NamedTuple):
    """What a step began with."""

    table: Answering
    ropes: RopeTable
    friction: Friction
    pulleys: Pulleys
