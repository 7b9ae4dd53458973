"""Winches with feedback: both engines answer the same law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ringsim.simulation import run, run_frame
from small_rings import six

LAWS = {
    "stall": {"kind": "stall", "speed": 0.06, "max_tension": 0.6},
    "stall, backdrivable": {
        "kind": "stall",
        "speed": 0.06,
        "max_tension": 0.6,
        "backdrivable": True,
    },
    "tension-feedback": {"kind": "tension-feedback", "target": 1.0, "max_speed": 0.2},
}


@pytest.mark.parametrize(
    "name",
    [*(pytest.param(name, marks=pytest.mark.slow) for name in list(LAWS)[:2]), "tension-feedback"],
)
def test_both_engines_answer_the_law_alike(name: str) -> None:
    law: dict[str, Any] = LAWS[name]
    scene = six(cable__winch__winding=law, solver__end_time=0.8, record__interval=0.1)
    full, frame = run(scene), run_frame(scene)
    assert not full.status.failed
    assert not frame.status.failed
    late = full.coordinates["time"] >= 0.5

    def last(found: Any, field: str) -> np.ndarray:
        return np.asarray(found.values[field][0][..., late])

    tension = last(full, "cable_tension")[0]
    np.testing.assert_allclose(last(frame, "cable_tension")[0], tension, rtol=1e-3)
    opened = last(full, "opening_angle").mean(axis=0)
    np.testing.assert_allclose(last(frame, "opening_angle").mean(axis=0), opened, atol=0.01)
    # A hundredth of a degree at the stowed end is 15 micrometres of rope.
    np.testing.assert_allclose(last(frame, "wound_length"), last(full, "wound_length"), atol=2e-5)
    assert frame.values["energy_error"] < 1e-3
    # The motor holds its law: as much rope as the structure gives, at the tension asked for.
    wanted = law.get("max_tension", law.get("target"))
    assert tension == pytest.approx(wanted, rel=2e-3)
