"""The cables' figure for winches and brackets of every kind: what it draws is what was recorded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from ringsim.plots.rods_and_cables import cables, pulleys, section_series, section_spans
from ringsim.scene import load_scene
from ringsim.simulation import simulate

HALF = {"kind": "bar-half", "angle": 110.0}


def ran(**values: Any) -> xr.Dataset:
    """A truss of three sections for half a second, its upper cable changed."""
    ramp = {"kind": "ramp", "speed": 0.05, "duration": 0.5}
    fields = {
        "structure.sections": 3,
        "structure.opening_angle": 60.0,
        "cables.upper.winch.winding": ramp,
        "cables.lower.winch.winding": ramp,
        "joints.vjoint.viscous": 0.5,
        "solver.end_time": 0.5,
        "record.interval": 0.1,
    }
    upper = {f"cables.upper.{name}": value for name, value in values.items()}
    return simulate(load_scene("truss2").with_values(fields | upper))


@pytest.mark.parametrize("values", [
    {"end": "both"}, {"end": "last", "bracket": HALF},
    *(pytest.param(each, marks=pytest.mark.slow) for each in ({"end": "last"}, {"bracket": HALF})),
], ids=str)  # fmt: skip
def test_series_belong_to_their_spans(values: dict[str, Any]) -> None:
    run = ran(**values)
    for plane, spans in (("upper", 10 if values.get("end") == "both" else 9), ("lower", 9)):
        series = section_series(run, plane)
        tension = run["cable_tension"].sel(plane=plane).dropna("span", how="all").values
        assert len(tension) == spans
        taut = int(np.argmax(tension.min(axis=0)))
        assert np.isfinite(tension[:, taut]).all()
        assert tension[:, taut].min() > 0.1
        # Three decay factors lead from the first span to the last.
        whole = tension[-1, taut] / tension[0, taut]
        assert float(series["decay"][:, taut].prod()) == pytest.approx(whole, rel=1e-12)
        if "bracket" in values and plane == "upper":
            # The half towards the first corner keeps its span; the last winch sees it behind.
            lengths = section_spans(run, plane).lengths[0][:, [0, -1]]
            assert (np.ptp(lengths, axis=1) < 1e-12).all() == ("end" not in values)
    assert cables(run).axes


def test_curves_that_lie_on_each_other_are_both_seen() -> None:
    """Hinge pulleys of a section pass on alike: the lower curve is broad, the upper one dashed."""
    run = ran()
    for axes in pulleys(run.assign(pulley_ratio=0.0 * run["pulley_ratio"] + 0.9)).axes:
        first, vertex, *second = axes.lines[:3]
        assert first.get_linewidth() > 2.0 * vertex.get_linewidth()
        for line in second:
            assert line.get_linestyle() == "--"
            assert line.get_linewidth() < vertex.get_linewidth()


def test_ratios_above_one_stay_within_their_panels() -> None:
    """Rope runs away from the winch where a section behind it locks first."""
    run = ran()
    ratio = 0.0 * run["pulley_ratio"] + 0.9
    for most in (1.012, 0.9):
        figure = pulleys(run.assign(pulley_ratio=ratio.where(run["time"] > run["time"][2], most)))
        low, high = figure.axes[0].get_ylim()
        assert low < 0.9
        assert high > max(most, 1.0)
