"""What a fixed base carries in the ideal fidelity: the rate of the ring's momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ringsim.layout.layout import layout_of
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.theory.first_reaction import first_acceleration, first_reaction
from ringsim.theory.ideal_fidelity import run_ideal
from ringsim.theory.ideal_motion import IdealMotion
from ringsim.theory.one_coordinate import OneCoordinate

RING = load_scene("ring18").with_values(
    {
        "structure.sections": 4, "structure.opening_angle": 60.0, "net": "none",
        "boom.base": "fixed", "loads.force": 0.05, "record.reactions": True,
        "record.interval": 0.05, "solver.end_time": 1.5,
    }
)  # fmt: skip


def momentum(scene: Any, q: float, rate: float) -> np.ndarray[Any, Any]:
    """Momentum (kg m/s) and angular momentum (kg m^2/s) about the held base, of point masses that
    fold at a rate (rad/s), in the base's axes.
    """
    layout = layout_of(scene, q)
    masses, _, places, rates = layout.point_masses()
    base = layout.bodies[layout.base or 0].pose
    turn = base.turn
    moving = rates - base.rate - np.cross(turn, places - base.place)
    pushed = masses[:, None] * moving * rate
    own = [pushed.sum(axis=0), np.cross(places - base.place, pushed).sum(axis=0)]
    return np.array(own) @ base.axes


@pytest.mark.parametrize("gravity", [None, {"vector": [0.0, 0.0, -0.02]}])
def test_at_rest_it_is_that_of_the_rigid_structure(gravity: Any) -> None:
    scene = RING.with_values({"gravity": gravity or "none"})
    layout = layout_of(scene)
    moving = first_acceleration(layout, OneCoordinate(scene, layout), scene.structure.coordinate)
    motion = IdealMotion(scene)
    found = motion.instant(0.0, motion.start()).reaction
    expected = first_reaction(layout, moving)
    assert expected is not None
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("sections", [4, 5])
def test_it_is_the_rate_of_momentum(sections: int) -> None:
    """Of a ring that folds at a rate w with the acceleration a: d(m(q) w)/dt by differences."""
    scene = RING.with_values({"structure.sections": sections, "loads": "none"})
    motion = IdealMotion(scene)
    state = motion.start()
    q, rate, small = 0.9, 0.7, 1e-5
    state[0], state[1] = q, rate
    now = motion.instant(0.0, state)
    acceleration = float(now.acceleration[0])
    slope = momentum(scene, q + small, rate) - momentum(scene, q - small, rate)
    expected = rate * slope / (2.0 * small) + acceleration / rate * momentum(scene, q, rate)
    assert np.abs(expected).max() > 1e-3
    assert now.reaction == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def test_elastic_rods_carry_the_same() -> None:
    """Exudyn with rods a hundred times as stiff, once their swing of the start has faded."""
    scene = RING.with_values({"solver.end_time": 0.6})
    stiff = scene.with_values(
        {"rods.young_modulus": 1.2e13, "rods.damping": 0.01, "solver.tolerance": 1e-4}
    )
    here, there = run_ideal(scene).values, simulate(stiff)
    for name in ("base_force", "base_torque"):
        largest = np.abs(here[name]).max()
        apart = np.abs(here[name] - there[name].to_numpy())[:, 4:]
        assert apart.max() < 2e-2 * largest
