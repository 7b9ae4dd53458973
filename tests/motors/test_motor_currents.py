"""Current, electrical power and loss of motors, from torque constant and the line of the motor."""

from __future__ import annotations

import numpy as np
import pytest

from motor_rings import MOTOR, ring
from ringsim.cable.winding import MotorWinding
from ringsim.simulation import simulate

CONSTANT, IDLE = 0.01, 0.03
ELECTRIC = MOTOR | {"torque_constant": CONSTANT, "no_load_current": IDLE}
RESISTANCE = CONSTANT**2 * 600.0 / 0.002
RATED = CONSTANT * 600.0 + RESISTANCE * IDLE
"""Voltage at which it turns at 600 rad/s without a load, and stalls at 0.002 N m."""


def test_on_its_line_a_motor_has_its_rated_voltage() -> None:
    """m = k_t (I - I_0), U = R I + k_t w: P = U I with one U at all speeds."""
    motor = MotorWinding(**ELECTRIC)
    assert motor.resistance == pytest.approx(RESISTANCE)
    shaft = np.linspace(1.0, 600.0, 7)
    current = motor.current(motor.available(shaft), shaft)
    assert current == pytest.approx((RATED - CONSTANT * shaft) / RESISTANCE)
    assert motor.electrical_power(motor.available(shaft), shaft) == pytest.approx(RATED * current)
    assert current[-1] == pytest.approx(IDLE)
    # At standstill all of it heats the winding, and nothing is lost by turning.
    standing = motor.current(0.002, 0.0)
    assert motor.electrical_power(0.002, 0.0) == pytest.approx(RESISTANCE * standing**2)
    assert standing == pytest.approx(0.2)


def test_a_commanded_motor_takes_less_than_its_rated_voltage() -> None:
    motor = MotorWinding(**ELECTRIC, speed=200.0)
    for torque in (0.0, 0.0005, 0.001):
        current = torque / CONSTANT + IDLE
        expected = torque * 200.0 + RESISTANCE * current**2 + CONSTANT * IDLE * 200.0
        assert motor.electrical_power(torque, 200.0) == pytest.approx(expected)
        assert motor.electrical_power(torque, 200.0) < RATED * current


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_what_is_supplied_is_what_the_shafts_give_and_what_is_lost(fidelity: str) -> None:
    values = {f"cables.{plane}.winch.winding": ELECTRIC for plane in ("upper", "lower")}
    scene = ring(
        structure__sections=3, solver__end_time=1.0, solver__step=0.02, record__interval=0.02
    )
    found = simulate(scene.with_values(values), fidelity)
    now = found.isel(winch=0).where(found.time > 0.3, drop=True)
    current = now.motor_torque / CONSTANT + IDLE
    np.testing.assert_allclose(now.motor_current, current, rtol=1e-6)
    loss = RESISTANCE * current**2 + CONSTANT * IDLE * now.motor_speed
    np.testing.assert_allclose(now.motor_loss, loss, rtol=1e-4)
    supplied = now.motor_power + loss
    np.testing.assert_allclose(now.motor_electrical_power, supplied, rtol=1e-4)
    # All of the voltage is on the line.
    np.testing.assert_allclose(supplied, RATED * current, rtol=2e-3)
    gained = now.motor_electrical_energy - now.motor_energy
    lost = 0.01 * (loss[:, 1:].values + loss[:, :-1].values).cumsum(axis=1)
    np.testing.assert_allclose(gained[:, 1:] - gained[:, :1].values, lost, rtol=2e-3)
    assert {found[f"motor_{n}"].attrs["units"] for n in ("current", "loss")} == {"A", "W"}
    assert float(found.peak_motor_current) >= float(found.motor_current.max())
    whole = found.motor_electrical_energy.isel(time=-1).sum()
    assert float(found.total_motor_electrical_energy) == pytest.approx(float(whole), rel=1e-3)


def test_motors_without_a_constant_tell_no_current() -> None:
    scene = ring(structure__sections=3, solver__end_time=0.1, record__interval=0.1)
    assert not [name for name in simulate(scene, "frame").variables if "current" in str(name)]
    one = scene.with_values({"cables.upper.winch.winding": ELECTRIC})
    found = simulate(one, "frame")
    assert found.motor_current.sel(plane="lower").isnull().all()
    assert np.isfinite(found.motor_current.sel(plane="upper", winch=1)).all()
