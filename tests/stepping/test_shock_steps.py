"""Steps on the way to locks and behind them, of joints whose motion is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.cable.ropes import CutCable
from ringsim.parts.faults import FailedLatch, FailedSensor, FailedSpring
from ringsim.parts.solver import Solver
from ringsim.scene import load_scene
from ringsim.stepping.instant import Energies, Instant
from ringsim.stepping.repeats import FRONT, GRADE, GROWTH, ShockSteps
from ringsim.stepping.run import jolts_of

pytestmark = pytest.mark.quick

PERIOD, LONG = 0.09, 0.4
SHORT = PERIOD / FRONT
NONE = Energies(0.0, 0.0, 0.0, 0.0, 0.0)
SOLVER = Solver(end_time=10.0, step=5.0, tolerance=3e-3)


def state(time: float, locks: np.ndarray, snap: float) -> Instant:
    """V-joints that lock at these times (s), at a rate of 0.01 rad/s that rises within ``snap``."""
    left = locks - time
    fast = np.exp(-np.maximum(left, 0.0) / snap)
    way = np.where(left > 0.0, 0.01 * left + 0.1 * snap * (1.0 - fast), 0.0)
    rates = np.where(left > 0.0, 0.01 + 0.1 * fast, 0.0)
    return Instant(time, math.pi - way[None], rates[None], NONE, 0.0)


def taken(locks: list[float], snap: float, until: float) -> tuple[list[float], int]:
    """Times of all steps, and how many were repeated; the motion alone asks for ``LONG`` ones."""
    shocks, known = ShockSteps(SOLVER, PERIOD), np.array(locks)
    times, repeats, step = [0.0], 0, LONG
    now = state(0.0, known, snap)
    while now.time < until:
        step = min(step, shocks.limit, LONG)
        deployed = now.angles >= math.pi
        found = state(now.time + step, known, snap)
        while (shorter := shocks.shorter(now, found, deployed)) is not None:
            repeats, step = repeats + 1, shorter
            found = state(now.time + step, known, snap)
        shocks.accept(found, locked=bool(((found.angles >= math.pi) & ~deployed).any()))
        now, step = found, GROWTH * step
        times.append(now.time)
    return times, repeats


@pytest.mark.parametrize("snap", [0.02, 0.1, 1.0])
@pytest.mark.parametrize("locks", [[3.0], [3.0, 3.31], [3.0, 3.004, 4.7]])
def test_each_lock_is_met_by_a_short_step_after_ever_shorter_ones(
    locks: list[float], snap: float
) -> None:
    times, repeats = taken(locks, snap, 6.0)
    steps = np.diff(times)
    for lock in locks:
        k = int(np.searchsorted(times, lock)) - 1
        assert steps[k] <= SHORT * (1.0 + 1e-6)
        assert steps[k + 1] <= SHORT * (1.0 + 1e-6)
    # No step leads more than half-way or so to the first of them: none is blind to its snap.
    for begin, step in zip(times, steps, strict=False):
        if begin + step < locks[0] and step > SHORT * (1.0 + 1e-6):
            assert step < 0.75 * (locks[0] - begin)
    assert len(steps) < 6.0 / LONG + 90 * len(locks)
    assert repeats <= 6 * len(locks)


def test_steps_grow_with_the_time_since_the_lock() -> None:
    times, _ = taken([3.0], 0.1, 6.0)
    steps = np.diff(times)
    for begin, step in zip(times, steps, strict=False):
        if 3.0 + SHORT < begin < 3.0 + PERIOD:
            assert step <= max(SHORT, (begin - 3.0) / GRADE) * (1.0 + 1e-6)
    assert steps[-1] == pytest.approx(LONG)


def test_they_are_short_where_forces_jump() -> None:
    """At the start, and at a time at which a step ends; as behind a lock."""
    never = np.array([math.inf])
    shocks = ShockSteps(SOLVER, PERIOD, [0.5])
    assert shocks.limit == math.inf
    shocks.begin(state(0.0, never, 0.1))
    assert shocks.limit == pytest.approx(SHORT)
    for time, limit in (
        (0.8 * PERIOD, max(SHORT, 0.8 * PERIOD / GRADE)), (1.1 * PERIOD, math.inf),
        (0.4999, math.inf), (0.5, SHORT), (0.5 + 0.9 * PERIOD, 0.9 * PERIOD / GRADE),
    ):  # fmt: skip
        shocks.accept(state(time, never, 0.1), locked=False)
        assert shocks.limit == pytest.approx(limit), time


def test_faults_that_change_no_force_shake_nothing() -> None:
    kinds = {fault: fault.jolts for fault in (FailedLatch, FailedSensor, FailedSpring, CutCable)}
    assert [*kinds.values()] == [False, False, True, True]
    scene = load_scene("ring18-ground").with_values({
        "faults": [
            {"kind": "failed-latch", "time": 1.0, "plane": "upper", "section": 2},
            {"kind": "cut-cable", "time": 2.0, "cable": "upper", "span": 3},
        ]
    })  # fmt: skip
    assert jolts_of(scene)[0] == 2.0
    assert 1.0 not in jolts_of(scene)


def test_they_are_shorter_at_a_finer_tolerance() -> None:
    def shortest(**values: float) -> float:
        solver = Solver(**({"end_time": 99.0, "step": 5.0, "tolerance": 3e-3} | values))
        shocks = ShockSteps(solver, PERIOD)
        before, found = (state(time, np.array([1.0]), 0.1) for time in (0.99999, 1.1))
        return shocks.shorter(before, found, before.angles >= math.pi) or math.nan

    assert shortest() == pytest.approx(SHORT)
    assert shortest(tolerance=3e-4) == pytest.approx(SHORT / math.sqrt(10.0))
    assert shortest(tolerance=3e-2) == pytest.approx(SHORT)
    assert shortest(tolerance=1e-6) == pytest.approx(PERIOD / 512.0)


def test_joints_that_do_not_come_ask_for_nothing() -> None:
    shocks = ShockSteps(SOLVER, PERIOD)
    still = Instant(0.0, np.full((1, 2), 3.0), np.zeros((1, 2)), NONE, 0.0)
    back = Instant(0.4, np.full((1, 2), 2.99), np.full((1, 2), -0.05), NONE, 0.0)
    assert shocks.shorter(still, back, np.zeros((1, 2), dtype=bool)) is None
    shocks.accept(back, locked=False)
    assert shocks.limit == math.inf
