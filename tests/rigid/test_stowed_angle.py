"""The stowed angle that ``ringsim check --deploys-in`` finds is that of the scene's own motion."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.refusal import InputError
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene
from ringsim.simulation import FIDELITIES, run
from ringsim.stowed_angle import opening_angle_for
from small_rings import pulled, six

WANTED = 7.0


def stowed(scene: Scene, angle: float) -> Scene:
    return scene.with_values({"structure.opening_angle": angle, "solver.end_time": 3.0 * WANTED})


def test_the_quadrature_deploys_in_the_time_asked_for() -> None:
    scene = pulled(3, net="none", boom="none")
    found = stowed(scene, opening_angle_for(scene, WANTED))
    truth = opening_time(OneCoordinate(found), found.structure.coordinate)
    # A tolerance of 1e-4 of the steps, and rods that give a little.
    assert truth.time == pytest.approx(WANTED, rel=5e-4)


@pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_elastic_rods_with_friction_deploy_in_that_time(engine: str) -> None:
    joints = {"vjoint": {"viscous": 0.002}}
    scene = pulled(3, net="none", joints=joints, rods__damping=0.0, solver__settling_time=0.0)
    found = FIDELITIES[engine](stowed(scene, opening_angle_for(scene, WANTED)))
    assert float(found.values["deployment_time"]) == pytest.approx(WANTED, rel=3e-4)


@pytest.mark.slow
def test_cables_open_a_ring_too() -> None:
    scene = six(structure__sections=3, net="none", cable__winch__winding__speed=0.08)
    found = run(stowed(scene, opening_angle_for(scene, WANTED - 1.0)))
    assert float(found.values["deployment_time"]) == pytest.approx(WANTED - 1.0, rel=2e-3)


@for_each(
    ("time", "begun", "words"),
    [(1e-2, 47.0, "too short"), (60.0, 2.0, "too long"), (-1.0, 47.0, "above 0 s")],
)
def test_times_out_of_reach_are_refused(time: float, begun: float, words: str) -> None:
    """The search goes on from the scene's own angle."""
    scene = pulled(3, net="none", structure__opening_angle=begun)
    with pytest.raises(InputError, match=words):
        opening_angle_for(scene, time)


def test_what_frames_cannot_answer_is_refused() -> None:
    words = ["check", "ring18", "--deploys-in", "9", "--set", "rods.kind=ancf"]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    assert "rods.kind" in result.output


def test_a_limit_of_stress_does_not_keep_from_looking_for_the_angle() -> None:
    words = ["check", "ring18", "--deploys-in", "9", "--set", "structure.sections=4"]
    plain, limited = (
        CliRunner().invoke(cli, [*words, *more])
        for more in ([], ["--set", "record.stress=true", "--set", "limits.rod_stress=2e8"])
    )
    assert limited.exit_code == 0
    assert limited.output == plain.output
