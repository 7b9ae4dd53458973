"""Newton across the passage of dry friction from one direction to the other."""

import numpy as np
import pytest

from ringsim.core.chain import Turning
from ringsim.parts.joints import ViscousCoulombFriction

pytestmark = pytest.mark.quick

SLIP = 2e-4
FRICTION = ViscousCoulombFriction(coulomb=0.01, viscous=0.02, rate=5e-4)


def share(speed: np.ndarray) -> np.ndarray:
    return np.asarray(np.tanh(speed / SLIP))


def share_slope(speed: np.ndarray) -> np.ndarray:
    return np.asarray((1.0 - share(speed) ** 2) / SLIP)


def slopes(memory: Turning, speed: np.ndarray, owner: object) -> np.ndarray:
    return memory.slopes(owner, speed, share_slope(speed), share)


def solved(pull: float, stiffness: float, start: float, *, turning: bool) -> int | None:
    """Iterations that stiffness * (s - 0.1 m/s) + pull * tanh(s / slip) = 0 takes; None if many."""
    memory, rope, speed = Turning(), object(), np.array([start])
    for count in range(25):
        residual = stiffness * (speed - 0.1) + pull * share(speed)
        if abs(residual[0]) < 1e-4 * pull:
            return count
        memory.note(rope, speed)
        slope = slopes(memory, speed, rope) if turning else share_slope(speed)
        speed = speed - residual / (stiffness + pull * slope)
    return None


@pytest.mark.parametrize("start", [0.3, 0.02, -0.05])
@pytest.mark.parametrize("pull", [0.12, 0.3, 1.0, 10.0])
def test_newton_finds_the_rope_that_friction_stops(start: float, pull: float) -> None:
    """Friction is stronger than what drives the rope (0.1 N): tangents jump to and fro."""
    assert solved(pull, 1.0, start, turning=False) is None
    assert solved(pull, 1.0, start, turning=True) is not None


def stopped(start: float, *, turning: bool) -> bool:
    """Whether 20 iterations bring two joints of 1e-4 kg m^2 that had 0.3 and -0.1 rad/s, and drive
    each other, to rest within a step of 0.01 s.
    """
    coupling, driving = np.array([[0.012, -0.002], [-0.002, 0.012]]), np.array([0.003, -0.001])
    memory, rate = Turning(), np.array([start, -0.5 * start])
    for _ in range(20):
        memory.note(FRICTION, rate)
        slope = (FRICTION.torque(rate + 1e-8) - FRICTION.torque(rate - 1e-8)) / 2e-8
        if turning:
            slope = memory.slopes(FRICTION, rate, slope, FRICTION.torque)
        out_of_balance = coupling @ rate - driving + FRICTION.torque(rate)
        rate = rate - np.linalg.solve(coupling + np.diag(slope), out_of_balance)
    left = coupling @ rate - driving + FRICTION.torque(rate)
    return bool(np.abs(left).max() < 1e-12 and np.abs(rate).max() < FRICTION.rate)


@pytest.mark.parametrize("start", [0.3, 0.02, -0.05])
def test_newton_finds_the_joints_that_friction_stops(start: float) -> None:
    assert not stopped(start, turning=False)
    assert stopped(start, turning=True)


def test_where_a_rope_runs_on_slopes_are_tangents() -> None:
    memory, rope = Turning(), object()
    for one in (0.1, 0.09, 3e-4):
        speed = np.array([one])
        memory.note(rope, speed)
        assert slopes(memory, speed, rope) == pytest.approx(share_slope(speed), rel=1e-15)


def test_a_new_step_and_new_ropes_begin_without_memory() -> None:
    memory, rope, other = Turning(), object(), object()
    there, back = np.array([0.1]), np.array([-0.1])
    memory.note(rope, there)
    memory.note(rope, back)
    assert slopes(memory, back, rope) == pytest.approx(10.0, rel=1e-12)
    memory.forget()
    assert slopes(memory, back, rope)[0] < 1e-9
    memory.note(rope, there)
    memory.note(other, back)
    assert slopes(memory, back, other)[0] < 1e-9
