"""What a fixed base carries at the start: the rate of the ring's momentum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ringsim.layout.layout import layout_of
from ringsim.rigid.statics import OneCoordinate, first_acceleration, first_reaction
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick

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
    masses, _, places, rates = layout.point_masses
    base = layout.bodies[layout.base or 0].pose
    turn = base.turn
    moving = rates - base.rate - np.cross(turn, places - base.place)
    pushed = masses[:, None] * moving * rate
    own = [pushed.sum(axis=0), np.cross(places - base.place, pushed).sum(axis=0)]
    return np.array(own) @ base.axes


@pytest.mark.parametrize("sections", [4, 5])
@pytest.mark.parametrize("gravity", [None, (0.0, 0.01, -0.02)])
def test_it_is_the_rate_of_momentum_at_rest_less_the_weight(sections: int, gravity: Any) -> None:
    """The pair of loads in a section is in balance."""
    table = "none" if gravity is None else {"vector": list(gravity)}
    scene = RING.with_values({"structure.sections": sections, "gravity": table})
    layout, q = layout_of(scene), scene.structure.coordinate
    moving = first_acceleration(layout, OneCoordinate(scene, layout), q)
    found = first_reaction(layout, moving)
    base = layout.bodies[layout.base or 0].pose
    expected = momentum(scene, q, moving.coordinate) @ base.axes.T
    if gravity is not None:
        masses, _, places, _ = layout.point_masses
        expected[0] -= masses.sum() * np.array(gravity)
        expected[1] -= np.cross(masses @ (places - base.place), gravity)
    assert np.abs(expected).max() > 1e-3
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
