"""Numbers of published.md and measured_angles.md in docs/evidence that scripts of docs compute."""

from __future__ import annotations

import re
from typing import Any

import pytest
import xarray as xr

import ringsim
from pages import ROOT
from ringsim.files import parse_toml
from ringsim.scene import scene_from_toml

PUBLISHED = (ROOT / "docs" / "evidence" / "published.md").read_text(encoding="utf-8")
ANGLES = (ROOT / "docs" / "evidence" / "measured_angles.md").read_text(encoding="utf-8")


def load_case(campaign: str, force: float) -> xr.Dataset:
    """A sample of a shipped campaign of paper 002."""
    path = ROOT / "campaigns" / f"{campaign}.toml"
    table: dict[str, Any] = parse_toml(path.read_text(encoding="utf-8"), path.name)
    assert force in table["inputs"]["loads.force"]["values"]
    scene = ringsim.load_scene(table["scene"]).with_values(table["set"] | {"loads.force": force})
    return ringsim.simulate(scene, table.get("fidelity", "full"))


@pytest.mark.parametrize(
    ("campaign", "columns", "force"),
    [
        ("paper_002", (0, 2), 0.015),
        pytest.param("paper_002", (0, 2), 0.020, marks=pytest.mark.slow),
        pytest.param("paper_002", (0, 2), 0.030, marks=pytest.mark.slow),
        *(
            pytest.param("paper_002_ancf", (1, 3), force, marks=pytest.mark.slow)
            for force in (0.015, 0.020, 0.030)
        ),
    ],
)
def test_stress_of_the_diagonals(
    monkeypatch: pytest.MonkeyPatch, campaign: str, columns: tuple[int, int], force: float
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from paper_pictures import diagonals

    run = load_case(campaign, force)
    for section in (1, 9):
        row = next(
            line for line in PUBLISHED.splitlines()
            if line.startswith(f"| {force:.3f} N | {section} |")
        )  # fmt: skip
        stated = [float(number) for number in re.findall(r"([\d.]+) [kM]Pa", row)]
        found = diagonals(run, section)
        assert 1e-3 * found.before == pytest.approx(stated[columns[0]], rel=3e-3)
        # Impacts at the locks: what round-off leaves of them on another machine.
        assert 1e-6 * found.all == pytest.approx(stated[columns[1]], rel=2e-2)
        assert f"{0.1 * round(10 * stated[0]):.1f} kPa" in row


@pytest.mark.parametrize("name", ["truss2", pytest.param("ring18-cable", marks=pytest.mark.slow)])
def test_forces_from_measured_angles(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from measured_angles import PARTS, compared, drawn, row

    run = ringsim.simulate(
        ringsim.load_scene(name).with_values({"record.positions": True}), "frame"
    )
    found = compared(run)
    for part in PARTS:
        own = row(name, part, found)
        begins = own[: own.index(" | ")]
        told = next(line for line in ANGLES.splitlines() if line.startswith(begins))
        numbers, stated = (
            [float(each) for each in re.findall(r"\d[\d.]*(?:e-\d+)?", line[len(begins) :])]
            for line in (own, told)
        )
        assert numbers == pytest.approx(stated, rel=0.15)
    # EA times the error of the strain, over the spans' mean share of the tension at the winch,
    # which is below 1 and above the share of the last span, the product of all decays.
    scene = scene_from_toml(str(run.attrs["scene"]), source=name)
    rope = drawn(scene).sum() - run["wound_length"].sel(plane="upper").values[: len(found.times)]
    late = (found.times > 2.0) & (found.times < 0.99 * found.times[-1])
    ratio = ((found.alone - found.tension) / (found.path / rope))[late]
    last = run["pulley_ratio"].sel(plane="upper").prod("pulley").values[: len(late)][late]
    assert (ratio > 1e5).all()
    assert (ratio < 1e5 / last).all()
