"""Every pair of a failing motor and a damage: sound numbers, and the outcome that physics wants."""

import functools
import sys
from pathlib import Path

import pytest

from ringsim.scene import Scene
from ringsim.simulation import FIDELITIES
from ringsim.variables import Fate, Outcome, Status

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from fault_matrix import cells, faulty, sound_scene

CELLS = [cell for cell in cells() if cell[0] != "sound"]


@functools.cache
def sound(fidelity: str, sections: int) -> tuple[Scene, Outcome]:
    scene = sound_scene(sections)
    return scene, FIDELITIES[fidelity](scene)


# exudyn takes 3 to 15 s for a cell: frames run those of two sections by default, of a lower winch
# that goes on only those with damage in the other plane.
@pytest.mark.parametrize(
    ("fidelity", "sections", "motor", "damage", "plane"),
    [
        pytest.param(fidelity, sections, *cell, marks=pytest.mark.slow if slow else ())
        for fidelity, sections in (("full", 2), ("frame", 2), ("frame", 4), ("full", 6))
        for cell in CELLS
        for slow in [
            sections > 2 or fidelity == "full" or (cell[0] != "stopped" and cell[2] == "lower")
        ]
    ],
)
def test_every_pair_of_faults_is_an_outcome_and_no_failure(
    fidelity: str, sections: int, motor: str, damage: str, plane: str
) -> None:
    scene, whole = sound(fidelity, sections)
    assert whole.fate is Fate.DEPLOYED
    length, peak = (float(whole.values[n]) for n in ("deployment_time", "peak_tension"))
    found = FIDELITIES[fidelity](faulty(scene, motor, damage, plane, length, peak))
    assert found.status == Status.OK, found.reason
    assert int(found.values["restarts"]) == 0
    assert found.values["energy_error"] < 1e-3
    if fidelity == "frame":  # also at rest, and where a winch no longer answers to its rope
        values = found.values
        assert values["total_newton_iterations"] < 6 * values["total_steps"]
    stuck = damage == "stuck"
    locked = int(found.values["locked_joints"])
    assert found.fate is not Fate.NONE
    if found.fate is Fate.DEPLOYED:
        assert locked == 2 * sections
    if damage == "none" and motor in ("late", "weak"):
        assert found.fate is Fate.DEPLOYED
    if stuck or motor == "stopped":
        assert found.fate is not Fate.DEPLOYED
        assert locked < 2 * sections
    if stuck:
        # One held joint keeps its angle; its winch drives the others past their stops, or rests.
        assert found.fate in (Fate.OVERLOADED, Fate.PARTLY_DEPLOYED, Fate.STALLED)
