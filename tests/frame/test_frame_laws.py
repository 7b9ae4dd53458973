"""Every law by both engines: short runs with the same constant steps.

Both integrate by the same scheme and have the same rods, so that they are much closer than either
is to the truth: what they differ by must be within what their steps leave (a third of what twice
the step changes).  Beside that 1e-4 of the largest value is allowed for what they do differently:
rotary inertia (about its own axis a rod has none in frames), Newton's tolerance, and gaps of
penalties.  Found are 1e-9 to 1e-6 of angles, and 1e-7 to 1e-4 of tensions and stresses.
"""

import pytest

from engine_pairs import apart
from law_scenes import CABLES, FORCES, of_cables, of_forces
from ringsim.scene import Scene
from ringsim.simulation import simulate

FLOOR = 1e-4
SLOW = {
    "forces": {"viscous-vjoint", "dry-vjoint", "dry-pivot", "dry-hinge", "viscous-sections",
               "damped-rods", "force-sections", "net", "rigid-free", "arc-2-free", "damped-net",
               "arc-5", "flexible-free", "free-stop", "edge-net", "ramps"},
    "cables": {"bearing", "bearing-exact", "both", "bar-half", "table", "damped-rope", "jammed",
               "cut", "stuck", "last", "capstan-pulleys", "frictionless", "stall", "two-winches",
               "feedback", "locked", "constant", "arc-2-flexible", "boom-and-net", "late-lower",
               "taut", "backdrivable"},
}  # fmt: skip
"""Near kin of what runs by default: some laws run together there, and alone here."""
QUICK = {"closed-6", "both-bar-half", "all-joints"}


def named(kind: str, scenes: dict[str, dict[str, object]]) -> list[object]:
    marks = dict.fromkeys(scenes, ()) | dict.fromkeys(SLOW[kind] & {*scenes}, pytest.mark.slow)
    marks |= dict.fromkeys(QUICK & {*scenes}, pytest.mark.quick)
    return [pytest.param(v, id=name, marks=marks[name]) for name, v in scenes.items()]


def check(scene: Scene) -> None:
    for name, found in apart(scene).items():
        assert found.difference <= 2.0 * found.error + FLOOR * found.largest, name


@pytest.mark.parametrize("values", named("forces", FORCES))
def test_rings_under_forces(values: dict[str, object]) -> None:
    check(of_forces(values))


@pytest.mark.parametrize("values", named("cables", CABLES))
def test_rings_on_cables(values: dict[str, object]) -> None:
    check(of_cables(values))


@pytest.mark.parametrize("fidelity", [pytest.param("full", marks=pytest.mark.slow), "frame"])
def test_faults_closer_than_any_step(fidelity: str) -> None:
    """A cable is cut twice, 1e-10 s apart, which is as if it were cut so at once."""
    first = {"kind": "cut-cable", "cable": 1, "span": 2, "time": 0.2}
    second = {"kind": "cut-cable", "cable": 1, "span": 6}
    once, twice = (
        simulate(of_cables({"faults": [first, second | {"time": time}]}), fidelity=fidelity)
        for time in (0.2, 0.2 + 1e-10)
    )
    assert once.status.item() == twice.status.item() == 0
    last = once.cable_tension.isel(time=-1)
    assert last.max() > 10.0
    assert abs(twice.cable_tension.isel(time=-1) - last).max() < 1e-3 * last.max()
