"""Forces on V-joints keep their direction in space, and how far a free ring pitches under them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ringsim.exudyn.build import build
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene, load_scene

pytestmark = pytest.mark.quick

RING = load_scene("ring18")
HEAVY = {"boom.length": 3.0, "boom.density": 18000.0}


def pitch(scene: Scene) -> float:
    """Turn of the ring's axis from start to deployed, deg: zero angular momentum, no moments."""
    ring = OneCoordinate(scene)
    angles = np.linspace(scene.structure.coordinate, 0.0, 81)
    turned = Rotation.identity()
    for start, end in pairwise(angles):
        own = -ring.motion(0.5 * (start + end)).rotation * (end - start)
        turned = turned * Rotation.from_rotvec(own)
    return float(np.degrees(np.arccos(np.clip(turned.as_matrix()[2, 2], -1.0, 1.0))))


def test_forces_are_vertical_in_space() -> None:
    system = build(RING.with_values({"structure.sections": 3})).model.assembly.system
    loads = [system.GetLoad(k) for k in range(system.systemData.NumberOfLoads())]
    along = [load["loadVector"] for load in loads if load["loadType"] == "ForceVector"]
    assert not any(load["bodyFixed"] for load in loads)
    assert np.array(along) == pytest.approx(
        np.array([[0.0, 0.0, 0.015]] * 3 + [[0.0, 0.0, -0.015]] * 3)
    )


@pytest.mark.parametrize(("values", "degrees"), [({}, 0.22), ({"boom": "none"}, 0.0), (HEAVY, 8.1)])
def test_the_pitch_is_what_docs_loads_says(values: dict[str, object], degrees: float) -> None:
    # Printed with two digits; a ring without its boom is symmetric about its axis.
    assert pitch(RING.with_values(values)) == pytest.approx(degrees, rel=0.03, abs=1e-6)
