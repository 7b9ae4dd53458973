"""Steps that are too long for the shocks of locks."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from ringsim.outputs.base import slowest_period, unresolved
from ringsim.outputs.family import Run, Series
from ringsim.scene import load_scene
from ringsim.simulation import run_frame
from ringsim.variables import Fate

PERIOD = 2.0 * 0.855**2 / math.pi * 4.0 * math.sqrt(1800.0 / 120e9 / (0.01**2 + 0.00915**2))
"""Of the diagonals of ring18, 2 x 0.4275 m: rho A / (E I) = 16 rho / (E (D^2 + d^2))."""


def run(
    steps: float, *, lock: float = 1.0, also: dict[str, str] | None = None, **record: bool
) -> Run:
    """Steps of 50 ms until 0.9 s, then of so many periods of the slowest rod until 2 s."""
    wanted = (also or {}) | {f"record.{k}": v for k, v in record.items()}
    scene = load_scene("ring18").with_values(wanted)
    times = np.concatenate([np.arange(0.0, 0.9, 0.05), np.arange(0.9, 2.0, steps * PERIOD)])
    nothing = Series(times, np.zeros((len(times), 2, 18)), times)
    locks = np.full((2, 18), np.nan)
    locks[0, 3] = lock
    return Run(scene, nothing, nothing, locks, {}, {})


@pytest.mark.quick
def test_the_slowest_rod_is_a_pinned_diagonal() -> None:
    assert slowest_period(run(1.0)) == pytest.approx(PERIOD, rel=1e-12)


@pytest.mark.quick
@pytest.mark.parametrize("record", ["reactions", "accelerations"])
def test_steps_longer_than_an_eighth_of_its_period_are_told(record: str) -> None:
    told = unresolved(run(0.2, **{record: True}))
    assert told.startswith(
        f"; steps of {200.0 * PERIOD:.3g} ms at the lock at 1 s are too long for shocks"
    )
    enough = 0.9 * load_scene("ring18").solver.tolerance * (0.125 / 0.2) ** 2
    assert told.endswith(
        f"reduce solver.tolerance to {enough:.1e}, as steps go with its square root"
    )
    assert unresolved(run(0.12, **{record: True})) == ""


@pytest.mark.quick
def test_steps_count_at_locks_alone_and_where_shocks_are_recorded() -> None:
    assert "lock at 0.5 s" in unresolved(run(0.05, lock=0.5, reactions=True))
    assert unresolved(run(0.05, lock=1.9, reactions=True)) == ""
    assert unresolved(run(0.2)) == ""
    assert unresolved(run(0.2, lock=math.nan, reactions=True)) == ""


@pytest.mark.quick
def test_rings_without_stops_have_no_shocks_and_constant_steps_another_cure() -> None:
    assert unresolved(run(0.2, also={"stop": "none"}, reactions=True)) == ""
    constant = run(0.2, also={"solver.step_control": "constant"}, reactions=True)
    enough = 0.9 * load_scene("ring18").solver.step * 0.125 / 0.2
    assert unresolved(constant).endswith(f"reduce solver.step to {enough:.2g} s")


@pytest.mark.parametrize(
    ("name", "sections"),
    [
        ("ring18-cable", 4),
        pytest.param("truss2", 2, marks=pytest.mark.slow),
        pytest.param("ring18-cable", 18, marks=pytest.mark.slow),
    ],
)
def test_the_tolerance_that_is_told_is_enough(name: str, sections: int) -> None:
    values = {"structure.sections": sections, "record.reactions": True}
    scene = load_scene(name).with_values(values)
    (told,) = re.findall(r"reduce solver\.tolerance to (\S+), ", run_frame(scene).reason)
    finer = run_frame(scene.with_values({"solver.tolerance": float(told)}))
    assert finer.fate is Fate.DEPLOYED
    assert "too long for shocks" not in finer.reason


@pytest.mark.quick
def test_a_lock_in_the_last_step_counts_that_step() -> None:
    last = run(0.2, lock=1.999, reactions=True)
    assert "too long for shocks" in unresolved(last)
