"""Steps that are too long for the shocks of locks."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ringsim.cli import cli
from ringsim.outputs import VARIABLES
from ringsim.outputs.base import unresolved
from ringsim.outputs.family import Run, Series
from ringsim.scene import load_scene
from ringsim.simulation import run_frame, simulate
from ringsim.stepping import repeats
from ringsim.variables import Fate

AT_ONE = {"peak_base_force": 1.0}
"""A number of the run that was made at 1 s."""
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
    assert run(1.0).slowest_period == pytest.approx(PERIOD, rel=1e-12)


@pytest.mark.quick
@pytest.mark.parametrize("record", ["reactions", "accelerations"])
def test_steps_longer_than_a_fiftieth_of_its_period_are_told(record: str) -> None:
    told = unresolved(run(0.2, **{record: True}), AT_ONE)
    assert told.startswith(
        f"; steps of {200.0 * PERIOD:.3g} ms at the lock at 1 s are too long for shocks"
    )
    enough = 0.9 * load_scene("ring18").solver.tolerance * 0.15**2  # (0.02 / 0.2)^2 in two turns
    assert f"so peak_base_force may be off: set solver.tolerance = {enough:.1e} (" in told
    told = unresolved(run(0.04, **{record: True}), AT_ONE)
    enough = 0.9 * load_scene("ring18").solver.tolerance * (0.02 / 0.04) ** 2
    assert f"so peak_base_force may be off: set solver.tolerance = {enough:.1e} (" in told
    assert unresolved(run(0.018, **{record: True}), AT_ONE) == ""


@pytest.mark.quick
def test_far_too_long_steps_are_cured_in_turns() -> None:
    """Of steps of ten periods, two hundred times too long, by 0.15 at once."""
    words = unresolved(run(10.0, reactions=True), AT_ONE)
    first = 0.9 * load_scene("ring18").solver.tolerance * 0.15**2
    assert f"set solver.tolerance = {first:.1e} (" in words


@pytest.mark.quick
def test_long_steps_at_any_lock_may_hide_a_larger_number() -> None:
    shocks = {"peak_base_force": 0.5, "peak_rod_stress": 1.0, "peak_base_torque": 1.5}
    words = unresolved(run(0.2, reactions=True), shocks)
    assert "so peak_base_force, peak_rod_stress, peak_base_torque may be off" in words


@pytest.mark.quick
def test_first_instants_of_a_shock_count_for_accelerations_that_were_made_there() -> None:
    """At the lock, at 1 s, and until a period after it."""
    for share, time, told in (
        (0.018, 1.0, True), (0.018, 1.0 + 0.9 * PERIOD, True), (0.018, 1.0 + 1.1 * PERIOD, False),
        (0.018, 0.99, False), (0.0019, 1.0, False),
    ):  # fmt: skip
        shocks = {"peak_base_force": time, "peak_acceleration_max": time}
        words = unresolved(run(share, accelerations=True), shocks)
        assert ("first instants of a shock, so peak_acceleration_max may" in words) == told, time
        assert bool(words) == told


@pytest.mark.quick
def test_steps_count_at_locks_alone_and_where_shocks_are_recorded() -> None:
    def shocks(at: float) -> dict[str, float]:
        return {"peak_base_force": at}

    assert "lock at 0.5 s" in unresolved(run(0.04, lock=0.5, reactions=True), shocks(0.5))
    assert unresolved(run(0.018, lock=1.9, reactions=True), shocks(1.9)) == ""
    assert unresolved(run(0.2, reactions=True), {}) == ""
    assert unresolved(run(0.2, stress=True), {"peak_rod_stress": 1.0}) == ""
    assert unresolved(run(0.2, lock=math.nan, reactions=True), AT_ONE) == ""


@pytest.mark.quick
def test_rings_without_stops_have_no_shocks_and_constant_steps_another_cure() -> None:
    assert unresolved(run(0.2, also={"stop": "none"}, reactions=True), AT_ONE) == ""
    constant = run(0.2, also={"solver.step_control": "constant"}, reactions=True)
    enough = 0.9 * load_scene("ring18").solver.step * 0.02 / 0.2
    assert unresolved(constant, AT_ONE).endswith(f"set solver.step = {enough:.2g}")


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("ring18-cable", {"structure.sections": 4, "boom.base": "fixed", "stop.latch": True}),
        ("ring18-flight", {"structure.sections": 4}),
        pytest.param("ring18-ground", {"structure.sections": 6}, marks=pytest.mark.slow),
        pytest.param("ring18-cable", {"boom.base": "fixed"}, marks=pytest.mark.slow),
    ],
)
def test_steps_follow_shocks_where_these_are_recorded(
    name: str, values: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against steps sixteen times as short at locks, and others of a tenth of the tolerance."""
    scene = load_scene(name).with_values(values | {"record.reactions": True})
    first = run_frame(scene)
    assert "too long for shocks" not in first.reason
    monkeypatch.setattr(repeats, "FRONT", 16.0 * repeats.FRONT)
    finer = run_frame(scene.with_values({"solver.tolerance": 0.1 * scene.solver.tolerance}))
    for each in ("peak_base_force", "peak_base_torque", "peak_lock_impulse"):
        assert float(first.values[each]) == pytest.approx(float(finer.values[each]), rel=0.12), each
    # Unasked they cost nothing: the motion alone rules, and does not see locks.
    plain = run_frame(scene.with_values({"record.reactions": False}))
    assert float(plain.values["steps"]) < float(first.values["steps"])


def test_both_engines_agree_on_shocks() -> None:
    values = {"structure.sections": 4, "record.accelerations": True}
    scene = load_scene("ring18-ground").with_values(values)
    frame, full = (simulate(scene, fidelity=fidelity) for fidelity in ("frame", "full"))
    for name, share in (
        ("peak_base_force", 1e-2), ("peak_base_torque", 1e-2), ("peak_lock_impulse", 2e-3),
        ("peak_acceleration_max", 5e-2), ("peak_latch_rate", 1e-3),
    ):  # fmt: skip
        assert float(frame[name]) == pytest.approx(float(full[name]), rel=share), name


@pytest.mark.parametrize(
    ("name", "sections"),
    [
        ("ring18-cable", 4),
        pytest.param("ring18-flight", 4, marks=pytest.mark.slow),
        pytest.param("ring18-ground", 6, marks=pytest.mark.slow),
    ],
)
def test_the_cost_of_the_tolerance_that_is_told(name: str, sections: int) -> None:
    values = {"structure.sections": sections, "record.accelerations": True, "stop.latch": True}
    scene = load_scene(name).with_values(values)
    first = run_frame(scene)
    told = r"set solver\.tolerance = (\S+) \((\S+) to (\S+) times the steps\)"
    tolerance, low, high = re.findall(told, first.reason)[0]
    finer = run_frame(scene.with_values({"solver.tolerance": float(tolerance)}))
    assert finer.fate is Fate.DEPLOYED
    steps = float(finer.values["steps"]) / float(first.values["steps"])
    assert float(low) <= steps <= float(high)


@pytest.mark.quick
def test_a_lock_in_the_last_step_counts_that_step() -> None:
    last = run(0.2, lock=1.999, reactions=True)
    assert "too long for shocks" in unresolved(last, {"peak_base_force": 1.9995})


def test_the_summary_of_a_run_marks_them(tmp_path: Path) -> None:
    """All that the reason names, and nothing else."""
    values = ("structure.sections=4", "record.accelerations=true", "stop.latch=true")
    words = ["run", "ring18-cable", "--fidelity=frame", f"--out={tmp_path / 'one.nc'}"]
    text = CliRunner().invoke(cli, [*words, *(f"--set={each}" for each in values)]).output
    (named,) = re.findall(r", so (.*) may be off", text)
    labels = {VARIABLES[name].summary[0] for name in named.split(", ")}
    assert set(re.findall(r"^  (\S.*?) \? ", text, re.MULTILINE)) == labels
