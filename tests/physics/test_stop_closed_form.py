"""What happens at the stops, in closed form.

At 180 deg the bars of a symmetric ring lie in line: the V-joints move across them, and nothing else
moves.  Per V-joint a ring of rigid rods then has one coordinate, the angle phi of a bar half, with

    M phi'' + 4 c phi' + 4 k phi = -F l,     M = (m_V + 2 m_bar / 3) l^2,

the stop's stiffness k and damping c acting on the opening angle, which is pi - 2 phi.  Before the
first contact the force's work is all kinetic energy.  Rods of a hundred times the paper's modulus
bend by 3e-3 of what the stops give; that M changes with phi is 0.5 % over the 0.2 deg of a swing.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import ringsim

STIFFNESS = 50.0
FORCE = 0.01
START = 150.0
SCENE = ringsim.load_scene("ring18").with_values(
    {
        "structure.sections": 3,
        "structure.aspect_ratio": 1.0,
        "structure.opening_angle": START,
        "rods.young_modulus": 120e11,
        "rods.damping": 0.0,
        "boom": "none",
        "net": "none",
        "loads.force": FORCE,
        "stop.stiffness": STIFFNESS,
        "solver.end_time": 20.0,
        "solver.tolerance": 1e-5,
        "solver.newton_tolerance": 1e-5,
    }
)
HALF_BAR, JOINTS = SCENE.structure.half_bar, 2 * SCENE.structure.sections
BAR_MASS = SCENE.rods.density * math.pi / 4.0 * (0.012**2 - 0.01115**2) * HALF_BAR
INERTIA = (SCENE.structure.vjoint_mass + 2.0 / 3.0 * BAR_MASS) * HALF_BAR**2
BENDING = SCENE.rods.young_modulus * math.pi / 64.0 * (0.012**4 - 0.01115**4)
SERIES = 1.0 / (1.0 / STIFFNESS + 2.0 * HALF_BAR / (3.0 * BENDING))
"""Stiffness of a stop with the two bars that bend before it, N m/rad."""
FREQUENCY = math.sqrt(4.0 * SERIES / INERTIA)
CLOSE = 0.01
DAMPINGS = (0.03, 0.1)
"""N m s/rad; 9 % and 30 % of what is critical."""


def lift(opening: float) -> float:
    """Height of a V-joint over the middle of the ring at an opening angle in deg, m."""
    phi = 0.5 * (math.pi - math.radians(opening))
    half_height = math.sqrt(SCENE.structure.half_diagonal**2 - (HALF_BAR * math.cos(phi)) ** 2)
    return half_height - HALF_BAR * math.sin(phi)


ENERGY = JOINTS * FORCE * (lift(180.0) - lift(START))
"""Kinetic energy at the first contact, J."""
SPEED = math.sqrt(2.0 * ENERGY / JOINTS / INERTIA)
"""Rate of phi at the first contact, rad/s."""


@lru_cache
def stopped(damping: float, *, latch: bool, settling: float, interval: float = 2e-4) -> xr.Dataset:
    run = ringsim.simulate(
        SCENE.with_values(
            {
                "stop.damping": damping,
                "stop.latch": latch,
                "solver.settling_time": settling,
                "record.interval": interval,
            }
        )
    )
    assert int(run["status"]) == 0
    return run


def since_lock(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Times after the lock, s, and phi, the mean over all bars, rad."""
    locked = float(run["deployment_time"])
    assert float(run["lock_time"].max() - run["lock_time"].min()) < 1e-4
    after = run.where(run["time"] >= locked, drop=True).dropna("time", subset=["opening_angle"])
    opening = np.radians(after["opening_angle"].mean(["plane", "section"]).values)
    return after["time"].values - locked, 0.5 * (math.pi - opening)


REST = -FORCE * HALF_BAR / (4.0 * STIFFNESS)


def swing(times: np.ndarray, damping: float) -> np.ndarray:
    """Phi of a joint that comes to its latch with SPEED at time 0."""
    decay = 2.0 * damping / INERTIA
    own = math.sqrt(FREQUENCY**2 - decay**2)
    cosine, sine = np.cos(own * times), np.sin(own * times)
    return REST - np.exp(-decay * times) * (REST * cosine + (SPEED + decay * REST) / own * sine)


@pytest.mark.parametrize("damping", [0.0, *DAMPINGS])
def test_a_latched_joint_swings_as_a_spring_and_damper_do(damping: float) -> None:
    times, phi = since_lock(stopped(damping, latch=True, settling=0.032))
    expected = swing(times, damping)
    assert times[-1] > 1.5 * 2.0 * math.pi / FREQUENCY
    np.testing.assert_allclose(phi, expected, atol=2.0 * CLOSE * SPEED / FREQUENCY)


def test_a_latch_holds_from_both_sides_and_comes_to_rest_under_the_force() -> None:
    _, phi = since_lock(stopped(DAMPINGS[1], latch=True, settling=0.2))
    assert phi.max() > 0.2 * SPEED / FREQUENCY  # it was drawn back, not only pushed
    assert phi[-20:].mean() == pytest.approx(REST, rel=CLOSE)


@lru_cache
def left_after_a_bounce(damping: float) -> float:
    """Kinetic energy at 180 deg after the contact over that before it.

    The same equation with a stop that never pulls, and whose damper comes in over 1e-3 rad.
    """

    def rate_of(_: float, state: np.ndarray) -> tuple[float, float]:
        phi, rate = state
        depth = max(-2.0 * phi, 0.0)
        torque = STIFFNESS * depth - 2.0 * damping * rate * min(depth / 1e-3, 1.0)
        return rate, (2.0 * max(torque, 0.0) - FORCE * HALF_BAR) / INERTIA

    def out(_: float, state: np.ndarray) -> float:
        return float(state[0])

    out.terminal, out.direction = True, 1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        rate_of, (0.0, 1.0), (0.0, -SPEED), method="RK45", events=out, rtol=1e-8, atol=1e-12,
        max_step=1e-4,
    )  # fmt: skip
    return float(found.y[1, -1] / SPEED) ** 2


@pytest.mark.parametrize("damping", [pytest.param(0.0, marks=pytest.mark.quick), *DAMPINGS])
def test_a_bounce_leaves_the_energy_that_the_damper_does_not_take(damping: float) -> None:
    run = stopped(damping, latch=False, settling=0.032)
    locked = float(run["deployment_time"])
    before = run["kinetic_energy"].where(run["time"] <= locked, drop=True)
    assert float(before[-1]) == pytest.approx(ENERGY, rel=CLOSE)
    lost = float(run["dissipation"].sel(time=locked + 1.1 * math.pi / FREQUENCY, method="nearest"))
    assert lost == pytest.approx((1.0 - left_after_a_bounce(damping)) * ENERGY, abs=CLOSE * ENERGY)


def test_an_undamped_stop_holds_all_the_energy_at_its_deepest() -> None:
    run = stopped(0.0, latch=False, settling=0.032)
    deepest = SPEED / FREQUENCY
    most = float(run["elastic_energy"].max())
    assert most == pytest.approx(ENERGY + JOINTS * FORCE * HALF_BAR * deepest, rel=2.0 * CLOSE)


@pytest.mark.parametrize("damping", [0.03, pytest.param(0.1, marks=pytest.mark.slow)])
def test_a_bounced_ring_folds_until_the_force_has_taken_what_is_left(damping: float) -> None:
    left = left_after_a_bounce(damping) * ENERGY
    turn = brentq(lambda angle: JOINTS * FORCE * (lift(180.0) - lift(angle)) - left, START, 180.0)
    run = stopped(damping, latch=False, settling=1.0, interval=5e-3)
    after = run["opening_angle"].where(run["time"] > run["deployment_time"])
    lowest = float(after.mean(["plane", "section"]).min())
    assert 180.0 - lowest == pytest.approx(180.0 - turn, rel=2.0 * CLOSE)
