"""The ideal ring's largest tension counts up to the deployment time; which truths are none."""

from __future__ import annotations

import numpy as np
import pytest

from ringsim.campaign.accuracy import _quadrature
from ringsim.scene import load_scene
from ringsim.simulation import run_ideal

SHORT = {"structure.sections": 4, "structure.opening_angle": 165.0, "boom": "none", "net": "none"}


def test_what_winches_pull_at_a_locked_ring_does_not_count() -> None:
    pull = {f"cables.{plane}.winch.after_lock": "pull" for plane in ("upper", "lower")}
    fine = SHORT | {"record.interval": 1e-3} | pull
    found = run_ideal(load_scene("ring18-cable").with_values(fine))
    values, time = found.values, found.coordinates["time"]
    assert values["peak_tension_time"] <= values["deployment_time"] < values["final_time"]
    # Wound on for 50 ms at 0.12 m/s a locked ring has ten times as much.
    before = values["cable_tension"][..., time <= values["deployment_time"]]
    assert values["peak_tension"] == pytest.approx(np.nanmax(before), rel=0.05)
    assert np.nanmax(values["cable_tension"]) > 5.0 * values["peak_tension"]


def test_the_quadrature_is_no_truth_of_a_damped_net() -> None:
    scene = load_scene("ring18").with_values({"structure.sections": 6})
    assert _quadrature(scene)
    assert not _quadrature(scene.with_values({"net.damping": 0.05}))
