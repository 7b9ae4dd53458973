"""A new friction law and a new winding law: one record each, picked by its kind, nothing else.

The records stand in files of ``own_laws``, which a script imports before it reads its scene; they
stay known as long as it runs, therefore it is a process of its own.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import preloaded
import pytest

LAWS = Path(__file__).parent / "own_laws"
RUN = """
import importlib, json, sys
sys.dont_write_bytecode = True
folder, values = sys.argv[1], json.loads(sys.argv[2])
sys.path.insert(0, folder)
for law in ("sheave_efficiency", "pulsating"):
    importlib.import_module(law)
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run_frame as run
scene = load_scene("truss2").with_values(values)
assert Scene.model_validate(scene.model_dump(mode="json")) == scene
found = run(scene)
names = ("cable_tension", "wound_length", "energy_error", "opening_angle")
print(json.dumps({"time": found.coordinates["time"].tolist(), "reason": found.reason}
    | {name: found.values[name].tolist() for name in names}))
"""
SPEED, PERIOD, EFFICIENCY = 0.05, 0.8, 0.95


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    values: dict[str, Any] = {
        "structure.opening_angle": 60.0,
        "record.interval": 0.05,
        "solver.end_time": 1.4,
    }
    for cable in ("upper", "lower"):
        winding = {"kind": "pulsating", "speed": SPEED, "period": PERIOD}
        friction = {"kind": "sheave-efficiency", "efficiency": EFFICIENCY}
        values |= {f"cables.{cable}.winch.winding": winding, f"cables.{cable}.friction": friction}
    file = tmp_path_factory.mktemp("laws") / "run.py"
    file.write_text(RUN, encoding="utf-8")
    result = preloaded.script(file, LAWS, json.dumps(values), folder=file.parent)
    assert result.returncode == 0, result.stderr
    answer: dict[str, Any] = json.loads(result.stdout)
    return answer


def test_a_winding_law_of_ones_own_winds_the_rope(found: dict[str, Any]) -> None:
    time, turn = np.array(found["time"]), 2.0 * np.pi / PERIOD
    stated = SPEED * (time - np.sin(turn * time) / turn)
    # Read at the ends of steps and put on the grid by cubics.
    assert np.array(found["wound_length"])[0] == pytest.approx(stated, abs=2e-5)
    assert np.array(found["opening_angle"])[..., -1].min() > 80.0


def test_a_friction_law_of_ones_own_lets_the_tension_fall(found: dict[str, Any]) -> None:
    """By the efficiency of each of the five pulleys, while the rope runs."""
    time, tension = np.array(found["time"]), np.array(found["cable_tension"])
    running = np.isclose(time, 1.2, atol=0.1)
    ratio = tension[:, 1:, running] / tension[:, :-1, running]
    assert tension[..., running].min() > 0.1
    # The slowest pulley has tanh(3) of its friction at the mean speed of the winch; here it runs at
    # almost twice that, and 1 - tanh(6) is 1e-5.
    assert ratio == pytest.approx(EFFICIENCY, abs=1e-4)
    assert found["energy_error"] < 1e-3
