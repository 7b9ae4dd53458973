"""From the steps of an ideal ring to an outcome with the variables of the full model."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ringsim.scene import Scene
from ringsim.theory.ideal_course import Course, Piece, quintic
from ringsim.theory.ideal_motion import Instant
from ringsim.variables import COUNTS, PLANES, Fidelity, Outcome

Array = NDArray[np.float64]


class _Seen(NamedTuple):
    """A course at some times: states (times, size), and what belongs to each."""

    times: Array
    states: Array
    instants: list[Instant]


def to_outcome(course: Course, scene: Scene, *, wall_time: float, cpu_time: float) -> Outcome:
    """Put a run on the scene's output grid; what lies after its end is NaN.

    Angles come from the quintic that fits angle, rate and acceleration at both ends of a step,
    energies lost and supplied from the cubic that fits them and their rates, tensions from one
    through all points at which the steps are in balance; all else follows from the state.
    """
    count = math.floor(scene.solver.end_time / scene.record.interval * (1.0 + 1e-12))
    grid = np.arange(count + 1) * scene.record.interval
    sections = scene.structure.sections
    coordinates: dict[str, Any] = {
        "plane": np.array(PLANES),
        "section": np.arange(1, sections + 1),
        "time": grid,
    }
    end = course.pieces[-1].times[-1]
    where = np.minimum(grid[grid <= end * (1.0 + 1e-12)], end)
    seen = _on_grid(course, where)
    values: dict[str, Array] = {}

    def whole(found: Array) -> Array:
        rest = np.full((*found.shape[:-1], len(grid) - len(where)), np.nan)
        return np.concatenate([found, rest], axis=-1)

    opening = whole(np.degrees(math.pi - 2.0 * seen.states[:, 0]))
    values["opening_angle"] = np.broadcast_to(opening, (2, sections, len(grid))).copy()
    values["lock_time"] = np.full((2, sections), course.lock_time)
    values["deployment_time"] = np.array(course.lock_time)
    values["asynchrony"] = values["constraint_violation"] = whole(np.zeros(len(where)))
    values["asynchrony_max"] = values["constraint_error"] = np.array(0.0)
    steps = [_at(course, piece, np.array(piece.times)) for piece in course.pieces]
    start = steps[0].instants[0]
    parts = _energies(seen, start)
    for name, series in parts.items():
        values[name] = whole(series)
    values["energy_error"] = np.array(_imbalance(steps, start))
    if course.motion.cables is not None:
        coordinates["span"] = np.arange(1, scene.spans + 1)
        _add_cables(values, course, steps, seen, whole)
    counts = {
        "steps": sum(len(piece.times) - 1 for piece in course.pieces),
        "newton_iterations": course.evaluations,
        "jacobians": course.jacobians,
        "restarts": 0,
        "fidelity": int(Fidelity.IDEAL),
    }
    counts |= {f"total_{name}": counts[name] for name in COUNTS}
    values.update({name: np.array(number) for name, number in counts.items()})
    values["step_used"] = np.array(scene.solver.step)
    values["tolerance_used"] = np.array(np.nan)
    values["final_time"] = np.array(end)
    values["wall_time"], values["cpu_time"] = np.array(wall_time), np.array(cpu_time)
    return Outcome(course.status, course.reason, coordinates, values)


def _at(course: Course, piece: Piece, where: Array) -> _Seen:
    """A piece at times within it."""
    motion = course.motion
    motion.latched, motion.until = piece.latched, piece.times[-1]
    if motion.cables is not None and piece.ropes is not None:
        motion.cables.ropes = piece.ropes
    times, states = np.array(piece.times), np.array(piece.states)
    found = np.repeat(states[:1], len(where), axis=0)
    keep = np.append(True, np.diff(times) > 0.0)
    if keep.sum() > 1 and len(where):
        times, states, rates = times[keep], states[keep], np.array(piece.rates)[keep]
        turn = motion.rate_of_phi
        found = CubicHermiteSpline(times, states, rates)(where)
        both = np.stack([states[:, :turn], states[:, turn : 2 * turn]], axis=1)
        curve = quintic(times, both, rates[:, turn : 2 * turn])
        found[:, :turn], found[:, turn : 2 * turn] = curve(where), curve.derivative()(where)
    instants = [motion.instant(float(t), y) for t, y in zip(where, found, strict=True)]
    return _Seen(where, found, instants)


def _on_grid(course: Course, where: Array) -> _Seen:
    """All pieces at the output's times; the later one where two meet."""
    last = np.searchsorted([piece.times[0] for piece in course.pieces], where, side="right") - 1
    seen = [_at(course, piece, where[last == k]) for k, piece in enumerate(course.pieces)]
    states = np.concatenate([part.states for part in seen])
    return _Seen(where, states, [instant for part in seen for instant in part.instants])


def _energies(seen: _Seen, start: Instant) -> dict[str, Array]:
    """Energies by their names, J; work counts from the start."""
    now = seen.instants
    lifted = np.array([i.acting.work for i in now]) - start.acting.work
    return {
        "kinetic_energy": np.array([i.kinetic for i in now]),
        "elastic_energy": np.array([i.elastic for i in now]),
        "work": lifted + seen.states[:, -1],
        "dissipation": seen.states[:, -2],
    }


def _imbalance(steps: list[_Seen], start: Instant) -> float:
    """Largest energy imbalance at any step over the largest energy exchanged."""
    wrong, exchanged = 0.0, 1e-300
    for seen in steps:
        parts = _energies(seen, start)
        kinetic, elastic = parts["kinetic_energy"], parts["elastic_energy"] - start.elastic
        balance = kinetic + elastic + parts["dissipation"] - parts["work"]
        wrong = max(wrong, float(np.abs(balance).max()))
        exchanged = max(
            exchanged, *(float(np.abs(x).max()) for x in (kinetic, elastic, parts["work"]))
        )
    return wrong / exchanged


def _add_cables(
    values: dict[str, Array], course: Course, steps: list[_Seen], seen: _Seen, whole: Any
) -> None:
    """Tensions by plane and span; a plane without a cable is NaN."""
    cables = course.motion.cables
    assert cables is not None
    wound = np.array([i.pull.chain.wound.sum(axis=1) for i in seen.instants if i.pull])
    sizes = 2, cables.spans, len(seen.times)
    tensions, reeled, loose = (
        np.full(sizes, np.nan),
        np.full(sizes[::2], np.nan),
        np.full(2, np.nan),
    )
    for number, planes in enumerate(cables.planes):
        reeled[list(planes)], loose[list(planes)] = wound[:, number], 0.0
    peak = (-math.inf, math.nan)
    until = course.lock_time if math.isfinite(course.lock_time) else math.inf
    for piece, at_steps in zip(course.pieces, steps, strict=True):
        _at(course, piece, np.zeros(0))
        inner = [(time, course.motion.instant(time, state)) for time, state in piece.inner]
        line = sorted([*zip(piece.times, at_steps.instants, strict=True), *inner], key=_moment)
        chains = [instant.pull.chain for _, instant in line if instant.pull is not None]
        times = np.array([time for time, _ in line])
        found = np.array([cables.tensions(chain) for chain in chains])
        counts = times <= until
        if counts.any():
            peak = max(peak, _top(times[counts], np.nanmax(found[counts], axis=(1, 2))))
        stretch = np.array([cables.stretches(chain) for chain in chains])
        own = (seen.times >= times[0]) & (seen.times <= times[-1])
        curve, missing = _through(times, np.nan_to_num(found)), np.isnan(found[0])
        for number, planes in enumerate(cables.planes):
            loose[list(planes)] += _time_below_zero(times, stretch[:, number])
            for plane in planes:
                at_spans = np.where(missing, np.nan, curve(seen.times[own]))
                tensions[plane][:, own] = at_spans[:, number].T
    values["cable_tension"], values["wound_length"] = whole(tensions), whole(reeled)
    values["slack_duration"] = loose
    values["peak_tension"], values["peak_tension_time"] = np.array(peak[0]), np.array(peak[1])


def _moment(item: tuple[float, Instant]) -> float:
    return item[0]


def _through(times: Array, series: Array) -> Any:
    """Shape-preserving cubic through a series, which may be one point."""
    keep = np.append(True, np.diff(times) > 0.0)
    if keep.sum() == 1:
        return lambda where: np.repeat(series[:1], len(where), axis=0)
    return PchipInterpolator(times[keep], series[keep], axis=0)


def _top(times: Array, series: Array) -> tuple[float, float]:
    """Largest value and its time, of the parabola through the largest one and its neighbours."""
    k = int(np.argmax(series))
    if not 0 < k < len(series) - 1:
        return float(series[k]), float(times[k])
    t, x = times[k - 1 : k + 2] - times[k], series[k - 1 : k + 2] - series[k]
    if t[0] == 0.0 or t[2] == 0.0:
        return float(series[k]), float(times[k])
    bend = (x[2] / t[2] - x[0] / t[0]) / (t[2] - t[0])
    slope = x[0] / t[0] - bend * t[0]
    if bend >= 0.0:
        return float(series[k]), float(times[k])
    return float(series[k] - 0.25 * slope**2 / bend), float(times[k] - 0.5 * slope / bend)


def _time_below_zero(times: Array, series: Array) -> float:
    """Time for which a series, linear between its points, is negative."""
    before, after = series[:-1], series[1:]
    low, high = np.minimum(before, after), np.maximum(before, after)
    share = np.where(high < 0.0, 1.0, np.maximum(-low, 0.0) / np.maximum(high - low, 1e-300))
    return float(np.sum(share * np.diff(times)))
