"""The root finder of winches that answer to their ropes, against roots that are known."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringsim.cable.winches import root_of_rising

pytestmark = pytest.mark.quick

SPEEDS = st.floats(0.0, 0.1)
GAINS = st.floats(1.0, 1e6)


@given(root=SPEEDS, guess=SPEEDS, gain=GAINS, slope=st.floats(0.0, 1e6), flat=st.booleans())
def test_it_finds_the_root_of_a_bent_line(
    root: float, guess: float, gain: float, slope: float, flat: bool
) -> None:
    """As a rope that is slack on one side of the answer and stiff on the other."""

    def excess(v: float) -> float:
        stiff = (v > root) == flat
        return (v - root) * (1.0 + slope * stiff)

    found, rises = root_of_rising(excess, guess, gain, 0.0, 0.1)
    assert found == pytest.approx(root, rel=3e-11, abs=3e-15)
    assert rises >= 1.0


@given(root=st.floats(1e-4, 0.1), guess=SPEEDS, gain=GAINS, steep=st.floats(1.0, 1e5))
def test_it_finds_the_root_of_a_curve(root: float, guess: float, gain: float, steep: float) -> None:
    def excess(v: float) -> float:
        return v - root + math.tanh(steep * (v - root)) * 0.1

    found, _ = root_of_rising(excess, guess, gain, 0.0, 0.1)
    assert found == pytest.approx(root, rel=3e-11)


def test_near_the_last_answer_a_few_questions_are_enough() -> None:
    asked = []

    def excess(v: float) -> float:
        asked.append(v)
        return v - 0.004 * math.exp(-200.0 * (v - 0.004))

    for guess in (0.004, 0.00401, 0.0041):
        asked.clear()
        root_of_rising(excess, guess, 1.8, 0.0, 0.1)
        assert len(asked) <= 5
