"""Winding laws: what they promise of length, speed and tension."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from pydantic import ValidationError
from scipy.integrate import quad, solve_ivp

from cable_cases import LAWS, cable, still, wind
from ringsim.cable.control import CommandedWinding, TensionFeedbackWinding
from ringsim.cable.records import Cable, Winch
from ringsim.cable.winding import (
    ConstantWinding,
    MotorWinding,
    RampWinding,
    StallWinding,
    TableWinding,
    WinchReading,
    Winding,
)
from ringsim.choice import kinds_of
from ringsim.core.winches import Winches

TIMES = (0.0, 1.0, 1.5, 4.0, 5.0, 7.0)
LENGTHS = (0.0, 0.1, 0.3, 0.35, 0.35, 0.2)
LAWS_OF_TIME = {
    "constant": ConstantWinding(speed=0.1),
    "ramp": RampWinding(speed=-0.2, duration=2.0),
    "ramp, cubic": RampWinding(speed=0.2, duration=2.0, shape="cubic"),
    "table": TableWinding(times=TIMES, lengths=LENGTHS),
    "commanded": CommandedWinding(max_speed=0.3, acceleration=0.1, speed=0.2, from_speed=-0.1),
}
STALL = StallWinding(speed=0.1, max_tension=20.0)
FEEDBACK = TensionFeedbackWinding(target=5.0, max_speed=0.3, max_payout=0.3)
MOTOR = MotorWinding(
    no_load_speed=500.0, stall_torque=0.01, gear_ratio=50.0, drum_radius=0.01, efficiency=0.5
)
STIFFNESSES = [1e3, 1e5, 1e7]


def test_the_laws_tested_here_are_all_laws_there_are():
    tested = {law.kind for law in [*LAWS_OF_TIME.values(), STALL, FEEDBACK, MOTOR]}
    assert tested == set(kinds_of(Winding))


@pytest.mark.parametrize("law", LAWS_OF_TIME.values(), ids=LAWS_OF_TIME)
def test_the_length_is_the_integral_of_the_speed(law):
    assert law.wound(0.0) == 0.0
    for end in (0.7, 1.3, 3.0, 6.5, 9.0):
        breaks = [t for t in (*TIMES, 2.0) if t < end]
        integral, _ = quad(law.wound_rate, 0.0, end, points=breaks, epsabs=1e-13)
        assert law.wound(end) == pytest.approx(integral, abs=1e-12)


@pytest.mark.parametrize(("shape", "order"), [("cubic", 2), ("quintic", 3)])
def test_a_ramp_starts_as_smoothly_as_it_says(shape, order):
    law = RampWinding(speed=0.2, duration=2.0, shape=shape)
    early = [law.wound_rate(t) for t in (1e-3, 2e-3)]
    assert np.log2(early[1] / early[0]) == pytest.approx(order, abs=2e-3)
    late = [0.2 - law.wound_rate(2.0 - t) for t in (1e-3, 2e-3)]
    # The difference to the full speed, 1e-7 to 1e-10 m/s, keeps six digits at least.
    assert np.log2(late[1] / late[0]) == pytest.approx(order, abs=2e-3)
    assert law.wound(2.0) == pytest.approx(0.2, rel=1e-15)


def test_a_table_is_a_monotone_cubic():
    law = TableWinding(times=TIMES, lengths=LENGTHS)
    assert [law.wound(t) for t in TIMES] == pytest.approx(LENGTHS, abs=1e-16)
    # Fritsch and Butland: secants of 0.1 and 0.4 m/s over 1 and 0.5 s around the second time, of
    # 0.4 and 0.02 m/s over 0.5 and 2.5 s around the third; then rest, and an extremum.
    slopes = [4.5 / (2.0 / 0.1 + 2.5 / 0.4), 9.0 / (5.5 / 0.4 + 3.5 / 0.02), 0.0, 0.0]
    assert [law.wound_rate(t) for t in TIMES[1:5]] == pytest.approx(slopes, abs=1e-15)
    between = np.array([[law.wound(t) for t in np.linspace(*ends, 50)] for ends in pairwise(TIMES)])
    ways = np.sign(np.diff(LENGTHS))[:, None]
    assert (ways * np.diff(between, axis=1) >= 0.0).all()
    assert (law.wound(9.0), law.wound_rate(9.0)) == (0.2, 0.0)
    straight = TableWinding(times=(0.0, 2.0), lengths=(0.0, 0.4))
    assert (straight.wound(0.5), straight.wound_rate(0.5)) == pytest.approx((0.1, 0.2))


@for_each(
    ("table", "text"),
    [
        ({"times": (0.0, 1.0), "lengths": (0.0, 0.1, 0.2)}, "give one length for each time"),
        ({"times": (0.0, 1.0, 1.0), "lengths": (0.0, 0.1, 0.2)}, "must be above the time before"),
        ({"times": (0.0, 1.0), "lengths": (0.1, 0.2)}, "must start at 0"),
        ({"times": (0.0,), "lengths": (0.0,)}, "at least 2 items"),
    ],
)
def test_a_table_that_cannot_be_followed_is_refused(table, text):
    with pytest.raises(ValidationError, match=text):
        TableWinding(**table)


def test_a_winch_keeps_its_hours():
    winch = Winch(winding=ConstantWinding(speed=0.1), start_time=2.0, stop_time=5.0)
    for time, wound, speed in [(1.0, 0.0, 0.0), (2.0, 0.0, 0.1), (4.0, 0.2, 0.1), (9.0, 0.3, 0.0)]:
        assert winch.at(time) == pytest.approx((wound, speed))
    with pytest.raises(ValidationError, match="must not be before start_time"):
        Winch(winding=ConstantWinding(speed=0.1), start_time=2.0, stop_time=1.0)


def test_a_winch_with_feedback_keeps_its_hours_too():
    winch = Winch(winding=STALL, start_time=2.0, stop_time=5.0)
    case = still([[0, 0, 0], [1, 0, 0]], 0.0, initial_slack=0.5, winch=winch)
    winches = Winches(case.chain.cables)
    for time, wound, speed in [
        (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.5, 0.05, 0.1), (5.0, 0.3, 0.1), (9.0, 0.3, 0.0),
    ]:  # fmt: skip
        found = winches.at(time, np.ones(1), np.zeros(1))
        assert [f[0, 0] for f in found] == pytest.approx([wound, speed])
        case.wound, case.wound_rate = found
        winches.advance(time, case.state(), np.zeros(1))


def test_a_step_has_the_law_of_its_inside_up_to_its_very_end():
    """Speeds jump where a step begins or ends, be that a rounding before or behind the switch."""
    table = TableWinding(times=(0.0, 1.0, 3.0), lengths=(0.0, 0.1, 0.4))
    for law, stop in ((ConstantWinding(speed=0.1), 5.0), (table, None)):
        winch = Winch(winding=law, start_time=2.0, stop_time=stop)
        case = still([[0, 0, 0], [1, 0, 0]], 0.0, initial_slack=0.5, winch=winch)
        winches = Winches(case.chain.cables)

        def speed(time, case=case, winches=winches):
            return float(winches.at(time)[1][0, 0])

        running = winch.at(5.0 - 1e-9)[1]
        assert running > 0.09
        for near in (-1e-15, 0.0, 1e-15):
            for begin, end, first, last in [
                (1.0, 2.0 + near, 0.0, 0.0),
                (4.0, 5.0 + near, winch.at(4.0)[1], running),
                (5.0 + near, 6.0, 0.0, 0.0),
                (2.0 + near, 3.0, winch.at(2.0)[1], winch.at(3.0)[1]),
            ]:
                winches.advance(begin, case.state(), np.zeros(1))
                assert [speed(begin), speed(end)] == pytest.approx([first, last], abs=1e-7)


def test_slopes_of_ideal_paths_are_asked_for_where_a_winch_answers():
    steady = Winch(winding=ConstantWinding(speed=0.1))
    winches = Winches([Cable(winch=steady), Cable(winch=Winch(winding=STALL))])
    asked = []
    slopes = winches.path_slopes(lambda number: asked.append(number) or -0.25)
    assert asked == [1]
    assert slopes.tolist() == [0.0, -0.25]


def test_a_cable_reads_back_from_plain_tables():
    table = {
        "end": "last",
        "axial_stiffness": 20000,
        "friction": {"kind": "capstan", "coefficient": [0.1, 0.2]},
        "winch": {"winding": {"kind": "table", "times": [0, 1.0], "lengths": [0, 0.1]}},
    }
    read = Cable.model_validate(table)
    assert list(read.friction.coefficients) == [0.1, 0.2]
    assert read.winch.winding == TableWinding(times=(0.0, 1.0), lengths=(0.0, 0.1))
    assert Cable.model_validate(read.model_dump(mode="json")) == read


def test_far_winch_needs_two_ends():
    winch = Winch(winding=ConstantWinding(speed=0.1), start_time=2.0)
    with pytest.raises(ValidationError, match='far_winch needs end = "both"'):
        cable(far_winch=winch)
    assert cable(end="both", far_winch=winch).winches[1] == winch
    assert cable(end="both").winches[1] == cable().winch
    assert len(cable().winches) == 1


@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize(
    ("step", "backdrivable"),
    [
        (0.001, False), pytest.param(0.001, True, marks=pytest.mark.slow),
        (0.04, False), (0.04, True), (0.5, False), (0.5, True),
    ],
)  # fmt: skip
def test_a_stalling_winch_holds_its_maximum_tension_at_any_stiffness(stiffness, step, backdrivable):
    law = StallWinding(speed=0.1, max_tension=20.0, backdrivable=backdrivable)
    tensions, speeds, _ = wind(law, stiffness, step, 1000 if step < 0.01 else 60)
    # The path is at rest: what the law takes for the rope's speeds is what they are.
    assert tensions.max() <= 20.0 * (1.0 + 1e-6)
    assert tensions[-1] >= 19.0
    assert speeds[-1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_a_backdrivable_winch_gives_rope_where_another_holds(stiffness):
    pull = lambda time: 0.02 if time > 2.0 else 0.0  # noqa: E731
    giving = StallWinding(speed=0.1, max_tension=20.0, backdrivable=True)
    tensions, speeds, strain = wind(giving, stiffness, 0.04, 200, pull)
    # It pays out at 0.02 m/s, a fifth of its speed: 20 N plus a fifth of the band of 5 %.
    assert tensions[-1] == pytest.approx(20.0 * (1.0 + 0.2 * 0.05), rel=1e-3)
    # The path grows in its last span, by rope that is stretched already.
    assert speeds[-1] == pytest.approx(-0.02 / (1.0 + strain), rel=1e-3)
    tensions, speeds, _ = wind(STALL, stiffness, 0.04, 200, pull)
    assert tensions[-1] > 30.0
    assert np.all(speeds >= 0.0)


@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_feedback_keeps_the_tension_while_the_structure_moves(stiffness):
    moving = lambda time: -0.04 * (1.2 + np.sin(0.7 * time))  # noqa: E731
    tensions, speeds, _ = wind(FEEDBACK, stiffness, 0.04, 250, moving)
    # The law answers to the path at the end of the step, with the lengths of the spans at its
    # beginning: 0.08 * 0.04 m of 2 m, which shifts the tension's distribution by 1e-3.  The rope
    # that it takes up at 0.09 m/s is stretched: 5 N / EA of that over the gain.
    assert tensions[50:] == pytest.approx(5.0, abs=0.005 + 0.09 * 5.0 / stiffness / 0.02)
    assert speeds.max() <= 0.3
    assert speeds.min() >= -0.3


def test_feedback_wins_tension_by_its_own_gain_at_second_order():
    """T' = EA dW/dt over the path but for strains, solved beside it; the structure gives rope free.

    A drum whose own past speed stood for the structure's won tension with two thirds of the gain.
    """
    stiffness, freed, slack = 150.0, 0.05, 0.005

    def tension(time, wound):
        strain = (3.0 - freed * time) / (3.0 + slack - wound) - 1.0
        width = Cable(winch=Winch(winding=FEEDBACK)).slack_width
        return width * np.logaddexp(0.0, stiffness * strain / width)

    def speed(time, wound):
        return freed + FEEDBACK.gain * (FEEDBACK.target - tension(time, wound))

    times = np.linspace(0.0, 2.0, 26)
    exact = solve_ivp(speed, (0.0, 2.0), [0.0], t_eval=times, rtol=1e-11, atol=1e-13)
    assert 0.5 < tension(1.0, exact.y[0, 13]) / FEEDBACK.target < 0.9  # far from both ends of it
    errors = []
    for step in (0.02, 0.01):
        count = round(2.0 / step) + 1
        found, *_ = wind(FEEDBACK, stiffness, step, count, lambda time: -freed, LAWS["none"])
        apart = found[:: round(0.08 / step)] - tension(times, exact.y[0])
        errors.append(np.abs(apart).max())
    assert errors[0] < 3e-3 * FEEDBACK.target
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_feedback_with_an_opening_rate_starts_as_slowly_as_the_geometry():
    law = TensionFeedbackWinding(target=5.0, max_speed=0.3, opening_rate=0.1)
    reading = WinchReading(path_rate=0.0, path_slope=-0.2)
    assert law.command(5.0, reading) == pytest.approx(0.02)
    assert law.command(4.0, reading) == pytest.approx(0.04)


@given(
    stiffness=st.floats(1e3, 1e7),
    duration=st.floats(1e-5, 1.0),
    slack=st.floats(-0.01, 0.01),
    law=st.sampled_from([STALL, FEEDBACK, MOTOR]),
)
def test_the_speed_answers_to_the_tension_that_it_causes(stiffness, duration, slack, law):
    case = still(
        [[0, 0, 0], [1, 0, 0]], 0.0, axial_stiffness=stiffness, initial_slack=slack,
        winch=Winch(winding=law),
    )  # fmt: skip
    winches = Winches(case.chain.cables)
    winches.advance(0.0, case.state(), np.zeros(1))
    wound, speed = winches.at(duration, np.ones(1), np.zeros(1))
    assert wound[0, 0] == speed[0, 0] * duration
    low, high = law.limits()

    def answer(chosen):
        case.wound = np.array([[chosen * duration, 0.0]])
        state = case.state()
        wanted = law.command(
            state.winch_tensions[0, 0], WinchReading(path_rate=0.0, path_slope=0.0)
        )
        return min(max(wanted, low), high)

    case.wound_rate = np.zeros((1, 2))
    # Between two neighbouring speeds the command crosses the diagonal.
    assert answer(speed[0, 0] - 1e-9) >= speed[0, 0] - 1e-9
    assert answer(speed[0, 0] + 1e-9) <= speed[0, 0] + 1e-9
