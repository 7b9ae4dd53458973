"""What docs/cables.md says of paper 000's figs 4, 6, 7, 9 and 10, computed anew from a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from ringsim.plots.cables import section_series
from ringsim.scene import load_scene
from ringsim.simulation import simulate

Array = NDArray[np.float64]
PAGE = Path(__file__).parents[2] / "docs" / "cables.md"
HALF, OFFSET, RATIO, PLAN = 0.2889, 0.105, 0.04, np.radians(21.53959)
"""Of truss2: bar half and block offset (m), f / R, and the turn of the plan between sections."""


@pytest.fixture(scope="module")
def truss() -> xr.Dataset:
    return simulate(load_scene("truss2"))


def fall(truss: xr.Dataset) -> Array:
    """Gamma of eq. 20 with the offset of the block, shape (section, time)."""
    opening = np.radians(truss["opening_angle"].sel(plane="upper").values)
    fold = 0.5 * (np.pi - opening)
    return np.arctan2(HALF * np.sin(fold) + OFFSET, HALF * np.cos(fold))


def at(truss: xr.Dataset, time: float) -> int:
    found = int(np.argmin(np.abs(truss["time"].values - time)))
    assert truss["time"].values[found] == pytest.approx(time, abs=1e-9)
    return found


def row(figure: str) -> str:
    """The page's row of a figure."""
    return next(line for line in PAGE.read_text().splitlines() if line.startswith(f"| {figure}"))


def test_fig_4_span_lengths(truss: xr.Dataset) -> None:
    """A rope along four spans of one length gives what was wound: no geometry is needed."""
    opening = np.radians(truss["opening_angle"].sel(plane="upper").values)
    length = np.sqrt(HALF**2 + OFFSET**2 + 2.0 * HALF * OFFSET * np.cos(0.5 * opening))
    assert section_series(truss, "upper")["length"].values == pytest.approx(length, nan_ok=True)
    last = int(np.flatnonzero(np.isfinite(length[0]))[-1])
    begin, end = length[:, 0].mean(), length[:, at(truss, 34.0)].mean()
    assert (round(begin, 3), round(end, 3)) == (0.393, 0.308)
    assert "0.393 m to 0.308 m" in row("4")
    wound = truss["wound_length"].sel(plane="upper").values
    taken = (length[:, :1] - length[:, : last + 1]).mean(axis=0)
    # Elongation is 1e-7 m; the truss is ahead of its rope by 1 mm in a span while that is slack.
    settled = truss["time"].values[: last + 1] > 1.0
    assert taken[settled] == pytest.approx(0.25 * wound[: last + 1][settled], abs=2e-5)


def eta(angle: Array) -> Array:
    """Eq. 19."""
    return np.asarray((1.0 - RATIO * np.cos(0.5 * angle)) / (1.0 + RATIO * np.cos(0.5 * angle)))


@pytest.mark.parametrize(("figure", "section", "least", "most"), [
    ("6", 0, 0.81, 0.90), ("7", 1, 0.88, 0.96),
])  # fmt: skip
def test_figs_6_and_7_decay_factors(
    truss: xr.Dataset, figure: str, section: int, least: float, most: float
) -> None:
    """Eqs 19 and 20 at the angles of the run; the plan's turn adds to the hinge pulleys'."""
    gamma = fall(truss)[section]
    beside = np.pi - np.arccos(np.cos(0.5 * PLAN) * np.cos(gamma))
    hinge = eta(np.pi / 2 - gamma) if section == 0 else eta(beside)
    after = eta(beside) if section == 0 else 1.0  # the rope ends at the last hinge pulley
    expected = hinge * eta(np.pi - 2.0 * gamma) * after
    found = section_series(truss, "upper")["decay"].values[section]
    taut = np.isfinite(found) & np.isfinite(expected) & (truss["time"].values > 1.0)
    # Assemblies of an open arc lean by some mrad, as rigid rods let them: f / R times that.
    assert found[taut] == pytest.approx(expected[taut], rel=2e-4)
    assert np.count_nonzero(taut) > 300
    ends = round(float(found[taut].min()), 2), round(float(found[taut].max()), 2)
    assert ends == (least, most)
    assert f"{least:.2f} to {most:.2f}" in row(figure)


@pytest.mark.parametrize(
    ("time", "hinge", "block"), [(2.0, "0.30", "0.45"), (34.0, "0.010", "0.017")]
)
def test_figs_9_and_10_forces_on_the_second_section(
    truss: xr.Dataset, time: float, hinge: str, block: str
) -> None:
    """Vector sums of the tensions at the pulleys (eqs 29 and 30, see test_paper_forces.py)."""
    k, series = at(truss, time), section_series(truss, "upper")
    tension = truss["cable_tension"].sel(plane="upper").values[:, k]
    c, s = np.cos(fall(truss)[1, k]), np.sin(fall(truss)[1, k])
    # The short span leads on by half the plan's turn, out of the section's plane.
    pull = tension[4] * np.array([c, 0.0, -s])
    away = tension[3] * np.array([np.cos(0.5 * PLAN), np.sin(0.5 * PLAN), 0.0])
    first = float(np.linalg.norm(pull - away))
    second = float(np.hypot((tension[5] - tension[4]) * c, (tension[4] + tension[5]) * s))
    assert f"{hinge} N" in row("9, 10")
    assert f"{block} N" in row("9, 10")
    for found, stated in ((first, hinge), (second, block)):
        digits = len(stated.split(".")[1])
        assert found == pytest.approx(float(stated), abs=0.6 * 10.0**-digits)
    # The plan's turn is written with seven digits; the part along the bars is left out.
    assert float(series["hinge_force"][1, k]) == pytest.approx(first, rel=1e-6)
    assert float(series["block_force"][1, k]) == pytest.approx(second, rel=0.01)
