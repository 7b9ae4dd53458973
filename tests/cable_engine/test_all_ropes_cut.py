"""A model none of whose ropes is whole: its Jacobian has an answer, and nothing is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ringsim.exudyn.cables import CableDrive
from ringsim.scene import load_scene
from ringsim.simulation import simulate


def test_a_cut_only_cable_is_no_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    told: set[str] = set()
    jacobian = CableDrive.jacobian

    def noting(self: CableDrive, *given: object) -> object:
        self.refusal = ""
        matrix = jacobian(self, *given)
        told.add(self.refusal)
        return matrix

    monkeypatch.setattr(CableDrive, "jacobian", noting)
    cut = {"kind": "cut-cable", "cable": "upper", "span": 1, "time": 0.2}
    values = {"cables.lower": "none", "solver.end_time": 0.6, "faults": [cut]}
    run = simulate(load_scene("truss2").with_values(values), fidelity="full")
    assert told == {""}, told
    tension = run.cable_tension.sel(plane="upper", time=run.time > 0.25).dropna("time")
    assert tension.sizes["time"] > 0
    assert float(np.abs(tension).max()) == 0.0
