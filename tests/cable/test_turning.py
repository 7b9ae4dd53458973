"""Newton across the passage of pulley friction from one direction to the other."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ringsim.cable.turning import Turning

SLIP = 2e-4


def noted(memory: Turning, state: Any) -> None:
    memory.note(state.ropes, state.speeds)


def slopes(memory: Turning, state: Any) -> np.ndarray:
    return memory.slopes(state.ropes, state.speeds, state.exponents, state.slip_speeds)


def iterate(speed: np.ndarray, ropes: object) -> Any:
    """A state of pulleys, as far as Newton needs it."""
    exponents = np.tanh(speed / SLIP)
    return SimpleNamespace(
        speeds=speed,
        exponents=exponents,
        slip_speeds=np.full(len(speed), SLIP),
        exponent_slopes=(1.0 - exponents**2) / SLIP,
        ropes=ropes,
    )


def solved(pull: float, stiffness: float, start: float, *, turning: bool) -> int | None:
    """Iterations that stiffness * (s - 0.1 m/s) + pull * tanh(s / slip) = 0 takes; None if many."""
    memory, ropes, speed = Turning(), object(), np.array([start])
    for count in range(25):
        state = iterate(speed, ropes)
        residual = stiffness * (speed - 0.1) + pull * state.exponents
        if abs(residual[0]) < 1e-4 * pull:
            return count
        noted(memory, state)
        slope = slopes(memory, state) if turning else state.exponent_slopes
        speed = speed - residual / (stiffness + pull * slope)
    return None


@pytest.mark.parametrize("start", [0.3, 0.02, -0.05])
@pytest.mark.parametrize("pull", [0.12, 0.3, 1.0, 10.0])
def test_newton_finds_the_rope_that_friction_stops(start: float, pull: float) -> None:
    """Friction is stronger than what drives the rope (0.1 N): tangents jump to and fro."""
    assert solved(pull, 1.0, start, turning=False) is None
    assert solved(pull, 1.0, start, turning=True) is not None


def test_where_a_rope_runs_on_slopes_are_tangents() -> None:
    memory, ropes = Turning(), object()
    for speed in (0.1, 0.09, 3e-4):
        state = iterate(np.array([speed]), ropes)
        noted(memory, state)
        assert slopes(memory, state) == pytest.approx(state.exponent_slopes, rel=1e-15)


def test_a_new_step_and_new_ropes_begin_without_memory() -> None:
    memory, ropes = Turning(), object()
    there, back = iterate(np.array([0.1]), ropes), iterate(np.array([-0.1]), ropes)
    noted(memory, there)
    noted(memory, back)
    assert slopes(memory, back) == pytest.approx(10.0, rel=1e-12)
    memory.forget()
    assert slopes(memory, back)[0] < 1e-9
    noted(memory, there)
    other = iterate(np.array([-0.1]), object())
    noted(memory, other)
    assert slopes(memory, other)[0] < 1e-9
