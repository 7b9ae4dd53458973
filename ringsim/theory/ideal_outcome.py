"""From the steps of an ideal ring to an outcome with the variables of the full model."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline

from ringsim.layout.pose import Array
from ringsim.outputs.asynchrony import Asynchrony
from ringsim.outputs.cable_tension import PEAK, CableTension
from ringsim.outputs.family import Output, Values, axes
from ringsim.outputs.recorder import ended, outputs_of, overloads, reduced, spanned
from ringsim.outputs.series import Carried, Reading, Run, Series, output_times
from ringsim.scene import Scene
from ringsim.stepping.instant import Energies
from ringsim.theory.ideal_course import Course, Piece
from ringsim.theory.ideal_motion import IdealState
from ringsim.variables import COUNTS, Fidelity, Outcome

_Reader = Callable[[Reading], Array | float | None]


@dataclass(frozen=True)
class _Evaluated(Series):
    """Readings at the ends of steps, and evaluated anew wherever they are asked for."""

    evaluate: Callable[[Array], Array]

    def _within(self, where: Array, rates: Array | None) -> Array:
        return self.evaluate(where)


def to_outcome(course: Course, scene: Scene) -> Outcome:
    """Put a run on the scene's output grid; what lies after its end is NaN.

    Angles come from the quintic that fits angle, rate and acceleration at both ends of a step,
    energies lost and supplied from the cubic that fits them and their rates, tensions from one
    through all points at which the steps are in balance; all else follows from the state.
    """
    ideal = _IdealRun(course, scene)
    values = reduced(ideal.run, outputs_of(scene), ideal.series_of)
    if course.motion.cables is not None:
        values |= {name: np.asarray(value) for name, value in ideal.cables().items()}
    coordinates = spanned(values, axes(scene))
    values |= {
        "fidelity": np.array(int(Fidelity.IDEAL)),
        "restarts": np.array(0),
        "step_used": np.array(scene.solver.step),
        "tolerance_used": np.array(np.nan),
        **{f"total_{name}": np.array(ideal.run.counts[name]) for name in COUNTS},
    }
    passed = overloads(scene, outputs_of(scene), ideal.series_of)
    return ended(course.status, course.fate, course.reason, passed, coordinates, values)


class _IdealRun:
    """A course as the ``run`` that outputs reduce."""

    def __init__(self, course: Course, scene: Scene) -> None:
        self._course, self._shape = course, (2, scene.structure.sections)
        self._grid, self._lifted = output_times(scene), 0.0
        self._known: dict[bytes, list[Reading]] = {}
        self._steps: list[Reading] = []
        self._balanced: list[Reading] = []  # ends of steps, collocation points between them
        first = course.pieces[0]
        self._lifted = first.instants[0].acting.work + first.states[0][-1]
        for piece in course.pieces:
            self._under(piece)
            ends = [
                self._told(*end)
                for end in zip(piece.times, piece.states, piece.instants, strict=True)
            ]
            inner = [self._told(time, state) for time, state in piece.inner]
            self._steps += ends
            self._balanced += sorted([*ends, *inner], key=lambda now: now.time)
        counts = {
            "steps": len(self._steps) - len(course.pieces),
            "newton_iterations": course.evaluations,
            "jacobians": course.jacobians,
        }
        angles, rates = self._series(lambda now: now.angles), self._series(lambda now: now.rates)
        locks = np.full(self._shape, course.lock_time)
        self.run = Run(scene, angles, rates, locks, counts, axes(scene))

    def series_of(self, output: Output) -> Series | None:
        """Readings at the ends of steps; of tensions at all points that are in balance."""
        # All sections of the ideal ring open alike because it is made so, which is no finding.
        if isinstance(output, Asynchrony) or output.read(self._steps[0]) is None:
            return None
        if isinstance(output, CableTension):
            return Series(*_readings(output.read, self._balanced), self._grid)
        return self._series(output.read)

    def cables(self) -> Values:
        """The largest tension, and how long ropes were slack, between readings as well."""
        times, tensions = _readings(CableTension().read, self._balanced)
        counts = times <= self.run.until
        peak, moment = _top(times[counts], np.nanmax(tensions[counts], axis=(1, 2)))
        where = PEAK.of(self.run, times[counts], tensions[counts])
        chains = [now.chain for now in self._balanced if now.chain]
        # Path less natural length of the rope at each cable's first winch, m; -1 if it is cut.
        stretch = [
            np.where(chain.ropes.alive, chain.paths - chain.natural, -1.0)[chain.ropes.of_end[:, 0]]
            for chain in chains
        ]
        until = np.minimum(times, self.run.until)
        slack = np.array([_time_below_zero(until, each) for each in np.transpose(stretch)])
        slack = self._balanced[0].by_plane(slack)
        top = {"peak_tension": peak, "peak_tension_time": moment}
        return where | top | {"slack_duration": slack}

    def _series(self, read: _Reader) -> Series:
        def evaluate(where: Array) -> Array:
            return _readings(read, self._instants(where))[1]

        return _Evaluated(*_readings(read, self._steps), self._grid, evaluate)

    def _instants(self, where: Array) -> list[Reading]:
        """The run at some times; the later piece where two meet."""
        pieces, key = self._course.pieces, where.tobytes()
        if key not in self._known:
            last = np.searchsorted([piece.times[0] for piece in pieces], where, side="right") - 1
            seen = [self._at(piece, where[last == k]) for k, piece in enumerate(pieces)]
            self._known[key] = [now for part in seen for now in part]
        return self._known[key]

    def _at(self, piece: Piece, where: Array) -> list[Reading]:
        """A piece at times within it."""
        self._under(piece)
        times, states = np.array(piece.times), np.array(piece.states)
        found = np.repeat(states[:1], len(where), axis=0)
        if len(times) > 1 and len(where):
            rates, n = np.array(piece.rates), self._course.motion.mechanism.freedom
            found = CubicHermiteSpline(times, states, rates)(where)
            known = np.stack([states[:, :n], states[:, n : 2 * n], rates[:, n : 2 * n]], axis=1)
            quintic = BPoly.from_derivatives(times, known)
            found[:, :n], found[:, n : 2 * n] = quintic(where), quintic.derivative()(where)
        return [self._told(float(t), y) for t, y in zip(where, found, strict=True)]

    def _under(self, piece: Piece) -> None:
        """Evaluate as in a piece from here on."""
        self._course.motion.under(
            latched=piece.latched, until=piece.times[-1], ropes=piece.ropes, sprung=piece.sprung
        )

    def _told(self, time: float, state: Array, known: IdealState | None = None) -> Reading:
        """A state as every output reads it; work counts from the first one."""
        motion = self._course.motion
        now = motion.instant(time, state) if known is None else known
        work = now.acting.work - self._lifted + state[-1]
        opening, rate = math.pi - 2.0 * state[0], -2.0 * state[motion.mechanism.freedom]
        return Reading(
            time,
            np.full(self._shape, opening),
            np.full(self._shape, rate),
            Energies(now.kinetic, now.elastic, work, state[-2]),
            chain=None if now.pull is None else now.pull.chain,
            planes=() if motion.cables is None else tuple(motion.cables.planes),
            carried=None if now.reaction is None else Carried(now.reaction, np.eye(3), None),
            edge=motion.edge_tensions(state),
        )


def _readings(read: _Reader, instants: list[Reading]) -> tuple[Array, Array]:
    values = np.array([read(now) for now in instants], dtype=float)
    return np.array([now.time for now in instants]), values


def _top(times: Array, series: Array) -> tuple[float, float]:
    """Largest value and its time, of the parabola through the largest one and its neighbours."""
    k = int(np.argmax(series))
    top, moment = float(series[k]), float(times[k])
    if not 0 < k < len(series) - 1 or not times[k - 1] < moment < times[k + 1]:
        return top, moment
    t, x = times[k - 1 : k + 2] - moment, series[k - 1 : k + 2] - top
    bend = (x[2] / t[2] - x[0] / t[0]) / (t[2] - t[0])
    slope = x[0] / t[0] - bend * t[0]
    if bend >= 0.0:
        return top, moment
    return float(top - 0.25 * slope**2 / bend), float(moment - 0.5 * slope / bend)


def _time_below_zero(times: Array, series: Array) -> float:
    """Time for which a series, linear between its points, is negative."""
    before, after = series[:-1], series[1:]
    low, high = np.minimum(before, after), np.maximum(before, after)
    share = np.where(high < 0.0, 1.0, np.maximum(-low, 0.0) / np.maximum(high - low, 1e-300))
    return float(np.sum(share * np.diff(times)))
