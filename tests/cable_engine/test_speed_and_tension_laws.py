"""Pulleys whose friction depends on the rope's speed or tension, in both engines and the margin.

The laws are records of one's own (``own_laws/stribeck.py``), imported in a process of their own.
"""

from __future__ import annotations

import functools
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import preloaded
import pytest

RUN = """
import json, math, sys
sys.dont_write_bytecode = True
folder, friction = sys.argv[1], json.loads(sys.argv[2])
sys.path.insert(0, folder)
import stribeck
from ringsim.parts.margin import EcssMechanisms
from ringsim.rigid.margin import PULLEYS, DriveMargin
from ringsim.scene import load_scene
from ringsim.simulation import simulate
values = {"structure.opening_angle": 60.0, "record.interval": 0.05, "solver.end_time": 0.55,
          "cables.upper.friction": friction, "cables.lower.friction": friction}
winding = {"kind": "motor", "stall_torque": 0.2, "no_load_speed": 600.0, "speed": 300.0,
           "drum_radius": 0.01}
scene = load_scene("truss2").with_values(values)
told = {}
for fidelity in sys.argv[3:]:
    run = simulate(scene, fidelity)
    told[fidelity] = {"time": run.time.values.tolist(), "angle": run.opening_angle.values.tolist(),
        "tension": run.cable_tension.values.tolist(), "energy_error": float(run.energy_error),
        "iterations": int(run.newton_iterations)}
motors = {f"cables.{plane}.winch.winding": winding for plane in ("upper", "lower")}
drive = DriveMargin(scene.with_values(motors), EcssMechanisms())
at = drive.at(1.5)
now = drive.mechanism.at(0.5 * (math.pi - 1.5))
over = drive.drive.reeved(now)[0].shortening.tolist()
told["margin"] = {"pulleys": at.resisting[PULLEYS], "shortening": over}
print(json.dumps(told))
"""
DRAG = 0.02
FRICTIONS: dict[str, dict[str, Any]] = {
    "bearing": {"kind": "bearing", "coefficient": 1e-3},
    "stribeck": {"kind": "stribeck", "coefficient": 1e-3, "kinetic": 0.4, "speed": 1e-3},
    "seal": {"kind": "seal-drag", "drag": DRAG},
}


@functools.cache
def ran(name: str, *engines: str) -> dict[str, Any]:
    laws = str(Path(__file__).parent / "own_laws")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.py"
        file.write_text(RUN, encoding="utf-8")
        words = [laws, json.dumps(FRICTIONS[name]), *engines]
        result = preloaded.script(file, *words, folder=file.parent)
    assert result.returncode == 0, result.stderr
    answer: dict[str, Any] = json.loads(result.stdout)
    return answer


def test_a_run_with_a_law_of_speed_balances_its_energy() -> None:
    found = ran("stribeck", "frame")["frame"]
    assert np.array(found["angle"])[..., -1].min() > 61.0
    assert found["energy_error"] < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["stribeck", "seal"])
def test_both_engines_agree_and_balance_their_energy(name: str) -> None:
    found = ran(name, "frame", "full")
    frame, full = found["frame"], found["full"]
    angles = np.array(frame["angle"]), np.array(full["angle"])
    assert angles[0][..., -1].min() > 61.0
    # With a law of the angle alone they differ by 3e-4 deg.
    assert np.nanmax(np.abs(angles[0] - angles[1])) < 1e-3
    assert max(frame["energy_error"], full["energy_error"]) < 1e-3


def test_friction_that_falls_with_speed_leaves_more_tension() -> None:
    """The rope runs at several times ``speed``: what is left is ``kinetic``, 0.4 of the bearing."""
    bearing, falling = (
        np.array(ran(name, *engines)["frame"]["tension"])
        for name, engines in (("bearing", ["frame"]), ("stribeck", ["frame"]))
    )
    lost = [-np.log(each[:, 1, 10] / each[:, 0, 10]) for each in (bearing, falling)]
    assert lost[1] == pytest.approx(0.4 * lost[0], rel=0.02)


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_each_pulley_takes_the_drag_of_its_seal(fidelity: str) -> None:
    tension = np.array(ran("seal", fidelity)[fidelity]["tension"])[:, :, 10]
    assert tension.min() > DRAG
    # 1 - tanh(6) of the friction fades at the slowest pulley.
    assert tension[:, :-1] - tension[:, 1:] == pytest.approx(DRAG, rel=1e-3)


def test_the_margin_counts_the_drag_of_every_pulley() -> None:
    """T_i = T_0 - i F by virtual work: both cables lose F sum i dL_i."""
    found = ran("seal", "frame")["margin"]
    shortening = np.array(found["shortening"])
    expected = 2.0 * DRAG * float(np.arange(len(shortening)) @ shortening)
    assert found["pulleys"] == pytest.approx(expected, rel=1e-9)
