"""Errors, orders, frontier and advice of a made-up study whose answers are known."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
import xarray as xr
from loops import for_each

from ringsim.analysis.accuracy import NEEDED, Truth, bounds, in_words, judge, lines, tables
from ringsim.analysis.ladder import PATHS, Rung, by_frames, ladder, references
from ringsim.analysis.study import evidence_for, evidence_of, read_evidence
from ringsim.refusal import InputError
from ringsim.scene import builtin_scenes, load_scene

SCENE = load_scene("ring18")
RUNGS = ladder(SCENE)
BOTH = [*RUNGS, *by_frames(RUNGS)]
APART, CHEAPER = 2e-4, 10.0
"""How far the frame engine of the made-up study is off, and how much less it costs."""
TRUE_TIME, TRUE_STRESS = 10.0, 2e6


def errors_of(values: dict[str, object]) -> tuple[float, float]:
    """Relative errors in time and in space of a model of second order in both."""
    if values["solver.step_control"] == "constant":
        in_time = (float(values["solver.step"]) / 0.2) ** 2
    else:
        in_time = 10.0 * float(values["solver.tolerance"])
    return in_time, 1e-6 / float(values["rods.elements"]) ** 2


def made_up(rungs: list[Rung] = RUNGS) -> xr.Dataset:
    times = np.linspace(0.0, 12.0, 121)
    rows = []
    for number, rung in enumerate(rungs):
        scatter = 1.0 + 0.05 * (-1.0) ** number
        of_method = error = sum(errors_of(dict(rung.values)))
        if rung.fidelity == "frame":
            scatter, error = scatter / CHEAPER, of_method + APART
        angle = np.clip(90.0 + 9.0 * times * (1.0 + error), None, 180.0)
        known = times <= TRUE_TIME * (1.0 + error)
        rows.append(
            {
                "deployment_time": TRUE_TIME * (1.0 + error),
                "opening_angle": np.where(known, angle, np.nan)[None, None],
                "asynchrony": np.where(known, times * (1.0 + error), np.nan),
                "asynchrony_max": TRUE_TIME * (1.0 + error),
                "peak_rod_stress": TRUE_STRESS * (1.0 - error),
                "peak_latch_rate": 0.5 * (1.0 + error),
                "energy_error": error,
                "cpu_time": scatter * float(rung.values["rods.elements"]) / np.sqrt(of_method),
                "steps": 100.0 / np.sqrt(of_method),
                "jacobians": 100.0 / np.sqrt(of_method),
                "newton_iterations": 300.0 / np.sqrt(of_method),
                "status": 0,
                "outcome": 1,
                "final_time": 12.0,
            }
        )
    dims = {"opening_angle": ("plane", "section", "time"), "asynchrony": ("time",)}
    data = {
        name: (
            ("rung", *dims.get(name, ())),
            np.array([row.get(name, np.nan) for row in rows]),
        )
        for name in NEEDED
    }
    return xr.Dataset(data, coords={"time": times})


@pytest.fixture(scope="module")
def study() -> xr.Dataset:
    source = "a closed form"
    found = judge(made_up(), RUNGS, [Truth("deployment_time", source, TRUE_TIME * 1.01)])
    return found.assign_attrs(scene=SCENE.to_toml())


def test_the_extrapolated_reference_is_the_truth(study: xr.Dataset) -> None:
    """Both errors are of second order, so Richardson's extrapolation leaves nothing."""
    expected = [sum(errors_of(dict(rung.values))) for rung in RUNGS]
    for output in ("deployment_time", "peak_rod_stress", "peak_latch_rate"):
        np.testing.assert_allclose(study.error.sel(output=output), expected, rtol=1e-3, atol=1e-9)
    # Its uncertainty is the size of its correction: the errors of the finest steps and elements.
    in_time, in_space = references(RUNGS)
    finest = errors_of(dict(RUNGS[in_time[-1]].values))[0]
    finest += errors_of(dict(RUNGS[in_space[-1]].values))[1]
    own = float(study.uncertainty.sel(output="deployment_time"))
    assert own == pytest.approx(finest, rel=1e-2)


def test_orders(study: xr.Dataset) -> None:
    """Steps and elements show the order that they have."""
    order = study.order.sel(output="deployment_time")
    assert float(order.sel(graded="constant step")) == pytest.approx(2.0, abs=0.1)
    assert float(order.sel(graded="steps")) == pytest.approx(2.0, abs=0.1)
    assert np.isnan(order.sel(graded="formulation"))  # changes are below the errors of the steps


def test_cost_is_free_of_the_scatter_of_timings(study: xr.Dataset) -> None:
    own = [
        k
        for k, r in enumerate(RUNGS)
        if r.values["rods.kind"] != "ancf" and r.values["rods.elements"] == 1
    ]
    steps = study.steps.to_numpy()[own]
    measured = study.cpu_time.to_numpy()[own] / steps
    assert measured.max() / measured.min() > 1.05
    fitted = study.cost.to_numpy()[own] / steps
    assert fitted.max() / fitted.min() == pytest.approx(1.0)


def test_the_frontier_holds_every_setting_that_is_worth_its_cost(study: xr.Dataset) -> None:
    for output in ("deployment_time", "asynchrony", "motion"):
        best = study.frontier.sel(output=output).to_numpy()
        cost, error = study.cost.to_numpy(), study.bound.sel(output=output).to_numpy()
        for k in np.flatnonzero(~best & study.eligible.to_numpy()):
            assert ((cost <= cost[k]) & (error <= error[k])).sum() > 1
        assert best[np.argmin(cost)]


def test_an_error_that_is_small_by_chance_recommends_nothing() -> None:
    """One coarse setting hits the truth by chance: it is good for the errors of the finer ones."""
    results = made_up()
    lucky = next(k for k, rung in enumerate(RUNGS) if rung.label == "x 2")
    results.deployment_time[lucky] = TRUE_TIME
    found = judge(results, RUNGS, []).sel(output="deployment_time")
    assert float(found.error[lucky]) < 1e-6
    finer = next(k for k, rung in enumerate(RUNGS) if rung.label == "x 1")
    assert float(found.bound[lucky]) >= float(found.error[finer])


def test_what_changes_nothing_makes_no_setting_better() -> None:
    """Two settings with the same results, of which one solves each step more exactly: what a third
    one that is finer than the first alone tells holds for both, so that the scene's own is kept.
    """
    standing = next(r for r in RUNGS if r.ladder == "as it stands")
    exact = standing.values | {"solver.newton_tolerance": 1e-9}
    finer = standing.values | {"rods.elements": 2 * standing.values["rods.elements"]}
    rungs = [standing, *(replace(standing, values=each) for each in (exact, finer))]
    assert bounds(np.array([[1e-4], [1e-4], [2e-3]]), rungs, np.zeros(1)).tolist() == [[2e-3]] * 3
    found = bounds(np.array([[1e-4], [1.1e-4], [2e-3]]), rungs, np.zeros(1))
    assert found.ravel().tolist() == [2e-3, 1.1e-4, 2e-3]


def test_the_motion_leaves_asynchrony_to_itself(study: xr.Dataset) -> None:
    error = study.error
    largest = np.fmax(error.sel(output="deployment_time"), error.sel(output="opening_angle"))
    np.testing.assert_array_equal(error.sel(output="motion"), largest)


def test_a_failed_setting_is_never_recommended() -> None:
    results = made_up()
    cheapest = int(judge(results, RUNGS, []).cheapest.sel(target=1e-2, output="motion"))
    results.status[cheapest] = 2
    again = judge(results, RUNGS, [])
    assert int(again.cheapest.sel(target=1e-2, output="motion")) != cheapest
    assert np.isnan(again.error[cheapest]).all()


def test_a_failed_reference_is_refused() -> None:
    results = made_up()
    results.status[references(RUNGS)[0][0]] = 2
    with pytest.raises(ValueError, match="reference"):
        judge(results, RUNGS, [])


def test_the_distance_from_the_truth_is_not_an_error(study: xr.Dataset) -> None:
    assert float(study.reference_from_truth[0]) == pytest.approx(0.01 / 1.01, rel=0.05)


def test_tables_name_settings_as_overrides(study: xr.Dataset) -> None:
    text = tables(study, "A study")
    assert text.startswith("# A study")
    assert "| peak stress |" in text
    assert "closed form" in text
    assert "nan" not in text
    rung = next(k for k, r in enumerate(RUNGS) if r.label == "tolerance 0.001")
    assert in_words(study, rung) == "`--set solver.tolerance=0.001`"
    assert text.count("| newton: ") == 3  # two are in ladders before
    assert in_words(study, 0) == "as it stands"


def test_where_no_setting_is_good_enough_the_best_one_is_told(study: xr.Dataset) -> None:
    """Every error five times as large as it is, of a reference that is known as well as before."""
    worse = study.assign(bound=5.0 * study.bound, cheapest=0 * study.cheapest - 1)
    least = 5.0 * float(study.bound.sel(output="deployment_time")[study.eligible].min())
    (row,) = (line for line in tables(worse, "A study").splitlines()
              if line.startswith("| deployment time | ") and "none tried" in line)  # fmt: skip
    assert f"none tried: {least:.2g} at best" in row


def test_a_terminal_has_the_same_tables_without_marks_of_markdown(study: xr.Dataset) -> None:
    told, text = "\n".join(lines(study, "A study")), tables(study, "A study")
    assert told.startswith("A study\n\nThe cheapest setting for each error.")
    assert not {"|", "`", "**", "# "} & {each for each in ("|", "`", "**", "# ") if each in told}
    bold = re.findall(r"\*\*(.*?)\*\*", text)
    assert len(bold) > 3
    assert Counter(re.findall(r"(\S+) \*", told)) == Counter(bold) + Counter({"or": 1})
    assert "peak stress" in told
    assert "--set solver.tolerance=0.001" in told


def test_what_is_advised_fits_a_terminal_with_its_overrides_below(study: xr.Dataset) -> None:
    told = lines(study, "A study")
    start = next(k for k, line in enumerate(told) if line.startswith("error of"))
    advised = told[start : next(k for k, line in enumerate(told) if "Errors of all" in line)]
    assert max(map(len, advised)) <= 100
    named = {line[2]: line[5:] for line in advised if line.startswith("- ")}
    cells = {cell for line in advised for cell in re.findall(r"\b([A-Z]), [\d.]+ s", line)}
    assert cells == named.keys()
    for column in study.output:
        for rung in study.cheapest.sel(output=column).values:
            if rung >= 0 and (words := in_words(study, rung).replace("`", "")) != "as it stands":
                assert any(words.startswith(each.split(" --")[0]) for each in named.values()), words
    assert not [line for line in advised if line.rstrip().endswith("--set")]


def test_evidence_survives_its_file_and_picks_the_cheapest(study: xr.Dataset, tmp_path) -> None:
    evidence = evidence_of(study)
    file = tmp_path / "settings.toml"
    file.write_text(tomli_w.dumps(evidence.model_dump()))
    assert read_evidence(file) == evidence
    seconds = [s.seconds for s in evidence.settings]
    assert seconds == sorted(seconds)
    picked = evidence.pick(0.01)
    assert picked.errors["motion"] <= 0.01
    assert all(s.errors["motion"] > 0.01 for s in evidence.settings if s.seconds < picked.seconds)
    values = evidence.values_for(picked, SCENE)
    assert SCENE.with_values(values).solver.tolerance == picked.values["solver.tolerance"]
    other = SCENE.with_values({"rods.elements": 3, "solver.end_time": 0.1, "solver.step": 0.1})
    kept = evidence.values_for(picked, other)
    assert (kept["rods.elements"], kept["solver.step"]) == (3, 0.1)
    with pytest.raises(InputError, match="best setting"):
        evidence.pick(1e-8)
    good = tomli_w.dumps(evidence.model_dump())
    wrong = (
        "settings = 3", good.replace("motion = ", "motion = 'a' #"), good[:40], "",
        good.replace('"solver.step"', '"solver.stop"'),
    )  # fmt: skip
    for text in wrong:
        file.write_text(text)
        with pytest.raises(InputError, match="not the settings"):
            read_evidence(file)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"cannot be read|not a text file"):
        read_evidence(file)
    best = min(setting.errors["motion"] for setting in evidence.settings)
    with pytest.raises(InputError) as told:
        evidence.pick(0.5 * best)
    # What the refusal says to ask for is given.
    evidence.pick(float(str(told.value).partition("an error of ")[2].split()[0]))
    with pytest.raises(InputError, match=r"not measured with .*: choose from motion, loads"):
        evidence.pick(0.1, "peak_tension")
    with pytest.raises(InputError, match="cables = False"):
        evidence.require_like(load_scene("ring18-cable"))


@for_each("name", builtin_scenes())
def test_every_rung_of_every_scene_is_a_scene(name: str) -> None:
    scene = load_scene(name)
    rungs = ladder(scene)
    assert len({(rung.ladder, rung.label) for rung in rungs}) == len(rungs)
    for rung in rungs:
        assert set(rung.values) == set(PATHS)
        scene.with_values(dict(rung.values))
    # Nothing was measured with these: they are judged by a ring that is driven alike.
    of = dict.fromkeys(("ring18-flight", "ring18-ground", "ring18-motor"), "ring18-cable")
    of["ring18-stow"] = "ring18"
    assert evidence_for(scene).scene == of.get(name, name)


@pytest.fixture(scope="module")
def engines() -> xr.Dataset:
    return judge(made_up(BOTH), BOTH, []).assign_attrs(scene=SCENE.to_toml())


def test_the_full_engine_is_judged_as_without_the_other(
    study: xr.Dataset, engines: xr.Dataset
) -> None:
    full = engines.isel(rung=slice(len(RUNGS)), graded=slice(study.sizes["graded"]))
    for name in ("error", "bound", "uncertainty", "reference", "order", "cost"):
        np.testing.assert_array_equal(full[name], study[name])


def test_how_far_engines_differ_is_told_beside_what_is_uncertain(engines: xr.Dataset) -> None:
    for output in ("deployment_time", "peak_rod_stress", "asynchrony", "loads"):
        differ = float(engines.engines_differ.sel(output=output))
        assert differ == pytest.approx(APART, rel=1e-2)
        stated = (
            engines.uncertainty.sel(output=output),
            engines.frame_uncertainty.sel(output=output),
        )
        assert differ > float(sum(stated))
    assert float(engines.order.sel(graded="frame, steps", output="deployment_time")) == (
        pytest.approx(2.0, abs=0.1)
    )
    text = tables(engines, "A study")
    assert "| deployment time | **2.0e-04** |" in text
    assert "| frame, steps: x 1/16 |" in text
    assert "engines_differ" not in judge(made_up(), RUNGS, [])


def test_one_frontier_has_both_engines(engines: xr.Dataset) -> None:
    """The cheap engine where its distance from the other is small enough, else the full one."""
    of = engines.sel(output="deployment_time")
    engine = {t: of.fidelity.values[int(of.cheapest.sel(target=t))] for t in of.target.values}
    assert engine == {1e-2: "frame", 1e-3: "frame", 1e-4: "full"}
    assert set(of.fidelity.values[of.frontier.values]) == {"full", "frame"}
    picked = int(of.cheapest.sel(target=1e-2))
    assert in_words(engines, picked).startswith("`--fidelity frame`")


def test_an_engine_proves_nothing_about_the_other(engines: xr.Dataset) -> None:
    """Coarse steps of one engine are not judged by fine ones of the other."""
    of, differ = engines.sel(output="deployment_time"), 0.99 * APART
    frame = of.fidelity == "frame"
    assert float(of.bound.where(frame).min()) > differ > float(of.bound.where(~frame).min())


def test_evidence_has_settings_of_both_engines(engines: xr.Dataset) -> None:
    evidence = evidence_of(engines)
    assert [evidence.pick(e).fidelity for e in (1e-2, 1e-4)] == ["frame", "full"]
    kept = evidence.pick(1e-2, fidelity="full")
    assert kept.fidelity == "full"
    assert kept == evidence_of(judge(made_up(), RUNGS, []).assign_attrs(engines.attrs)).pick(1e-2)
    with pytest.raises(InputError, match="best setting"):
        evidence.pick(1e-4, fidelity="frame")


def test_evidence_of_old_is_of_the_full_engine(engines: xr.Dataset, tmp_path) -> None:
    file, old = tmp_path / "settings.toml", evidence_of(engines).model_dump()
    for setting in old["settings"]:
        del setting["fidelity"]
    file.write_text(tomli_w.dumps(old))
    assert {setting.fidelity for setting in read_evidence(file).settings} == {"full"}
    with pytest.raises(InputError, match="no settings were measured for this fidelity with ring18"):
        read_evidence(file).pick(1e-2, fidelity="frame")


def test_a_frame_engine_without_a_limit_is_judged_all_the_same() -> None:
    results = made_up(BOTH)
    finest = next(k for k, r in enumerate(BOTH) if (r.fidelity, r.label) == ("frame", "x 1/4"))
    results.status[finest] = 2
    found = judge(results, BOTH, [])
    assert "engines_differ" not in found
    assert np.isfinite(found.error.sel(output="motion")[finest + 1])
