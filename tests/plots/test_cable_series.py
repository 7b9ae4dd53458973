"""The cables' figure for winches and brackets of every kind: what it draws is what was recorded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from ringsim.plots.rods_and_cables import cables, section_series, section_spans
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
    {"end": "both"}, {"end": "last"}, {"bracket": HALF}, {"end": "last", "bracket": HALF},
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
