"""Gravity and a suspension in the margin of the drive: virtual work on masses, lines and trolleys,
from the layout alone, and by hand.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.layout.layout import layout_of
from ringsim.rigid.mechanism import Mechanism
from ringsim.rigid.resistances import Opening, WeightResistance, resistances
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick

VECTOR = np.array([0.3, -0.5, -9.0])


@pytest.mark.parametrize("degrees", [40.0, 110.0, 170.0])
def test_weight_resists_with_its_virtual_work(degrees: float) -> None:
    scene = load_scene("ring18-motor").with_values(
        {"structure.sections": 6, "boom.base": "fixed", "gravity.vector": VECTOR.tolist()}
    )
    mechanism, angle = Mechanism(scene), math.radians(degrees)
    now = mechanism.at(0.5 * (math.pi - angle))
    found = WeightResistance(scene, mechanism).force(
        Opening(angle, 0.0, 0.0, now, mechanism.switches)
    )

    def work(at: float) -> float:
        """Of the weights, J, in the axes of the body that is held, where it is."""
        layout = layout_of(scene, 0.5 * (math.pi - at))
        masses, _, places = layout.point_masses[:3]
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


@pytest.mark.parametrize(("base", "degrees"), [("fixed", 40.0), ("fixed", 150.0), ("free", 100.0)])
def test_trolleys_and_lines_resist_with_their_virtual_work(base: str, degrees: float) -> None:
    """Corners stand on a circle of the radius R = 2 (l sin(angle / 2) + offset), the first of them
    at rest on a held ring, the circle's centre on a free one.
    """
    offload = {"planes": "both", "stiffness": 3.0, "friction": 0.01, "trolley_mass": 0.05}
    boom = {"boom.base": "fixed"} if base == "fixed" else {"boom": "none"}
    scene = load_scene("ring18-motor").with_values(
        {"structure.sections": 6, "structure.aspect_ratio": 1.0, "structure.opening_angle": 30.0,
         "gravity.vector": [0.0, 0.0, -9.81], "offload": offload} | boom
    )  # fmt: skip
    mechanism, angle = Mechanism(scene), math.radians(degrees)

    def corners(at: float) -> np.ndarray:
        layout = layout_of(scene, 0.5 * (math.pi - at))
        return np.array([[layout.bodies[k].pose.place for k in plane] for plane in layout.corners])

    def heights(at: float) -> np.ndarray:
        z = corners(at)[:, :, 2]
        return z - (z[0, 0] if base == "fixed" else z.mean())

    step, hung = 1e-4, layout_of(scene).hung
    assert hung is not None
    climbs = (heights(angle + step) - heights(angle - step)) / (2.0 * step)
    risen = heights(angle) - heights(math.radians(30.0))
    speed = 0.2889 * math.cos(0.5 * angle)
    chords = 2.0 * np.abs(np.sin(np.pi * np.arange(6) / 6)) if base == "fixed" else np.ones(6)
    ways, lifts = speed * np.tile(chords, 2), np.zeros(12)
    # The body that is held needs no line.
    lifts[-len(hung.lifts) :] = hung.lifts
    lines = slice(-len(hung.lifts), None)
    pulls = (lifts - 3.0 * risen.ravel())[lines]

    now = mechanism.at(0.5 * (math.pi - angle))
    found = {
        one.kind: one.force(Opening(angle, 0.0, 2.0, now, mechanism.switches))
        for one in resistances(scene, mechanism)
    }
    assert found["trolleys"] == pytest.approx(0.01 * float(pulls @ ways[lines]), rel=1e-6)
    by_lines = 3.0 * float((risen * climbs).ravel()[lines].sum())
    assert found["lines"] == pytest.approx(by_lines, rel=1e-6)
    assert abs(by_lines) > 1e-3
    bare = scene.with_values({"offload.trolley_mass": 0.0})
    (inertia,) = (one for one in resistances(bare, mechanism) if one.kind == "inertia")
    more = found["inertia"] - inertia.force(Opening(angle, 0.0, 2.0, now, mechanism.switches))
    assert more == pytest.approx(2.0 * 0.05 * float(ways[lines] @ ways[lines]), rel=1e-6)
