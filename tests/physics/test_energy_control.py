"""Steps that are repeated because their energy does not balance."""

import pytest

from ringsim.engine import energy_control
from ringsim.engine.energy_control import EnergyControl
from ringsim.outputs.instant import Energies
from ringsim.parts.solver import Solver
from ringsim.scene import load_scene
from ringsim.simulation import run

SOLVER = Solver(step=0.2, tolerance=1e-4)
ALLOWED = {True: 0.3 * 1e-4 * (1.0 / 3.0) ** 0.5, False: 0.3 * 1e-4}
"""Share of the energy exchanged that a step may lack, with and without ropes."""
LEAST = 2e-5
BEFORE = Energies(kinetic=1.0, elastic=0.0, work=1.0, lost=0.0)


def after(missing: float) -> Energies:
    """A step in which so much energy is lost on the way, J."""
    return Energies(kinetic=1.0 - missing, elastic=0.0, work=1.0, lost=0.0)


def test_a_balanced_step_is_kept() -> None:
    control = EnergyControl(SOLVER, 1e-3, tireless=True)
    assert control.shorter(0.1, BEFORE, after(1e-6)) is None


@pytest.mark.parametrize("roped", [True, False])
def test_the_repeated_step_is_what_third_order_asks_for(roped: bool) -> None:
    control = EnergyControl(SOLVER, 1e-3, tireless=roped)
    shorter = control.shorter(0.1, BEFORE, after(8.0 * ALLOWED[roped]))
    assert shorter == pytest.approx(0.1 * 0.8 / 2.0, rel=1e-3)


@pytest.mark.parametrize("tireless", [True, False])
def test_repeating_ends_at_the_least_step(tireless: bool) -> None:
    """Also if the step comes back with another last digit, as differences of times do."""
    control = EnergyControl(SOLVER, 1e-3, tireless=tireless)
    step, repeated = 0.1, 0
    while (shorter := control.shorter(step, BEFORE, after(0.5))) is not None:
        step, repeated = shorter * (1.0 + 1e-11), repeated + 1
        assert repeated < 20
    assert step == pytest.approx(LEAST)


def test_patience_ends_without_ropes_alone() -> None:
    for tireless in (True, False):
        control = EnergyControl(SOLVER, 1e-3, tireless=tireless)
        asked = [control.shorter(0.1, BEFORE, after(0.5)) is not None for _ in range(400)]
        assert asked[:300] == [True] * 300
        assert asked[-1] is tireless
        assert ("repeated a step 300 times" in control.note()) is not tireless
        control.accept(0.1, BEFORE, after(0.5))
        assert (control.limit < 0.1) is tireless


def test_a_run_tells_that_its_patience_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("ring18").with_values(
        {"structure.sections": 3, "structure.aspect_ratio": 1.0, "net": "none", "boom": "none",
         "loads.force": 0.03}
    )  # fmt: skip
    assert "left alone" not in run(scene).reason
    monkeypatch.setattr(energy_control, "_PATIENCE", 1)
    assert "energy repeated a step 1 times and was left alone" in run(scene).reason
