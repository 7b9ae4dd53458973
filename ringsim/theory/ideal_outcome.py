"""From the steps of an ideal ring to an outcome with the variables of the full model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ringsim.scene import Scene
from ringsim.theory import radau
from ringsim.theory.batched_chain import ChainBatch
from ringsim.theory.ideal_course import Course, Piece
from ringsim.variables import COUNTS, PLANES, Fidelity, Outcome, Status

Array = NDArray[np.float64]
_INSIDE = np.concatenate([[0.0], radau.NODES])


def to_outcome(course: Course, scene: Scene, *, wall_time: float, cpu_time: float) -> Outcome:
    """Put a run on the scene's output grid; what lies after its end is NaN.

    Angles come from the quintic that fits angle, rate and acceleration at both ends of a step;
    tensions from a shape-preserving cubic through the steps' stages, at which they are in balance
    with the motion; lost and supplied energy from the quadrature that belongs to the steps.
    """
    count = math.floor(scene.solver.end_time / scene.record.interval * (1.0 + 1e-12))
    grid = np.arange(count + 1) * scene.record.interval
    sections = scene.structure.sections
    coordinates: dict[str, Any] = {
        "plane": np.array(PLANES),
        "section": np.arange(1, sections + 1),
        "time": grid,
    }
    if not course.pieces:
        return Outcome(course.status, course.reason, coordinates, {})
    end = course.end[0]
    inside = grid <= end * (1.0 + 1e-12)
    where = np.minimum(grid[inside], end)
    values: dict[str, Array] = {}

    def on_grid(found: Array) -> Array:
        whole = np.full((*found.shape[:-1], len(grid)), np.nan)
        whole[..., inside] = found
        return whole

    phi, rate, latched = _motion(course, where)
    opening = on_grid(np.degrees(math.pi - 2.0 * phi))
    values["opening_angle"] = np.broadcast_to(opening, (2, sections, len(grid))).copy()
    values["lock_time"] = np.full((2, sections), course.lock_time)
    values["deployment_time"] = np.array(course.lock_time)
    values["asynchrony"] = on_grid(np.zeros(len(where)))
    values["asynchrony_max"] = np.array(0.0)
    _add_energies(values, course, where, (phi, rate, latched), on_grid)
    if scene.cables is not None:
        _add_cables(values, course, where, on_grid)
        coordinates["span"] = np.arange(1, values["cable_tension"].shape[1] + 1)
    values["constraint_violation"] = on_grid(np.zeros(len(where)))
    values["constraint_error"] = np.array(0.0)
    counts = {
        "steps": sum(len(piece.time) for piece in course.pieces),
        "newton_iterations": course.newton_iterations,
        "jacobians": course.tries,
        "restarts": 0,
        "fidelity": int(Fidelity.IDEAL),
    }
    counts |= {f"total_{name}": counts[name] for name in COUNTS}
    values.update({name: np.array(number) for name, number in counts.items()})
    values["step_used"] = np.array(np.nan)
    values["tolerance_used"] = np.array(scene.solver.tolerance)
    values["final_time"] = np.array(end)
    values["wall_time"], values["cpu_time"] = np.array(wall_time), np.array(cpu_time)
    return Outcome(Status(course.status), course.reason, coordinates, values)


def _motion(course: Course, where: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Angle and rate at times, rad and rad/s, and whether the latches hold."""

    def joined(name: str) -> Any:
        return np.concatenate([getattr(piece, name) for piece in course.pieces])

    starts, step = joined("time"), joined("step")
    k = np.clip(np.searchsorted(starts, where, side="right") - 1, 0, len(starts) - 1)
    h = step[k]
    s = np.minimum((where - starts[k]) / h, 1.0)
    phi, rate, pull = (joined(name)[k] for name in ("phi", "rate", "pull"))
    x0, v0, a0 = phi[:, 0], h * rate[:, 0], 0.5 * h**2 * pull[:, 0]
    x1, v1, a1 = phi[:, 3], h * rate[:, 3], h**2 * pull[:, 3]
    gap, slope, bend = x1 - x0 - v0 - a0, v1 - v0 - 2.0 * a0, a1 - 2.0 * a0
    c3 = 10.0 * gap - 4.0 * slope + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * slope - bend
    c5 = 6.0 * gap - 3.0 * slope + 0.5 * bend
    terms = np.array([x0, v0, a0, c3, c4, c5])
    powers = s ** np.arange(6)[:, None]
    angle = np.sum(terms * powers, axis=0)
    turning = np.sum(terms[1:] * powers[:-1] * np.arange(1, 6)[:, None], axis=0) / h
    return angle, turning, joined("latched")[k]


def _chain(piece: Piece) -> ChainBatch | None:
    """The cables at the beginning and the stages of all steps, (1, steps * 4, ...)."""
    equation = piece.equation
    if equation.chain is None or equation.cables is None or equation.ropes is None:
        return None
    ends = (1, piece.phi.size, *piece.wound.shape[2:])
    return equation.chain.evaluate(
        equation.cables,
        equation.ropes,
        piece.phi.reshape(1, -1),
        piece.rate.reshape(1, -1),
        piece.wound.reshape(ends),
        piece.speed.reshape(ends),
    )


def _add_energies(
    values: dict[str, Array],
    course: Course,
    where: Array,
    motion: tuple[Array, Array, NDArray[np.bool_]],
    on_grid: Any,
) -> None:
    """Energies on the grid, and the largest imbalance at any step."""
    phi, rate, latched = motion
    ring = course.pieces[0].equation.ring
    kinetic, elastic, work = (e[0] for e in ring.energies(phi[None], rate[None], latched[None]))
    begin = ring.energies(phi[:1, None], rate[:1, None], np.zeros((1, 1), dtype=bool))
    load_start, stored_start = float(begin[2][0, 0]), float(begin[1][0, 0])
    cables, lost, driven = np.zeros((3, len(where)))
    lost_so_far, driven_so_far, before, cables_start = 0.0, 0.0, math.nan, 0.0
    wrong, exchanged = 0.0, 1e-300
    for number, piece in enumerate(course.pieces):
        shape = piece.phi.shape
        held = np.broadcast_to(piece.latched[:, None], shape)
        x, v, on = piece.phi.reshape(1, -1), piece.rate.reshape(1, -1), held.reshape(1, -1)
        loss = ring.loss(x, v, on).reshape(shape)
        parts = [e.reshape(shape) for e in ring.energies(x, v, on)]
        power, stored = np.zeros(shape), np.zeros(shape)
        chain = _chain(piece)
        if chain is not None:
            copies = piece.equation.copies
            loss = loss + (chain.loss[0] @ copies).reshape(shape)
            power = (chain.winch_power[0] @ copies).reshape(shape)
            stored = (chain.elastic[0] @ copies).reshape(shape)
        if number == 0:
            cables_start = float(stored[0, 0])
        else:
            lost_so_far += before - float(stored[0, 0])
        before = float(stored[-1, -1])

        def summed(rates: Array, so_far: float, step: Array = piece.step) -> Array:
            gained = step * (rates[:, 1:] @ radau.WEIGHTS)
            return so_far + np.concatenate([[0.0], np.cumsum(gained)])

        loss_sum, work_sum = summed(loss, lost_so_far), summed(power, driven_so_far)
        lost_so_far, driven_so_far = loss_sum[-1], work_sum[-1]
        nodes = np.append(piece.time, piece.time[-1] + piece.step[-1])
        own = (where >= nodes[0]) & (where <= nodes[-1])
        cables[own] = _through_stages(piece, stored)(where[own])
        for series, total, rates in ((lost, loss_sum, loss), (driven, work_sum, power)):
            slopes = np.append(rates[:, 0], rates[-1, -1])
            series[own] = CubicHermiteSpline(nodes, total, slopes)(where[own])
        moving, held_back, done = (p[:, 3] for p in parts)
        spring = held_back - stored_start + stored[:, 3] - cables_start
        supplied = done - load_start + work_sum[1:]
        balance = moving + spring + loss_sum[1:] - supplied
        wrong = max(wrong, float(np.abs(balance).max()))
        exchanged = max(exchanged, *(float(np.abs(x).max()) for x in (supplied, moving, spring)))
    values["kinetic_energy"] = on_grid(kinetic)
    values["elastic_energy"] = on_grid(elastic + cables)
    values["work"] = on_grid(work - load_start + driven)
    values["dissipation"] = on_grid(lost)
    values["energy_error"] = np.array(wrong / exchanged)


def _add_cables(values: dict[str, Array], course: Course, where: Array, on_grid: Any) -> None:
    """Tensions by plane and span; NaN where a plane has no cable, or the other one more spans."""
    whole = course.pieces[0].equation.ropes
    edge = np.zeros(1, dtype=int) if whole is None else whole.cable_starts
    tensions = np.full((2, np.diff(edge).max(initial=0), len(where)), np.nan)
    wound = np.full((2, len(where)), np.nan)
    loose = np.full(2, np.nan)
    peak, peak_time = -math.inf, math.nan
    for piece in course.pieces:
        chain = _chain(piece)
        ropes = piece.equation.ropes
        if chain is None or ropes is None or piece.equation.cables is None:
            continue
        times = piece.time[:, None] + piece.step[:, None] * _INSIDE
        own = (where >= times[0, 0]) & (where <= times[-1, -1])
        found = chain.tensions[0].reshape(*times.shape, -1)
        alive = piece.equation.cables.alive[0, 0]
        stretch = np.where(alive > 0.0, chain.stretch[0], -1.0)[:, ropes.first]
        stretch = stretch.reshape(*times.shape, -1)
        top = found.max(axis=-1)
        if top.max() > peak:
            peak, peak_time = float(top.max()), float(times.ravel()[np.argmax(top)])
        for number, planes in enumerate(piece.equation.planes):
            slack = _time_below_zero(times, stretch[..., number])
            for plane in planes:
                at_spans = found[..., edge[number] : edge[number + 1]]
                held = _through_stages(piece, at_spans)(where[own]).T
                tensions[plane, : len(held), own] = held.T
                ends = piece.wound[:, :, number].sum(axis=-1)
                wound[plane, own] = _through_stages(piece, ends)(where[own])
                loose[plane] = np.nan_to_num(loose[plane]) + slack
    values["cable_tension"] = on_grid(tensions)
    values["wound_length"] = on_grid(wound)
    values["slack_duration"] = loose
    values["peak_tension"], values["peak_tension_time"] = np.array(peak), np.array(peak_time)


def _through_stages(piece: Piece, found: Array) -> Any:
    """Interpolation through the beginning of a piece and the stages of its steps."""
    times = piece.time[:, None] + piece.step[:, None] * _INSIDE
    line = np.concatenate([times[0, :1], times[:, 1:].ravel()])
    series = np.concatenate([found[0, :1], found[:, 1:].reshape(-1, *found.shape[2:])])
    keep = np.append(True, np.diff(line) > 0.0)
    with np.errstate(all="ignore"):  # harmonic means of slopes that are next to nothing
        return PchipInterpolator(line[keep], series[keep], axis=0)


def _time_below_zero(times: Array, series: Array) -> float:
    """Time for which a series, linear between its points, is negative."""
    before, after = series[:, :-1], series[:, 1:]
    low, high = np.minimum(before, after), np.maximum(before, after)
    share = np.where(high < 0.0, 1.0, np.maximum(-low, 0.0) / np.maximum(high - low, 1e-300))
    return float(np.sum(share * np.diff(times, axis=1)))
