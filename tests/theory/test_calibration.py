"""The stowed angle that ``ringsim check --deploys-in`` finds is that of the scene's own motion."""

from __future__ import annotations

from typing import Any

import pytest
from click.testing import CliRunner

from ideal_cases import pulled, six
from ringsim.cli import cli
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.simulation import run, run_ideal
from ringsim.theory.calibration import opening_angle_for

CLOSE = 1e-5
"""Of the time; the angle is found to 1e-5 deg."""
WANTED = 7.0


def stowed(scene: Scene, angle: float) -> Scene:
    return scene.with_values({"structure.opening_angle": angle, "solver.end_time": 3.0 * WANTED})


@pytest.mark.parametrize(
    "values",
    [
        # What it lacks beside the next one is only left out.
        pytest.param({}, id="plain", marks=pytest.mark.slow),
        pytest.param(
            {
                "joints": {"vjoint": {"viscous": 0.002}, "pivot": {"coulomb": 0.001}},
                "net": {"stiffness": 0.005, "damping": 0.02, "neutral_length": 0.24},
            },
            id="all that takes energy",
        ),
        pytest.param(
            {"structure__closed": False, "structure__polygon_sections": 18, "boom": "none"},
            id="open arc",
            marks=pytest.mark.slow,  # another run of the ideal fidelity
        ),
    ],
)
def test_the_ideal_fidelity_deploys_in_the_time_asked_for(values: dict[str, Any]) -> None:
    scene = pulled(3, **({"net": "none"} | values))
    outcome = run_ideal(stowed(scene, opening_angle_for(scene, WANTED)))
    assert float(outcome.values["deployment_time"]) == pytest.approx(WANTED, rel=CLOSE)


def test_the_full_model_with_friction_deploys_in_that_time() -> None:
    scene = pulled(3, net="none", joints={"vjoint": {"viscous": 0.002}}, rods__damping=0.0)
    found = run(stowed(scene, opening_angle_for(scene, WANTED)))
    # A tolerance of 1e-4 of the steps, and rods that give a little.
    assert float(found.values["lock_time"].mean()) == pytest.approx(WANTED, rel=3e-4)


@pytest.mark.slow
def test_cables_open_a_ring_too() -> None:
    scene = six(structure__sections=3, net="none", cable__winch__winding__speed=0.08)
    outcome = run_ideal(stowed(scene, opening_angle_for(scene, WANTED - 1.0)))
    assert float(outcome.values["deployment_time"]) == pytest.approx(WANTED - 1.0, rel=CLOSE)


@pytest.mark.parametrize(
    ("time", "begun", "words"),
    [(1e-3, 47.0, "too short"), (1e3, 2.0, "too long"), (-1.0, 47.0, "above 0 s")],
)
def test_times_out_of_reach_are_refused(time: float, begun: float, words: str) -> None:
    """The search goes on from the scene's own angle."""
    scene = pulled(3, net="none", structure__opening_angle=begun)
    with pytest.raises(InputError, match=words):
        opening_angle_for(scene, time)


def test_what_rigid_rods_cannot_answer_is_refused() -> None:
    heavy = ["--set", "net.hub_mass=1.0"]
    result = CliRunner().invoke(cli, ["check", "ring18", "--deploys-in", "9", *heavy])
    assert result.exit_code == 2
    assert "net.hub_mass" in result.output
