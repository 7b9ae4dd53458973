"""A motor behind a gear: its line, its limits, and what it does on a rope, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from pydantic import ValidationError

from cable_cases import still
from ringsim.cable.records import Winch
from ringsim.cable.winding import MotorWinding, RampWinding, StallWinding
from ringsim.core.winches import Winches

pytestmark = pytest.mark.quick

FIELDS = {
    "no_load_speed": 600.0, "stall_torque": 0.002, "gear_ratio": 100.0, "efficiency": 0.6,
    "drum_radius": 0.02,
}  # fmt: skip
STALLING = 0.002 * 100.0 * 0.6 / 0.02
"""Tension at which the line gives no speed, N."""
FREE = 600.0 / 100.0 * 0.02
"""Speed of the rope without load, m/s."""


def motor(**fields):
    return MotorWinding(**(FIELDS | fields))


@pytest.mark.parametrize(
    ("fields", "tension", "speed"),
    [
        ({}, 0.0, FREE),
        ({}, 0.25 * STALLING, 0.75 * FREE),
        ({}, STALLING, 0.0),
        ({}, 2.0 * STALLING, 0.0),
        # Half the voltage: the line moves down, its slope stays.
        ({"voltage": 0.5}, 0.25 * STALLING, 0.25 * FREE),
        ({"voltage": 0.5}, 0.5 * STALLING, 0.0),
        ({"derating": 0.5}, 0.25 * STALLING, 0.5 * FREE),
        # A commanded speed is kept up to the tension at which the line falls below it.
        ({"speed": 300.0}, 0.3 * STALLING, 0.5 * FREE),
        ({"speed": 300.0}, 0.75 * STALLING, 0.25 * FREE),
        # With a limit the line goes on up to 95 % of it, and then falls to standstill.
        ({"torque_limit": 0.001}, 0.47 * STALLING, 0.53 * FREE),
        ({"torque_limit": 0.001}, 0.495 * STALLING, 0.01 / 0.05 * FREE),
        ({"torque_limit": 0.001}, 0.5 * STALLING, 0.0),
        ({"current_limit": 0.1, "torque_constant": 0.01}, 0.5 * STALLING, 0.0),
        ({"torque_limit": 0.001, "derating": 0.5}, 0.25 * STALLING, 0.0),
        # The rope turns the gear back with 0.5 where the motor had 0.6: it holds from 0.6 x 0.5
        # of the stalling tension's torque up to the line, 1 / 0.3 times as much.
        ({"back_efficiency": 0.5}, 3.0 * STALLING, 0.0),
        ({"back_efficiency": 0.5}, 1.25 / 0.3 * STALLING, -0.25 * FREE),
        # Along the line, whatever the command, to ten times the speed without load.
        ({"back_efficiency": 0.5, "speed": 60.0}, 9.0 / 0.3 * STALLING, -8.0 * FREE),
        ({"back_efficiency": 0.5}, 12.0 / 0.3 * STALLING, -10.0 * FREE),
    ],
)  # fmt: skip
def test_the_drum_turns_where_motor_and_rope_have_the_same_torque(fields, tension, speed):
    law = motor(**fields)
    assert law.speed_at(tension) == pytest.approx(speed, abs=1e-12)
    low, high = law.limits()
    assert low <= speed <= high


def test_it_stalls_where_its_line_meets_the_resistance():
    for fields in ({}, {"voltage": 0.7}, {"derating": 0.4}, {"torque_limit": 0.0007}):
        law = motor(**fields)
        stall = law.stall_tension
        assert law.available(0.0) == pytest.approx(stall * 0.02 / (100.0 * 0.6), rel=1e-14)
        assert law.speed_at(stall * (1.0 - 1e-9)) > 0.0
        assert law.speed_at(stall * (1.0 + 1e-9)) == 0.0
        assert law.torque(stall, 0.0) == pytest.approx(law.available(0.0))
    assert motor().stall_tension == pytest.approx(STALLING)
    assert motor(speed=300.0).available_tension() == pytest.approx(STALLING)
    assert motor(speed=300.0).available_tension(at_speed=True) == pytest.approx(0.5 * STALLING)
    limited = motor(speed=300.0, torque_limit=0.0008).available_tension(at_speed=True)
    assert limited == pytest.approx(0.4 * (1.0 - 0.05 * 0.5) * STALLING)
    assert motor(speed=300.0, torque_limit=0.0008).speed_at(limited) == pytest.approx(0.5 * FREE)
    assert motor(voltage=0.5).available_tension() == pytest.approx(0.5 * STALLING)


@given(
    tension=st.floats(0.0, 1e3),
    voltage=st.floats(0.6, 2.0),
    command=st.one_of(st.none(), st.floats(1.0, 300.0)),
    limit=st.one_of(st.none(), st.floats(1e-5, 1.0)),
    back=st.one_of(st.none(), st.floats(0.01, 1.0)),
)
def test_speed_falls_with_the_tension_and_power_is_not_made(tension, voltage, command, limit, back):
    law = motor(voltage=voltage, speed=command, torque_limit=limit, back_efficiency=back)
    speed = law.speed_at(tension)
    assert law.speed_at(1.1 * tension) <= speed
    torque = float(law.torque(tension, speed))
    given_out, taken = torque * speed / law.travel, tension * speed
    # Winding, the rope gets 60 % of the shaft's power; turned back, the shaft gets a share of it,
    # unless the motor is weaker than that.
    efficiency = 0.6 if speed > 0.0 else 0.0 if back is None else 1.0 / back
    if back is None or speed > 0.0 or (limit is None and speed > law.limits()[0]):
        assert taken == pytest.approx(efficiency * given_out, rel=1e-9, abs=1e-15)
    else:
        assert taken <= efficiency * given_out * (1.0 - 1e-9) or taken == pytest.approx(0.0)
    assert torque <= law.available(speed / law.travel) * (1.0 + 1e-9) + 1e-15


def test_a_limit_holds_while_the_rope_turns_the_motor_back():
    """40 N ask for 0.004 N m at the shaft, 0.8 of the limit are 0.0024 N m: the rest is braked."""
    law = motor(back_efficiency=0.5, torque_limit=0.003, derating=0.8, stall_torque=0.01)
    tension = 0.004 * 100.0 / 0.02 / 0.5
    speed = law.speed_at(tension)
    assert speed < -FREE
    assert law.torque(tension, speed) == pytest.approx(0.0024, rel=1e-12)
    # A rope that gives way: the motor yields at its limit, within its band.
    tension, speed = pulled(law, -0.1 * FREE)
    assert tension == pytest.approx(0.0024 * (1.0 + 0.1 * 0.05) * 100.0 / 0.02 / 0.5, rel=2e-3)


def pulled(law, rate, steps=200, step=0.02):
    """Tension and speed of the winch of a straight rope whose far end comes in at a rate."""
    case = still(
        [[0, 0, 0], [5, 0, 0]], 0.0, axial_stiffness=1e5, initial_slack=0.0,
        winch=Winch(winding=law),
    )  # fmt: skip
    winches = Winches(case.chain.cables)
    case.velocities[1, 0] = -rate
    for k in range(steps):
        path, moving = np.array([case.points[1, 0]]), np.array([-rate])
        case.wound, case.wound_rate = winches.at(k * step, path, moving)
        now = case.state()
        winches.advance(k * step, now, np.zeros(1))
        case.points[1, 0] -= step * rate
    return now.winch_tensions[0, 0], now.wound_rate[0, 0]


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_the_tension_settles_where_the_motor_takes_up_what_comes(share):
    tension, speed = pulled(motor(), share * FREE)
    # The rope taken up is stretched by tension / EA.
    assert speed == pytest.approx(share * FREE, rel=1e-3)
    assert tension == pytest.approx((1.0 - share) * STALLING, rel=2e-3)


def test_it_stalls_on_a_rope_that_does_not_move():
    tension, speed = pulled(motor(), 0.0)
    assert tension == pytest.approx(STALLING, rel=1e-9)
    assert speed == pytest.approx(0.0, abs=1e-9)


def test_a_rope_that_is_pulled_off_turns_an_open_gear_and_breaks_its_head_on_a_locked_one():
    tension, speed = pulled(motor(back_efficiency=0.8), -0.1 * FREE)
    assert tension == pytest.approx(1.1 * STALLING / 0.6 / 0.8, rel=2e-3)
    assert speed == pytest.approx(-0.1 * FREE, rel=1e-3)
    tension, speed = pulled(motor(), -0.1 * FREE)
    assert tension > 50.0 * STALLING
    assert speed == 0.0


@for_each(
    ("fields", "text"),
    [
        ({"speed": 600.0}, "speed = 600.0 rad/s must be below voltage .* no torque at its speed"),
        ({"speed": 300.0, "voltage": 0.4}, "no_load_speed = 240 rad/s"),
        ({"stall_torque": 0.0}, "stall_torque"),
        ({"efficiency": 0.0}, "efficiency"),
        ({"efficiency": 1.2}, "efficiency"),
        ({"back_efficiency": 1.2}, "back_efficiency"),
        ({"derating": 0.0}, "derating"),
        ({"current_limit": 1.0}, "current_limit needs torque_constant"),
        ({"no_load_current": 1.0}, "no_load_current needs torque_constant"),
        (
            {"current_limit": 1.0, "torque_constant": 1.0, "torque_limit": 1.0},
            "leave one of them out",
        ),
    ],
)
def test_a_motor_that_cannot_be_is_refused(fields, text):
    with pytest.raises(ValidationError, match=text):
        motor(**fields)


@pytest.mark.parametrize(("back", "least"), [(None, 0.0), (0.5, -1.0)])
def test_what_a_motor_holds_after_the_lock_it_holds_by_its_gear(
    back: float | None, least: float
) -> None:
    """A gear that locks itself gives no rope back, however hard the rope pulls."""
    winding = MotorWinding(
        no_load_speed=500.0, stall_torque=0.02, gear_ratio=1000.0, drum_radius=0.01,
        back_efficiency=back,
    )  # fmt: skip
    held = Winch(winding=winding, after_lock="hold").locked(1.0, 5.0).winding
    assert isinstance(held, StallWinding)
    assert held.limits()[0] == least * winding.usual_speed()
    assert held.max_tension == 5.0


def test_a_motor_rises_along_the_quintic_of_a_ramp():
    ramped = motor(speed=300.0, ramp=2.0)
    ramp = RampWinding(speed=ramped.travel * 300.0, duration=2.0)
    times = np.linspace(0.0, 2.5, 26)
    speed, rate = ramped.commanded(times)
    assert ramped.travel * speed == pytest.approx([ramp.wound_rate(t) for t in times])
    small = 1e-6
    ahead, behind = (ramped.commanded(times[1:-1] + by)[0] for by in (small, -small))
    assert rate[1:-1] == pytest.approx((ahead - behind) / (2.0 * small), abs=1e-5)


@for_each("fields", [{}, {"torque_limit": 0.001}, {"voltage": 0.8, "derating": 0.9}])
def test_the_largest_power_on_the_way_up_is_that_of_the_line(fields):
    """Beside 20,000 speeds of the way, also where a limit cuts the line off."""
    law = motor(**fields)
    for low, high in ((0.0, 0.3), (0.0, 0.9), (0.4, 0.7), (0.6, 0.95)):
        ends = low * law.free_speed, high * law.free_speed
        speeds = np.linspace(*ends, 20_000)
        most = (speeds * law.available(speeds)).max()
        assert law.largest_power(*ends) == pytest.approx(most, rel=1e-6)
