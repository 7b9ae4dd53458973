"""Flexible rings against MBDyn: opening times, deviations between joints, stresses, lock times.

MBDyn and ringsim share neither code nor beam formulation.  What is compared and how well MBDyn
knows it stands in mbdyn_data/README.md; ``OWN_*`` below repeat the errors that matter here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
import xarray as xr

from mbdyn_reference import (
    CASES,
    DATA,
    ENDS,
    LOCK_TIMES,
    Array,
    Comparison,
    reference,
    rods_of,
    scene_of,
    tight_settings,
)
from ringsim.simulation import simulate


@dataclass(frozen=True)
class Bounds:
    """What ringsim promises: relative errors, deviations and stresses over the largest one."""

    time: float
    deviations: float
    mean_bar_stress: float
    worst_stress: float


DEFAULT = Bounds(time=1e-4, deviations=2e-2, mean_bar_stress=2e-2, worst_stress=5e-2)
TIGHT = Bounds(time=1e-5, deviations=1e-3, mean_bar_stress=5e-3, worst_stress=1e-2)


OWN_DEVIATIONS: dict[str, tuple[list[float], list[float]]] = {
    "closed6_force": ([150.0], [0.0]),  # 3e-4, below a third of every bound
    "closed18_force": ([150.0], [5e-4]),
    # Known to 150 deg; after it, by how much ringsim with constant steps of 5 ms differs, which
    # is three times what its own steps of 10 ms and 5 ms differ by.
    "ring18": ([150.0, 154.0, 160.0, 168.5], [7e-3, 1.3e-2, 1.3e-2, 2.3e-2]),
}
"""MBDyn's own errors: mean angles in deg, errors of deviations over the largest."""
OWN_STRESS: dict[str, tuple[list[float], list[float]]] = {
    "closed6_force": ([75.0], [0.0]),  # 3e-3, below a third of every bound
    "closed18_force": ([75.0], [7e-3]),
    "ring18": ([104.9, 105.0], [5e-2, 2e-2]),
}
"""The same for stresses."""

# The forces of closed6_force on the sections of ring18: both run.
AT_DEFAULT = [
    pytest.param(case, marks=pytest.mark.slow if case == "closed18_force" else ()) for case in CASES
]
WITH_STRESS = [
    pytest.param(case, marks=() if case == "closed6_force" else pytest.mark.slow) for case in CASES
]


@lru_cache
def default_run(case: str, *, stress: bool) -> xr.Dataset:
    """At default settings; steps may be shorter where stress is asked for."""
    return simulate(scene_of(case, {"record.stress": stress}))


@lru_cache
def tight_run(case: str) -> xr.Dataset:
    return simulate(scene_of(case, tight_settings(case)))


def check_times(found: Comparison, bounds: Bounds) -> None:
    errors = found.time_errors(found.rows(60.0, 175.0))
    assert len(errors) > 20
    assert np.abs(errors).max() < bounds.time


def check_deviations(case: str, found: Comparison, bounds: Bounds) -> None:
    rows = found.rows(148.0, 171.0)
    assert len(rows) >= 4
    own = np.interp(found.theirs.mean[rows], *OWN_DEVIATIONS[case])
    assert np.all(found.deviation_errors(rows) < bounds.deviations + own)


def check_stresses(case: str, found: Comparison, bounds: Bounds) -> None:
    rows = found.rows(75.0, 135.0)
    assert len(rows) > 20
    assert abs(found.mean_bar_stress_error(rows)) < bounds.mean_bar_stress
    own = np.interp(found.theirs.mean[rows], *OWN_STRESS[case])
    assert np.all(found.stress_errors(rows) < bounds.worst_stress + own)


@pytest.mark.parametrize("case", AT_DEFAULT)
def test_opening_times_at_default_settings(case: str) -> None:
    check_times(Comparison(case, default_run(case, stress=False)), DEFAULT)


@pytest.mark.parametrize("case", AT_DEFAULT)
def test_deviations_at_default_settings(case: str) -> None:
    check_deviations(case, Comparison(case, default_run(case, stress=False)), DEFAULT)


@pytest.mark.parametrize("case", WITH_STRESS)
def test_everything_at_default_settings_with_stress(case: str) -> None:
    found = Comparison(case, default_run(case, stress=True))
    check_times(found, DEFAULT)
    check_deviations(case, found, DEFAULT)
    check_stresses(case, found, DEFAULT)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_everything_at_tight_settings(case: str) -> None:
    found = Comparison(case, tight_run(case))
    check_times(found, TIGHT)
    check_deviations(case, found, TIGHT)
    check_stresses(case, found, TIGHT)


RING18_LOSS = 4.4e-9
"""J lost in the rods of ring18 until 17 s: the limit of second order of what constant steps of
10 ms and 5 ms give, 4.04e-9 and 4.34e-9."""


@pytest.mark.parametrize("stress", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_rods_lose_what_they_should(stress: bool) -> None:
    """A factor of 2: the loss goes with the square of vibrations that steps may not resolve."""
    lost = float(default_run("ring18", stress=stress)["dissipation"].interp(time=17.0))
    assert RING18_LOSS / 2.0 < lost < RING18_LOSS * 2.0


@pytest.mark.slow
def test_the_loss_converges() -> None:
    lost = float(tight_run("ring18")["dissipation"].interp(time=17.0))
    # 8 % below the limit.
    assert lost == pytest.approx(RING18_LOSS, rel=0.1)


def test_lock_times_with_elastic_stops() -> None:
    """Joints bounce while others still open: the locks depend on the stops of all."""
    run = simulate(scene_of("closed6_force", {"stop.damping": 0.0, "record.stress": False}))
    locks = run["lock_time"].transpose("plane", "section").values
    np.testing.assert_allclose(locks, np.tile(LOCK_TIMES, (2, 1)), rtol=DEFAULT.time)
    # With MBDyn's step of 1 ms the differences agree to 1.2 % of the span, with finer ones to 4 %:
    # that much of the bounces is the error of such a step.
    after_first = locks - locks.min()
    span = np.ptp(LOCK_TIMES)
    np.testing.assert_allclose(
        after_first, np.tile(LOCK_TIMES - LOCK_TIMES.min(), (2, 1)), atol=0.05 * span
    )


@pytest.mark.parametrize("case", CASES)
def test_mbdyn_forces_give_its_stresses(case: str) -> None:
    """|N| / A + |M| r / I of single rods reaches but never exceeds the largest of all sections."""
    series, names = reference(case), rods_of(case)

    def column(rod: str, section: int | None) -> Array:
        return series.stresses[1:, names.index((rod, section))]

    for rod in ENDS:
        sections = [k for other, k in names if other == rod and k is not None]
        single = np.max([column(rod, k) for k in sections], axis=0)
        ratio = single / column(rod, None)
        assert ratio.max() < 1.0 + 1e-7  # rounded to nine digits
        if rod.startswith("bar"):
            assert ratio.max() > 1.0 - 1e-7


@pytest.mark.parametrize("case", CASES)
def test_the_data_start_in_the_fold_state(case: str) -> None:
    """47.578 deg, rounded to a millionth."""
    np.testing.assert_allclose(reference(case).angles[0], 47.578, atol=1e-6)


def test_the_page_says_what_a_run_gives() -> None:
    """The row of closed6_force at default settings, to the digits that are written."""
    file = DATA.parents[2] / "docs" / "evidence" / "cross_validation.md"
    page = file.read_text(encoding="utf-8")
    row = next(r for r in page.splitlines() if r.startswith("| closed6_force | default |"))
    time, _, _, asynchrony, mean_stress, worst_stress = row.strip("| ").split(" | ")[2:8]
    found = Comparison("closed6_force", default_run("closed6_force", stress=True))
    errors = found.time_errors(found.rows(60.0, 175.0))
    stressed = found.rows(75.0, 135.0)
    assert errors[np.abs(errors).argmax()] == pytest.approx(float(time), rel=0.3)
    assert found.asynchrony_error() == pytest.approx(float(asynchrony), rel=0.3)
    percent = 100.0 * found.mean_bar_stress_error(stressed)
    assert percent == pytest.approx(float(mean_stress.rstrip("%")), abs=0.1)
    percent = 100.0 * float(found.stress_errors(stressed).max())
    assert percent == pytest.approx(float(worst_stress.rstrip("%")), abs=0.1)
