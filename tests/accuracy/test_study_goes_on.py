"""Studies whose runs fail, and scenes at the bounds of their settings, with a made-up model."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from loops import for_each

from ringsim.analysis.accuracy import NEEDED, tables
from ringsim.analysis.engines import limit
from ringsim.analysis.ladder import GRADED, ladder, left_out, references
from ringsim.campaign import studies
from ringsim.campaign.studies import ReferenceRunError, run_ladder
from ringsim.refusal import InputError
from ringsim.scene import Scene, builtin_scenes, load_scene
from ringsim.variables import Status

SCENE = load_scene("ring18-cable").with_values({"structure.sections": 4})
TRUE_TIME = 10.0


def model(scene: Scene) -> float:
    """Deployment time with an error of second order in steps and elements."""
    solver = scene.solver
    steps = solver.tolerance if solver.step_control == "motion" else (solver.step / 20.0) ** 2
    return TRUE_TIME * (1.0 + steps + 1e-3 / scene.rods.elements**2)


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Runs a study of the made-up model, in which some settings fail."""

    def study(failing: list[Mapping[str, Any]], most: int = 4, **how: Any) -> xr.Dataset:
        def run_cases(folder, name, scene, cases, *, fidelity, **_):
            assert ("frame" in name) == (fidelity == "frame")
            rows = []
            for case in cases:
                exact, bad = scene.with_values(dict(case)), [f for f in failing if f == dict(case)]
                good = dict.fromkeys(NEEDED, 1.0) | {
                    "deployment_time": model(exact), "final_time": 12.0, "status": 0, "outcome": 1,
                    "cpu_time": 1.0 / exact.solver.tolerance, "reason": "fine",
                }  # fmt: skip
                missing = dict.fromkeys(NEEDED, np.nan)
                late = missing | {
                    "status": int(Status.TIMEOUT),
                    "outcome": -1,
                    "reason": "took too long",
                }
                rows.append(late if bad else good)
            names = ["deployment_time", "reason", *set(NEEDED) - {"opening_angle", "asynchrony"}]
            found = xr.Dataset({n: ("sample", [row[n] for row in rows]) for n in names})
            found.assign_coords(sample=range(len(rows))).to_netcdf(tmp_path / f"{name}.nc")
            return tmp_path / f"{name}.nc"

        monkeypatch.setattr(studies, "run_cases", run_cases)
        return run_ladder(tmp_path, SCENE, 1, 60.0, most, **how)

    return study


def rung(name: str, label: str, most: int = 4) -> Mapping[str, Any]:
    return next(r.values for r in ladder(SCENE, most) if (r.ladder, r.label) == (name, label))


def error(found: xr.Dataset) -> float:
    return abs(float(found.reference.sel(output="deployment_time")) / TRUE_TIME - 1.0)


def test_all_references_give_the_truth(study):
    found = study([])
    assert error(found) < 1e-8
    assert found.attrs["remarks"] == ""


def test_one_failed_reference_costs_certainty_only(study):
    """The study goes on with the others, says so, and its uncertainty covers its error."""
    whole = study([]).uncertainty.sel(output="deployment_time")
    for failing in (("steps", "x 1/16"), ("elements", "2"), ("elements", "4")):
        found = study([rung(*failing)])
        own = found.uncertainty.sel(output="deployment_time")
        assert own > whole, failing
        assert error(found) <= float(own), failing
        remarks = found.attrs["remarks"]
        told = "ended as timeout: took too long; other runs form the reference"
        assert told in remarks, failing
        assert remarks in tables(found, "A study"), failing


@pytest.mark.parametrize(
    "failing",
    [
        [("steps", "x 1/4")],
        [("steps", "x 1/8")],  # the elements' coarsest level as well
        [("elements", "2"), ("elements", "4")],
        [("steps", "x 1/16"), ("steps", "x 1/2")],
    ],
)
def test_too_few_references_end_a_study(failing, study):
    with pytest.raises(ReferenceRunError, match=r"ended as timeout.*more time \(--timeout\)"):
        study([rung(*each) for each in failing])


def test_eight_elements_make_a_better_reference(study):
    coarse, fine = study([rung("elements", "2")]), study([rung("elements", "2", 8)], most=8)
    assert error(fine) < error(coarse)
    assert "8 elements" in " ".join(fine.label.values)


def test_studies_with_eight_elements_go_on_from_others():
    """Their rungs are those of the study before in the same order, and a few behind."""
    four, eight = ladder(SCENE), ladder(SCENE, 8)
    assert [r for r in eight if r.values["rods.elements"] != 8] == four
    new = [r for r in eight if r not in four]
    assert [r.label for r in new[1:]] == [r.label for r in eight[-2:]]
    assert references(eight)[1][:-1] == references(four)[1]


def test_a_brief_study_is_less_certain_with_fewer_and_coarser_runs(study):
    whole, found = study([]), study([], brief=True)
    assert set(found.ladder.values) == {"as it stands", "steps", "elements", "setting"}
    assert found.sizes["rung"] < 0.6 * whole.sizes["rung"]
    assert float(found["solver_tolerance"].min()) == SCENE.solver.tolerance / 16.0
    own, of_whole = (float(each.uncertainty.sel(output="motion")) for each in (found, whole))
    assert error(found) <= own
    assert own > of_whole


def test_frames_alone_are_their_own_reference(study):
    found = study([], fidelity="frame")
    assert set(found.fidelity.values) == {"frame"}
    assert error(found) < 1e-8
    assert "the reference is the limit of its own fine steps" in tables(found, "A study")
    with pytest.raises(ReferenceRunError, match="more time"):
        study([rung("steps", "x 1/4")], fidelity="frame")


def test_both_engines_run_the_same_steps_and_elements(study):
    found = study([])
    label = {
        engine: set(found.label.values[(found.fidelity == engine) & found.ladder.isin(GRADED)])
        for engine in ("full", "frame")
    }
    assert label["full"] == label["frame"]
    assert float(found.engines_differ.sel(output="deployment_time")) == 0.0


def test_two_levels_are_not_extrapolated():
    assert limit(xr.DataArray([1.0, 0.75], dims="rung")) == (0.75, 0.25)


@for_each("name", builtin_scenes())
def test_nothing_is_left_out_of_a_builtin_scene(name):
    assert left_out(load_scene(name)) == []


def test_steps_at_a_bound_are_no_halvings():
    """Every rung of "steps" has the tolerance that its factor says."""
    scene = load_scene("ring18").with_values({"solver.tolerance": 1e-6})
    rungs = ladder(scene)
    for each in (r for r in rungs if r.ladder == "steps"):
        assert each.values["solver.tolerance"] == pytest.approx(1e-6 * each.size**2)
    assert [rungs[k].label for k in references(rungs)[0]] == ["x 1/2", "x 1/4", "x 1/8"]
    (told,) = left_out(scene)
    assert told.startswith("steps x 1/16 are left out: solver.tolerance would be at its bound")
    assert len({(rung.ladder, rung.label) for rung in rungs}) == len(rungs)


def test_a_coarse_scene_has_no_setting_twice():
    rungs = ladder(load_scene("ring18").with_values({"solver.tolerance": 0.05}))
    assert len({(rung.ladder, rung.label) for rung in rungs}) == len(rungs)
    assert "x 2" not in {rung.label for rung in rungs if rung.ladder == "steps"}


def test_a_scene_that_cannot_be_refined_is_refused(study):
    scene = load_scene("ring18").with_values({"solver.tolerance": 1e-7})
    with pytest.raises(InputError) as told:
        left_out(scene)
    assert str(told.value) == (
        "solver.tolerance = 1e-07: a study refines it to 0.0156 of that, and it must be at least "
        "1e-08: study the scene with 6.4e-07 or more"
    )


def test_reports_begin_anew_with_another_engine(tmp_path, monkeypatch):
    file = Path(__file__).parents[2] / "benchmarks" / "accuracy_reports.py"
    monkeypatch.syspath_prepend(file.parent)
    spec = importlib.util.spec_from_file_location("accuracy_reports", file)
    reports = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(reports)
    folder = reports.fresh(tmp_path / "study")
    (folder / "result").write_text("old")
    assert reports.fresh(folder).joinpath("result").exists()
    monkeypatch.setattr(reports, "version", lambda _: "another")
    assert not reports.fresh(folder).joinpath("result").exists()
