"""What docs/theory/truss2.md says of paper 000's figs 4, 6, 7, 9 and 10, computed anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from ringsim.plots.rods_and_cables import pulley_forces, section_series
from ringsim.scene import load_scene
from ringsim.simulation import simulate

Array = NDArray[np.float64]
PAGE = Path(__file__).parents[2] / "docs" / "theory" / "truss2.md"
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


def test_fig_4_neutral_lengths(truss: xr.Dataset) -> None:
    """A rope along four spans of one length gives what was wound, slack or taut: no geometry is
    needed; where it is taut, eq. 22 makes lengths of these.
    """
    opening = np.radians(truss["opening_angle"].sel(plane="upper").values)
    length = np.sqrt(HALF**2 + OFFSET**2 + 2.0 * HALF * OFFSET * np.cos(0.5 * opening))
    neutral = section_series(truss, "upper")["neutral_length"].values
    last = int(np.flatnonzero(np.isfinite(length[0]))[-1])
    begin, end = neutral[:, 0].mean(), neutral[:, at(truss, 34.0)].mean()
    assert (round(begin, 3), round(end, 3)) == (0.393, 0.308)
    assert "0.393 m to 0.308 m" in row("4")
    wound = truss["wound_length"].sel(plane="upper").values
    taken = (neutral[:, :1] - neutral[:, : last + 1]).mean(axis=0)
    # Of 0.31 m of path that keeps its length a slack rope has 0.31 / 1.88 of its slack of 5 mm; the
    # rest is what the geometry of flexible sections leaves out.
    assert taken == pytest.approx(0.25 * wound[: last + 1], abs=3e-4)
    loose = truss["rope_strain"].sel(plane="upper").values[: last + 1] < 0.0
    assert loose.any()
    assert (neutral > length)[:, : last + 1][:, loose].all()
    tension = truss["cable_tension"].sel(plane="upper").values[[1, 4], : last + 1]
    taut = neutral[:, : last + 1] * (1.0 + tension / 1e5)
    assert taut[:, ~loose] == pytest.approx(length[:, : last + 1][:, ~loose], rel=1e-9)


def eta(angle: Array) -> Array:
    """Eq. 19."""
    return np.asarray((1.0 - RATIO * np.cos(0.5 * angle)) / (1.0 + RATIO * np.cos(0.5 * angle)))


@pytest.mark.parametrize(("figure", "section", "least", "most", "pulleys"), [
    ("6", 0, 0.81, 0.90, ("0.924 to 0.936", "0.925 to 0.973", "0.952 to 0.984")),
    ("7", 1, 0.88, 0.96, ("0.952 to 0.984", "0.925 to 0.973")),
])  # fmt: skip
def test_figs_6_and_7_decay_factors(
    truss: xr.Dataset, figure: str, section: int, least: float, most: float, pulleys: tuple[str]
) -> None:
    """Eqs 19 and 20 at the angles of the run; the plan's turn adds to the hinge pulleys'."""
    gamma = fall(truss)[section]
    beside = np.pi - np.arccos(np.cos(0.5 * PLAN) * np.cos(gamma))
    hinge = eta(np.pi / 2 - gamma) if section == 0 else eta(beside)
    after = eta(beside) if section == 0 else 1.0  # the rope ends at the last hinge pulley
    factors = [hinge, eta(np.pi - 2.0 * gamma), after][: len(pulleys)]
    expected = np.prod(factors, axis=0)
    found = section_series(truss, "upper")["decay"].values[section]
    taut = np.isfinite(found) & np.isfinite(expected) & (truss["time"].values > 1.0)
    # Assemblies of an open arc lean by some mrad, as rigid rods let them: f / R times that.
    assert found[taut] == pytest.approx(expected[taut], rel=2e-4)
    assert np.count_nonzero(taut) > 300
    ends = round(float(found[taut].min()), 2), round(float(found[taut].max()), 2)
    assert ends == (least, most)
    assert f"{least:.2f} to {most:.2f}" in row(figure)
    each = truss["pulley_ratio"].sel(plane="upper").values[3 * section :]
    for ratio, factor, words in zip(each, factors, pulleys, strict=False):
        assert ratio[taut] == pytest.approx(factor[taut], rel=2e-4)
        assert f"{ratio[taut].min():.3f} to {ratio[taut].max():.3f}" == words
        assert words in row(figure)


@pytest.mark.parametrize(
    ("time", "hinge", "block"), [(2.0, "0.30", "0.45"), (34.0, "0.010", "0.017")]
)
def test_figs_9_and_10_forces_on_the_second_section(
    truss: xr.Dataset, time: float, hinge: str, block: str
) -> None:
    """Vector sums of the tensions at the pulleys (eqs 29 and 30, see test_paper_forces.py)."""
    k, forces = at(truss, time), pulley_forces(truss, "upper").sel(section=1)
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
    # The plan turns to the left: the pull back has a part to that side.  Its turn is written with
    # seven digits.
    vectors = {
        "first hinge": [tension[4] * c - away[0], tension[4] * s, -away[1]],
        "V": [(tension[5] - tension[4]) * c, -(tension[4] + tension[5]) * s, 0.0],
    }
    for node, vector in vectors.items():
        assert forces.sel(node=node)[:, k].values == pytest.approx(vector, rel=1e-6, abs=1e-12)
