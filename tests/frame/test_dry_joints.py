"""Rings whose joints rub dry, and stop within steps: Newton must find where they stand."""

import pytest

from ringsim.frame.integrate import Integration
from ringsim.frame.model import FrameModel
from ringsim.scene import load_scene
from ringsim.variables import Fate

pytestmark = pytest.mark.quick

DRY = {"kind": "viscous-coulomb", "coulomb": 0.05, "viscous": 0.3, "rate": 2e-4}


def test_joints_that_stop_within_a_step_cost_no_repeated_steps() -> None:
    """Joints lock one after the other, and each stops its neighbours.  With tangents alone Newton
    jumped across the passage of their friction, and 91 steps were repeated.
    """
    # Winches that pull on: those that stop with their plane have steps end where it locks.
    pull = {f"cables.{plane}.winch.after_lock": "pull" for plane in ("upper", "lower")}
    scene = load_scene("ring18-cable").with_values(
        {"structure.sections": 3, "net": "none", "joints.vjoint": DRY} | pull
    )
    run = Integration(FrameModel(scene)).run()
    assert run.fate == Fate.DEPLOYED
    assert run.repeats <= 5
    assert run.newton_iterations < 10 * len(run.times)
