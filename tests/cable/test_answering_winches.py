"""How winches answer to their ropes: the search of the core, against answers that are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stribeck import StribeckFriction

from cable_cases import LAWS as FRICTION
from cable_cases import RADIUS, random_case, still
from ringsim.cable.records import Winch
from ringsim.cable.winding import MotorWinding, StallWinding, WinchReading
from ringsim.core.library import ASKED, ask, call
from ringsim.core.winches import LAWS, Winches

pytestmark = pytest.mark.quick

SPEEDS = st.floats(0.0, 0.1)
GAINS = st.floats(1.0, 1e6)
STIFFNESS, PATH, ROPE, STEP = 1e3, 1.0, 0.9, 0.5


def commanding(says: Callable[[float], float]) -> Any:
    """A law that commands what a function says of the speed, which the tension tells: T = EA
    (S / (M - h v) - 1), where the rope is taut.
    """

    def command(law: StallWinding, tension: float, reading: WinchReading) -> float:
        return float(says((ROPE - PATH / (1.0 + tension / STIFFNESS)) / STEP))

    # No law of its own: every scene of this process would be offered it.
    return patch.object(StallWinding, "command", command)


def rope() -> Any:
    """A rope of one span, drawn taut, with a winch of 0 to 0.1 m/s, and its winches in a step."""
    law = StallWinding(speed=0.1, max_tension=1.0)
    case = still(
        [[0, 0, 0], [PATH, 0, 0]], 0.0, rate=(0.0, 0.0), axial_stiffness=STIFFNESS,
        initial_slack=ROPE - PATH, slack_width=1e-3, damping_time=0.0, winch=Winch(winding=law),
    )  # fmt: skip
    winches, state = Winches(case.chain.cables), case.state()
    winches.advance(0.0, state, np.zeros(1))
    return winches, winches.table(state.ropes)


def found(excess: Callable[[float], float], guess: float, gain: float) -> tuple[float, float]:
    """Where a function is zero by the search, and how fast it rises there."""
    winches, table = rope()
    table.balance[0, :2] = guess, gain
    with commanding(lambda v: v - excess(v)):
        speed = winches.at(STEP, np.array([PATH]), np.zeros(1))[1]
    return float(speed[0, 0]), float(table.balance[0, 1])


@given(root=SPEEDS, guess=SPEEDS, gain=GAINS, slope=st.floats(0.0, 1e4), flat=st.booleans())
def test_it_finds_the_root_of_a_bent_line(
    root: float, guess: float, gain: float, slope: float, flat: bool
) -> None:
    """As a rope that is slack on one side of the answer and stiff on the other."""

    def excess(v: float) -> float:
        stiff = (v > root) == flat
        return (v - root) * (1.0 + slope * stiff)

    speed, rises = found(excess, guess, gain)
    # The speed that the tension tells is rounded to some 1e-15 m/s.
    assert speed == pytest.approx(root, rel=1e-10, abs=1e-14)
    assert rises >= 1.0


@given(root=st.floats(1e-3, 0.1), guess=SPEEDS, gain=GAINS, steep=st.floats(1.0, 1e5))
def test_it_finds_the_root_of_a_curve(root: float, guess: float, gain: float, steep: float) -> None:
    def excess(v: float) -> float:
        return v - root + math.tanh(steep * (v - root)) * 0.1

    speed, _ = found(excess, guess, gain)
    assert speed == pytest.approx(root, rel=1e-10, abs=1e-14)


def test_near_the_last_answer_a_few_questions_are_enough() -> None:
    asked = []

    def excess(v: float) -> float:
        asked.append(v)
        return v - 0.004 * math.exp(-200.0 * (v - 0.004))

    for guess in (0.004, 0.00401, 0.0041):
        asked.clear()
        found(excess, guess, 1.8)
        assert 1 <= len(asked) <= 5


@pytest.mark.parametrize("steep", [1e2, 1e3, 1e4, 1e5])
@pytest.mark.parametrize("root", [0.011, 0.043, 0.08])
def test_a_step_is_found_with_few_questions_more_than_by_halves(root: float, steep: float) -> None:
    """Beside a step lines from side to side leave nearly all that they search, again and again:
    without halves between them they ask up to 1,100 times."""
    asked = []

    def excess(v: float) -> float:
        asked.append(v)
        return v - root + (1e-6 * steep if v > root else -1e-8 * steep)

    for guess in (0.0, 0.05, 0.1):
        for gain in (1.0, 1e3, 1e6):
            asked.clear()
            assert found(excess, guess, gain)[0] == pytest.approx(root, rel=1e-10)
            assert len(asked) <= 110  # by halves alone some 40


def test_what_has_been_asked_is_not_asked_again() -> None:
    asked = []
    winches, _ = rope()
    paths, rates = np.full(1, PATH), np.zeros(1)
    with commanding(lambda v: asked.append(v) or 0.05):
        first = winches.at(STEP, paths, rates)
        count = len(asked)
        assert np.array_equal(first, winches.at(STEP, paths, rates))
        assert len(asked) == count
        winches.at(STEP, 1.001 * paths, rates)
        assert len(asked) > count


def test_a_law_that_says_no_number_or_raises_is_told() -> None:
    def broken(v: float) -> float:
        raise RuntimeError("no law here")

    with pytest.raises(ValueError, match="a winding law commands a speed that is no number"):
        found(lambda v: math.nan, 0.05, 1.0)
    with pytest.raises(RuntimeError, match="no law here"):
        found(broken, 0.05, 1.0)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("at", [1, 2, 5])
def test_a_signal_that_comes_before_an_answer_begins_stops_the_core(at: int) -> None:
    """ctypes drops what is raised there, and returns what it has, as the last answer: the run went
    on with another number."""
    asked: list[int] = []

    def lost(answer: Any, called: Any) -> int:
        def struck(question: int) -> int:
            asked.append(question)
            if len(asked) == at:
                raise KeyboardInterrupt
            answer(question & 0xFFFF)
            return ~question

        return ask(answer, lambda _: called(ASKED(struck)))

    winches, _ = rope()
    steep = commanding(lambda v: 0.05 - 3.0 * v**3)
    with patch("ringsim.core.winches.ask", lost), steep, pytest.raises(KeyboardInterrupt):
        winches.at(STEP, np.array([PATH]), np.zeros(1))
    assert len(asked) == at


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("speed", [-0.2, 0.0, 1e-4, 0.3])
@pytest.mark.parametrize("kind", ["bearing", "stribeck"])
def test_the_tension_at_another_speed_is_foreseen(end: int, speed: float, kind: str) -> None:
    """Against the chain with that speed."""
    motor = MotorWinding(
        no_load_speed=400.0, stall_torque=0.01, gear_ratio=1000.0, efficiency=0.5, drum_radius=0.02
    )
    friction = (
        StribeckFriction(coefficient=0.3 * RADIUS, kinetic=0.4, speed=0.05)
        if kind == "stribeck"
        else FRICTION[kind]
    )
    case = random_case(
        6, speed=0.1, wound=0.01, winding=0.1, far_winding=0.05, friction=friction,
        slip_speed=0.05, damping_time=0.01, winch=Winch(winding=motor),
        far_winch=Winch(winding=motor), end="both",
    )  # fmt: skip
    winches, state = Winches(case.chain.cables), case.state()
    winches.advance(0.0, state, np.zeros(2))
    winches.hold(0.1)
    number = 2 + end
    tables = winches.table(state.ropes), state.table
    foreseen = ask(
        lambda what: winches.answer(what - LAWS),
        lambda function: call("ratio_of_winch", *tables, function, number, speed),
    )
    case.wound_rate[1, end] = speed
    after = case.state()
    ratio = after.winch_tensions[1, end] / after.mean_tensions[1]
    # Foreseen speeds of the rope leave out terms of first order in strain.
    assert after.strains[1] < 0.01
    assert foreseen == pytest.approx(ratio, rel=2e-3)


def test_two_winches_of_a_rope_answer_together() -> None:
    """On a path that is alike from either end both motors turn alike, whichever was ahead before:
    one that went by the other's last speed was behind in this step, and ahead in the next."""
    motor = MotorWinding(
        no_load_speed=400.0, stall_torque=0.01, gear_ratio=1000.0, efficiency=0.5, drum_radius=0.02
    )
    path = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 0]])
    case = still(
        path, 0.0038, rate=(0.005, 0.002), axial_stiffness=1e5, friction=FRICTION["bearing"],
        slip_speed=0.002, winch=Winch(winding=motor), far_winch=Winch(winding=motor), end="both",
    )  # fmt: skip
    winches, state = Winches(case.chain.cables), case.state()
    assert state.winch_tensions[0, 0] > 1.05 * state.winch_tensions[0, 1]
    winches.advance(0.0, state, np.zeros(1))
    case.wound[:], case.wound_rate[:] = winches.at(0.01, state.paths, state.path_rates)
    first, second = case.wound_rate[0]
    assert first == pytest.approx(second, rel=1e-9)
    # 250 N stop a motor that turns at 0.008 m/s without a load.
    tension = float(case.state().winch_tensions[0, 0])
    assert first == pytest.approx(0.008 * (1.0 - tension / 250.0), rel=1e-3)


def test_unlike_winches_of_a_rope_need_few_questions() -> None:
    """Where the stronger one is at its limit and the weaker one is held back by its rope: a search
    that halves asked some 300 times, and as often for each iteration of a step."""
    asked = []
    law = StallWinding.command

    def counted(self: StallWinding, tension: float, reading: WinchReading) -> float:
        asked.append(tension)
        return law(self, tension, reading)

    winch = Winch(winding=StallWinding(speed=0.008, max_tension=200.0))
    weaker = Winch(winding=StallWinding(speed=0.006, max_tension=150.0))
    case = still(
        [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 0]], 0.0038, rate=(0.005, 0.002),
        axial_stiffness=1e5, friction=FRICTION["bearing"], slip_speed=1e-4, winch=winch,
        far_winch=weaker, end="both",
    )  # fmt: skip
    winches, state = Winches(case.chain.cables), case.state()
    winches.advance(0.0, state, np.zeros(1))
    counts = []
    with patch.object(StallWinding, "command", counted):
        for longer in (0.0, 1e-6, 2e-6):
            case.wound[:], case.wound_rate[:] = winches.at(
                0.01, state.paths * (1.0 + longer), state.path_rates
            )
            counts.append(len(asked))
            asked.clear()
    assert case.wound_rate[0, 0] == pytest.approx(0.008, rel=1e-9)
    assert 0.0 < case.wound_rate[0, 1] < 0.006
    assert counts[0] <= 200
    assert max(counts[1:]) <= 40


def test_a_fault_leaves_what_winches_have_wound() -> None:
    """The step begins in the state before, with the ropes that the fault has made of its own."""
    motor = MotorWinding(
        no_load_speed=400.0, stall_torque=0.01, gear_ratio=1000.0, efficiency=0.5, drum_radius=0.02
    )
    path = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 0]]
    case = still(path, 0.01, rate=(0.002, 0.0), initial_slack=0.0101, winch=Winch(winding=motor))
    state = case.state()
    split = state.ropes.jam(0, 1, state.stored, case.wound)
    assert len(split.starts) == 2
    winches = Winches(case.chain.cables)
    winches.advance(0.0, state, np.zeros(1), split, case.chain.table(split))
    paths = case.chain.paths(split, case.points, case.velocities)
    for time, more in ((0.0, 0.0), (0.1, 0.1)):
        wound, speed = winches.at(time, *paths)
        assert wound[0, 0] == pytest.approx(0.01 + more * speed[0, 0], abs=1e-15)
        assert wound[0, 1] == speed[0, 1] == 0.0
    assert speed[0, 0] > 0.0
