"""A motor whose rotor has inertia, and a command that rises: against integrals of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import quad, solve_ivp

from cable_cases import LAWS, wind
from ringsim.cable.records import Winch
from ringsim.cable.winding import MotorWinding

FREE, STANDING, RATIO, RADIUS, SHARE = 600.0, 0.002, 100.0, 0.02, 0.6
"""Speed without a load (rad/s), torque at standstill (N m), gear, drum (m), efficiency."""
INERTIA, RAMP = 1e-6, 0.8
TRAVEL = RADIUS / RATIO
FIELDS = {
    "no_load_speed": FREE, "stall_torque": STANDING, "gear_ratio": RATIO, "drum_radius": RADIUS,
    "efficiency": SHARE, "rotor_inertia": INERTIA,
}  # fmt: skip
STIFFNESS = 100.0
"""EA of the rope, N: soft, so that it is wound for a while before the motor stalls."""
SLACK = 0.005


def motor(**fields: float) -> MotorWinding:
    return MotorWinding(**(FIELDS | fields))


def smooth(phase: float) -> float:
    """A step without a jump in its second derivative, written as an integral of its own."""
    return quad(lambda s: 30.0 * s**2 * (1.0 - s) ** 2, 0.0, min(max(phase, 0.0), 1.0))[0]


def tension(wound: float) -> float:
    """Of a rope over a path of 3 m at rest, without friction (the law of the helper's cable)."""
    strain = 3.0 / (3.0 + SLACK - wound) - 1.0
    width = 0.05
    return float(width * np.logaddexp(0.0, STIFFNESS * strain / width))


def exact(times: np.ndarray, most: float = math.inf, limit: float = math.inf) -> np.ndarray:
    """Shaft speeds of a motor that winds a rope until it stalls."""

    def rates(time: float, state: np.ndarray) -> list[float]:
        wound, shaft = state
        given = min(limit, STANDING * (1.0 - shaft / FREE))
        rate = (given - tension(wound) * TRAVEL / SHARE) / INERTIA
        return [shaft * TRAVEL, 0.0 if shaft >= most and rate > 0.0 else rate]

    found = solve_ivp(
        rates, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-13, max_step=1e-3
    )
    return np.asarray(found.y[1])


def test_a_rotor_runs_up_along_its_line_at_second_order() -> None:
    """tau = J w_0 / m_0 = 0.3 s; the rope pulls before the shaft is at its full speed."""
    errors = []
    for step in (0.004, 0.002):
        count = round(0.4 / step) + 1
        _, speeds, _ = wind(motor(), STIFFNESS, step, count, friction=LAWS["none"])
        truth = exact(step * np.arange(count))
        errors.append(np.abs(speeds / TRAVEL - truth).max())
    assert truth.max() > 0.6 * FREE
    assert errors[0] < 3e-3 * FREE
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)


@pytest.mark.parametrize("fields", [{"torque_limit": 0.0008}, {"speed": 200.0}])
def test_limit_and_command_bound_a_rotor(fields: dict[str, float]) -> None:
    """Below its limit the torque is constant, w = m t / J; on its command the speed is."""
    step = 1e-3
    _, speeds, _ = wind(motor(**fields), STIFFNESS, step, 200, friction=LAWS["none"])
    times = step * np.arange(200)
    truth = exact(times, fields.get("speed", math.inf), fields.get("torque_limit", math.inf))
    np.testing.assert_allclose(speeds / TRAVEL, truth, atol=4e-3 * FREE)
    constant = fields.get("torque_limit", math.inf) * times[-1] / INERTIA
    assert (speeds / TRAVEL).max() == pytest.approx(min(200.0, constant), rel=0.01)


def test_a_drum_that_stalls_stands_and_is_held_by_its_gear() -> None:
    heavy = motor(rotor_inertia=1e-5)
    tensions, speeds, _ = wind(heavy, STIFFNESS, 0.02, 900, friction=LAWS["none"])
    stalled = STANDING * SHARE / TRAVEL
    assert (speeds >= 0.0).all()
    assert speeds[-1] == 0.0
    # The rotor's energy carries it beyond where a motor without inertia stands.
    assert tensions[-1] > 1.05 * stalled
    assert (np.diff(tensions[speeds == 0.0][5:]) == 0.0).all()


@pytest.mark.parametrize("inertia", [None, 1e-9])
def test_a_command_rises_as_a_quintic_step(inertia: float | None) -> None:
    law = motor(speed=300.0, ramp=RAMP, rotor_inertia=inertia)
    step, loose = 0.02, {"friction": LAWS["none"]}
    # So much slack that nothing pulls.
    _, speeds, _ = wind(law, STIFFNESS, step, 60, lambda time: -0.1, **loose)
    wanted = [300.0 * smooth(k * step / RAMP) for k in range(60)]
    np.testing.assert_allclose(speeds / TRAVEL, wanted, atol=1e-9 * 300.0)
    assert law.breaks() == (RAMP,)
    command, rate = law.commanded(np.array([0.3, 2.0]))
    ahead, _ = law.commanded(np.array([0.3 + 1e-6, 2.0]))
    np.testing.assert_allclose((ahead - command) / 1e-6, rate, rtol=1e-4)


def test_a_rising_command_still_drives_a_drum_that_has_hardly_begun() -> None:
    winch = Winch(winding=motor(speed=300.0, ramp=RAMP), start_time=1.0)
    assert winch.drives(1.0 + 0.1 * RAMP, 0.0, 9.0)
    assert not winch.drives(1.0 + 1.1 * RAMP, 0.0, 9.0)


def test_torque_is_load_and_what_the_rotor_takes() -> None:
    law = motor(speed=300.0, ramp=RAMP)
    time, pull = 0.3, 1.0
    command, rate = law.commanded(time)
    load = pull * TRAVEL / SHARE
    on, below = law.torque(pull, np.array([command, 0.8 * command]) * TRAVEL, time)
    assert on == pytest.approx(load + INERTIA * rate, rel=1e-12)
    assert below == pytest.approx(STANDING * (1.0 - 0.8 * command / FREE), rel=1e-12)
    assert law.torque(pull, 300.0 * TRAVEL, 5.0) == pytest.approx(load, rel=1e-12)
    assert law.torque(pull, 0.0, 5.0) == pytest.approx(load, rel=1e-12)


def test_a_ramp_needs_a_command() -> None:
    with pytest.raises(ValidationError, match=r"ramp = 0\.8 s needs speed"):
        motor(ramp=RAMP)
