"""Gravity in the margin of the drive: virtual work on the masses, from the layout alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.layout.layout import layout_of
from ringsim.scene import load_scene
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.resistances.family import Opening, folding
from ringsim.theory.resistances.weight import WeightResistance

VECTOR = np.array([0.3, -0.5, -9.0])


@pytest.mark.parametrize("degrees", [40.0, 110.0, 170.0])
def test_weight_resists_with_its_virtual_work(degrees: float) -> None:
    scene = load_scene("ring18-motor").with_values(
        {"structure.sections": 6, "boom.base": "fixed", "gravity.vector": VECTOR.tolist()}
    )
    mechanism, angle = Mechanism(scene), math.radians(degrees)
    now = folding(mechanism, 0.5 * (math.pi - angle))
    found = WeightResistance(scene, mechanism).force(Opening(angle, 0.0, 0.0, now))

    def work(at: float) -> float:
        """Of the weights, J, in the axes of the body that is held, where it is."""
        layout = layout_of(scene, 0.5 * (math.pi - at))
        masses, _, places = layout.point_masses()[:3]
        (support,) = layout.supports
        held = layout.bodies[support.second.body].pose
        own = (np.asarray(places).reshape(-1, 3) - held.place) @ held.axes
        return float(masses @ (own @ start.axes.T @ VECTOR))

    layout = layout_of(scene, 0.5 * (math.pi - angle))
    start = layout.bodies[layout.supports[0].second.body].pose
    step = 1e-4
    expected = -(work(angle + step) - work(angle - step)) / (2.0 * step)
    assert found == pytest.approx(expected, rel=1e-6)
    assert abs(found) > 1e-3
