"""Steps that are repeated because their energy does not balance."""

import numpy as np
import pytest

from ringsim.parts.solver import Solver
from ringsim.scene import load_scene
from ringsim.simulation import run_frame
from ringsim.stepping import repeats
from ringsim.stepping.instant import Energies, Instant, Scales
from ringsim.stepping.repeats import EnergyImbalance

SOLVER = Solver(step=0.2, tolerance=1e-4)
ALLOWED = {True: 0.3 * 1e-4 * (1.0 / 3.0) ** 0.5, False: 0.3 * 1e-4}
"""Share of the energy exchanged that a step may lack, with and without ropes."""
LEAST = 2e-5


def instant(time: float, kinetic: float) -> Instant:
    """A structure into which 1 J was put, of which this is left, J."""
    return Instant(time, *np.zeros((2, 2, 3)), Energies(kinetic, 0.0, work=1.0, lost=0.0))


def shorter(control: EnergyImbalance, missing: float, step: float = 0.1) -> float | None:
    """What to repeat a step with in which so much energy is lost on the way, J."""
    return control.shorter(instant(0.0, 1.0), instant(step, 1.0 - missing))


def balance(*, roped: bool) -> EnergyImbalance:
    slack = {"slack_tension": 1e-3, "slack_energy": 1e-3} if roped else {}
    return EnergyImbalance(SOLVER, Scales(0.1, 1e-3, travel=3.0, length=0.3, **slack))


def test_a_balanced_step_is_kept() -> None:
    assert shorter(balance(roped=True), 1e-6) is None


@pytest.mark.parametrize("roped", [True, False])
def test_the_repeated_step_is_what_third_order_asks_for(roped: bool) -> None:
    asked = shorter(balance(roped=roped), 8.0 * ALLOWED[roped])
    assert asked == pytest.approx(0.1 * 0.8 / 2.0, rel=1e-3)


@pytest.mark.parametrize("roped", [True, False])
def test_repeating_ends_at_the_least_step(roped: bool) -> None:
    """Also if the step comes back with another last digit, as differences of times do."""
    control = balance(roped=roped)
    step, repeated = 0.1, 0
    while (asked := shorter(control, 0.5, step)) is not None:
        step, repeated = asked * (1.0 + 1e-11), repeated + 1
        assert repeated < 20
    assert step == pytest.approx(LEAST)


def test_patience_ends_without_ropes_alone() -> None:
    for roped in (True, False):
        control = balance(roped=roped)
        asked = [shorter(control, 0.5) is not None for _ in range(400)]
        assert asked[:300] == [True] * 300
        assert asked[-1] is roped
        assert ("steps repeated to keep the energy balance: 300," in control.note()) is not roped
        control.accept(instant(0.0, 1.0), instant(0.1, 0.5))
        assert (control.limit < 0.1) is roped


def test_a_run_tells_that_its_patience_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("ring18").with_values(
        {"structure.sections": 3, "structure.aspect_ratio": 1.0, "net": "none", "boom": "none",
         "loads.force": 0.03, "structure.opening_angle": 150.0}
    )  # fmt: skip
    assert "accepted as they were" not in run_frame(scene).reason
    monkeypatch.setattr(repeats, "PATIENCE", 1)
    once = run_frame(scene.with_values({"solver.restarts": 0}))
    assert "steps repeated to keep the energy balance: 1, further ones were accepted" in once.reason
