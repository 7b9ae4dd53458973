"""Dry joints in exudyn: lines through their law, which Newton follows across its passage."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
import pytest

from ringsim.exudyn.assembly import DryJoints
from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration
from ringsim.frame.integrate import solve as by_frames
from ringsim.scene import Scene, load_scene
from ringsim.variables import Fate

DRY = {"kind": "viscous-coulomb", "coulomb": 0.05, "viscous": 0.3, "rate": 2e-4}


def ring(name: str, **values: Any) -> Scene:
    plain = {"structure.sections": 3, "net": "none", "joints.vjoint": DRY}
    return load_scene(name).with_values(
        plain | {k.replace("__", "."): v for k, v in values.items()}
    )


def even(**values: Any) -> Scene:
    """A short run with constant steps, whose joints turn both ways."""
    law = DRY | {"coulomb": [2e-4, 1e-4, 3e-4], "viscous": 1e-4, "rate": 1e-3}
    return ring(
        "ring18", joints__vjoint=law, joints__pivot=law, solver__step_control="constant",
        solver__step=0.02, solver__end_time=1.0, loads__force=0.03, **values,
    )  # fmt: skip


def test_residuals_are_those_of_the_law_as_a_user_function(monkeypatch: Any) -> None:
    lines = Integration(build(even())).run()

    def add(self: DryJoints, law: Any, markers: Any) -> None:
        for number, pair in enumerate(markers):

            def torque(
                mbs: Any, t: float, own: int, angle: float, rate: float, *_: float, n: int = number
            ) -> float:
                return float(law.torque(np.full(len(markers), rate))[n])

            self._system.AddObject(
                item.ObjectConnectorTorsionalSpringDamper(
                    markerNumbers=list(pair), springTorqueUserFunction=torque
                )
            )

    monkeypatch.setattr(DryJoints, "add", add)
    functions = Integration(build(even())).run()
    assert len(lines.times) == len(functions.times) > 50
    moved = np.array(lines.angles) - np.array(lines.angles)[0]
    assert np.abs(moved).max() > 0.01
    np.testing.assert_allclose(lines.angles, functions.angles, atol=1e-8, rtol=0.0)
    lost, same = (np.array(run.energies)[:, 3] for run in (lines, functions))
    assert lost.sum() > 1e-6
    np.testing.assert_allclose(lost, same, atol=1e-6 * lost.sum(), rtol=0.0)


def test_accepted_states_carry_the_torque_of_the_law() -> None:
    built = build(even())
    system, found = built.model.assembly.system, []
    families = built.model.assembly.dry_joints.families
    assert sum(len(dampers) for _, dampers, _ in families) == 6 + 3

    def look(_: Any) -> None:
        for law, dampers, _turning in families:
            rate, torque = (
                np.array([system.GetObjectOutput(d, kind) for d in dampers])
                for kind in (
                    exu.OutputVariableType.AngularVelocityLocal,
                    exu.OutputVariableType.TorqueLocal,
                )
            )
            found.append(float(np.abs(torque - law.torque(rate)).max()))

    Integration(built, look).run()
    assert len(found) > 50
    assert max(found) < 1e-15


@pytest.mark.slow  # long steps and few iterations are below
def test_joints_that_stop_within_a_step_cost_few_iterations() -> None:
    """Joints lock one after the other, and each stops its neighbours: 840 iterations and a
    repeated step, with tangents alone 2151 and 49.
    """
    scene = ring("ring18-cable")
    run = Integration(build(scene)).run()
    assert run.fate == Fate.DEPLOYED
    assert run.newton_iterations < 1500
    assert run.repeats < 15
    # The engines differ by the error of their steps, as without dry friction.
    other = by_frames(scene).values["deployment_time"]
    assert run.outcome().values["deployment_time"] == pytest.approx(float(other), rel=1e-3)


def test_long_steps_begin_close_and_renew_what_is_rough() -> None:
    """A ring that two motors open in steps of up to 0.3 s: with starts from differences of the
    velocities, and exudyn's own way of beginning anew, 491 iterations, 312 Jacobians and 7 repeated
    steps, for 209, 65 and none.
    """
    scene = load_scene("ring18-motor").with_values(
        {
            "structure.sections": 6, "solver.tolerance": 0.01, "solver.step": 0.3,
            "solver.end_time": 2.0, "record.interval": 0.5,
        }
    )  # fmt: skip
    run = Integration(build(scene)).run()
    assert run.newton_iterations < 300
    assert run.jacobians < 150
    assert run.repeats <= 2
