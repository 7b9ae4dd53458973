"""Optimisations from file to front: small rings, kills, workers, and refusals."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
import scipy
import xarray as xr
from click.testing import CliRunner

import ringsim
from ringsim.analysis import derived
from ringsim.analysis.front import front_tables
from ringsim.analysis.optimum import SEARCH, Wanted
from ringsim.campaign import optimisation
from ringsim.campaign.optimisation import FRONT, fresh_verdict, optimisation_of
from ringsim.cli import cli
from ringsim.overrides import with_number
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import simulate

FILE = """
name = "quick"
title = "Three sections, fast enough"
seed = 4
scene = "ring18-cable"
fidelity = "frame"
designs = 10
samples = 4
check = 16
verdict = 24

[set]
"structure.sections" = 3
"structure.opening_angle" = 150.0
boom = "none"
"solver.end_time" = 3.0
"solver.settling_time" = 0.0
"record.interval" = 0.1
"cables.upper.winch.winding.speed" = 0.16
"cables.lower.winch.winding.speed" = 0.16

[variables.speed]
low = 0.08
high = 0.2
shared = ["cables.upper.winch.winding.speed", "cables.lower.winch.winding.speed"]

[objectives]
peak_tension = { minimise = "mean" }

[constraints]
deployment_time = { max = 1.6, probability = 0.9, confidence = 0.9 }

[inputs.friction]
kind = "lognormal"
mean = 6e-4
standard_deviation = 1e-4
shared = ["cables.upper.friction.coefficient", "cables.lower.friction.coefficient"]
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("file") / "quick.toml"
    path.write_text(FILE)
    return path


@pytest.fixture(scope="module")
def found(file):
    """The front, in this process."""
    out = file.parent / "out"
    return ringsim.Optimisation.read(file).run(workers=0, out=out), out


def own_scene(speed, friction):
    table = tomllib.loads(FILE)
    both = [f"cables.{plane}" for plane in ("upper", "lower")]
    return load_scene(table["scene"]).with_values(
        table["set"] | {f"{each}.winch.winding.speed": speed for each in both}
        | {f"{each}.friction.coefficient": friction for each in both}
    )  # fmt: skip


def test_slowest_speed_that_is_fast_enough_is_found(found):
    """The tension falls with the speed and the time rises: the best speed is at the bound on time,
    which hardly depends on friction, and which bisection finds."""
    front, _ = found
    assert front["design"].values.tolist() == ["present", "design-1"]
    low, high = 0.08, 0.2
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        time_ = float(simulate(own_scene(middle, 6e-4), "frame")["deployment_time"])
        low, high = (low, middle) if time_ <= 1.6 else (middle, high)
    assert float(front["value"].sel(design="design-1")[0]) == pytest.approx(high, rel=0.03)
    assert front["verdict"].sel(design="design-1").item() == 2
    assert float(front["value"].sel(design="present")[0]) == 0.16


def test_cost_is_told_before_anything_runs(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = tomllib.loads(FILE)
    told = CliRunner().invoke(
        cli, ["optimise", str(file), "--dry-run", "--workers", "2", "--set", "verdict=30"]
    )
    assert told.exit_code == 0
    assert not list(tmp_path.iterdir())
    least = (table["designs"] + 1) * table["samples"] + 3 * table["check"] + 2 * 30
    sums = (f"{table['designs']} designs searched x {table['samples']} + 1 with one value as at "
            f"present x {table['samples']} + 3 checks x {table['check']} + "
            "2 verdicts x 30")  # fmt: skip
    assert f"about {least} runs ({sums}), " in told.stdout
    assert "predicted      about" in told.stdout
    assert "full engine" not in told.stdout
    checked = file.parent / "checked.toml"
    short = FILE.replace('end_time" = 3.0', 'end_time" = 0.3')  # of which one is tried
    checked.write_text(short.replace("[set]", "check_every = 10\n[set]", 1))
    told = CliRunner().invoke(cli, ["optimise", str(checked), "--dry-run"])
    assert "checks         6 with the full engine" in told.stdout  # 0, 10, 20 of both designs


def test_numbers_of_the_front_are_those_of_its_campaigns(found):
    front, out = found
    for name in front["design"].values:
        campaign = ringsim.open_campaign(out / str(name))
        one = front.sel(design=name)
        assert campaign.sizes["sample"] == 24
        opened = campaign.where(campaign["outcome"] == 1)  # others have not done what they should
        assert int(one["short"]) == 24 - int((campaign["outcome"] == 1).sum())
        mean = float(opened["peak_tension"].mean())
        np.testing.assert_allclose(one["objective_value"][0], mean)
        kept = float((campaign["deployment_time"] <= 1.6).mean())
        assert float(one["probability"][0]) == pytest.approx(kept)
        speed = float(one["value"][0])
        scene = ringsim.load_scene(out / f"{name}.toml") if name != "present" else None
        if scene is not None:
            assert scene.cables.lower.winch.winding.speed == speed
    assert front["short"].values.tolist() == [0, 0]
    second = ringsim.open_campaign(sorted((out / "designs").glob("*-search"))[1])
    mean = float(second["peak_tension"].mean())
    np.testing.assert_allclose(front["tried_objective"][1, 0], mean)
    seeds = [ringsim.open_campaign(out / name)["sample_seed"].values.tolist()
             for name in ("designs/001-search", "present")]  # fmt: skip
    assert not set(seeds[0]) & set(seeds[1])
    # All designs have the same samples.
    assert second["sample_seed"].values.tolist() == seeds[0]


def test_intervals_and_verdicts_are_those_of_an_analysis_of_the_fresh_samples(found):
    front, out = found
    for name in front["design"].values:
        one = front.sel(design=name)
        told = ringsim.analyse(ringsim.open_campaign(out / str(name)))
        wanted = told.sel(requirement="deployment_time")
        for key in ("probability", "probability_lower", "verdict"):
            assert float(one[key][0]) == pytest.approx(float(wanted[key])), key
        known = ringsim.open_campaign(out / str(name))["peak_tension"].values
        low, high = float(one["objective_lower"][0]), float(one["objective_upper"][0])
        # Of a mean: about two standard errors on either side.
        error = known.std(ddof=1) / np.sqrt(len(known))
        assert low < known.mean() < high
        assert high - low == pytest.approx(2.0 * 2.07 * error, rel=0.25)


def test_what_a_variable_buys_is_in_the_designs_that_were_tried_and_their_checks(found):
    """The one variable at its present value is the present design: its few samples, and the shift
    between both kinds of samples of the chosen design, by hand."""
    front, out = found
    place = dict(zip(front["design"].values, front["place"].values.tolist(), strict=True))
    assert place["present"] == 0
    few, many, present = (
        [ringsim.open_campaign(folder)["peak_tension"].values.mean() for folder in folders]
        for folders in (sorted((out / "designs").glob("*-search")),
                        sorted((out / "designs").glob("*-check")), [out / "present"])
    )  # fmt: skip
    one = front.sel(design="design-1")
    assert few[place["design-1"]] == pytest.approx(float(one["searched"][0]))
    shift = float(one["check_objective"][0]) - few[place["design-1"]]
    assert shift == pytest.approx(float(one["shift_objective"][0]))
    assert any(float(one["check_objective"][0]) == pytest.approx(each) for each in many)
    assert float(one["without"][0, 0]) == pytest.approx(few[0] + shift)
    far = float(front["searched_beyond"][0, 0] + one["shift"][0])
    assert float(one["without_beyond"][0, 0]) == pytest.approx(far)
    assert float(one["check_beyond"][0]) == pytest.approx(
        float(one["searched_beyond"][0] + one["shift"][0])
    )
    assert present[0] == pytest.approx(float(front["objective_value"][0, 0]))
    assert not front["tried_lost"].values.any()


def test_gain_is_that_of_pairs_of_equal_samples(found):
    front, out = found
    first, second = (ringsim.open_campaign(out / name) for name in ("present", "design-1"))
    assert first["sample_seed"].values.tolist() == second["sample_seed"].values.tolist()
    apart = first["peak_tension"].values - second["peak_tension"].values
    low, high = (float(front[f"gain_{end}"][1, 0]) for end in ("lower", "upper"))
    assert float(front["gain"][1, 0]) == pytest.approx(apart.mean())
    assert low < apart.mean() < high
    assert high - low == pytest.approx(2.0 * 1.96 * apart.std() / 24**0.5, rel=0.2)
    assert float(front["gain"][0, 0]) == 0.0


def test_a_probability_is_the_share_of_the_fresh_samples_beyond(found, file):
    _, out = found
    known = ringsim.open_campaign(out / "present")["peak_tension"].values
    middle = float(np.median(known)) + 1e-9
    change = 'minimise = "probability", max = ' + repr(middle)
    given = optimisation_of(FILE.replace('minimise = "mean"', change), file)
    told = fresh_verdict(given, out / "present")
    assert told["objective_value"].tolist() == [0.5]
    low, high = scipy.stats.binomtest(12, 24).proportion_ci(0.95, "exact")
    np.testing.assert_allclose(
        [told["objective_lower"][0], told["objective_upper"][0]], [low, high]
    )
    [aim] = given.problem.objectives
    assert aim.told == f"probability of peak_tension > {middle:g} N"


def test_another_optimisation_is_refused_before_anything_runs_and_changes_nothing(found, tmp_path):
    front, out = found
    for old, new, words in (
        ("seed = 4", "seed = 5", "seed = 5 instead of 4"),
        ("verdict = 24", "verdict = 30", "verdict = 30 instead of 24"),
        ("designs = 10", "designs = 12", "designs = 12 instead of 10"),
        ("max = 1.6", "max = 1.7", "constraints.deployment_time.max = 1.7 instead of 1.6"),
        ("high = 0.2", "high = 0.21", "variables.speed.high = 0.21 instead of 0.2"),
        ('sections" = 3', 'sections" = 4', "scene.structure.sections = 4 instead of 3"),
    ):
        other = tmp_path / "quick.toml"
        other.write_text(FILE.replace(old, new))
        held = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
        done = CliRunner().invoke(cli, ["optimise", str(other), "--out", str(out)])
        assert done.exit_code == 2
        assert words in done.output
        assert "--out" in done.output
        assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == held
    xr.testing.assert_identical(xr.load_dataset(out / FRONT), front)


def test_a_file_in_place_of_the_folder_is_refused(file, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("")
    done = CliRunner().invoke(cli, ["optimise", str(file), "--out", str(taken)])
    assert done.exit_code == 2
    assert "taken" in done.output
    assert "Traceback" not in done.output


def test_nothing_that_reaches_its_goal_is_said(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text(FILE.replace('end_time" = 3.0', 'end_time" = 0.3'))
    done = CliRunner().invoke(cli, ["optimise", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "none of 4 samples of the present design reaches its goal" in done.output
    assert len(list((tmp_path / "out" / "designs").iterdir())) == 1


def test_tables_say_what_is_broken_and_worse(found):
    front = found[0].copy(deep=True)
    front["check_beyond"][:] = [[0.5], [0.2]]
    front["gain"][1] = -1.0
    front["without_beyond"][1] = 0.3
    text = "\n".join(line for table in front_tables(front) for line in table.lines())
    assert "no design that was tried surely keeps to all" in text
    assert "design-1 is least beyond (deployment_time <= 1.6 by 0.2 s)" in text
    assert "peak_tension (mean) design-1 is worse than the present design, and neither" in text
    assert "deployment_time <= 1.6 by 0.3 s (design-1 itself by 0.2 s)" in text
    assert "with one variable as at present" not in text
    front.attrs["designs"] -= 2
    text = "\n".join(line for table in front_tables(front) for line in table.lines())
    assert f"tried {front.sizes['tried'] - 2} designs with" in text
    assert "; 2 further designs with one variable as at present" in text
    front["check_beyond"][:] = [[-0.5], [-0.2]]
    text = "\n".join(line for table in front_tables(front) for line in table.lines())
    assert "keeps to all constraints: keep that one" in text
    # Its statistic is larger, as of samples that failed at present, and each pair is better.
    front["gain"][1] = 0.1
    front["objective_value"][1] = front["objective_value"][0] + 1.0
    text = "\n".join(line for table in front_tables(front) for line in table.lines())
    assert "worse than the present design" not in text


def test_several_designs_are_least_beyond(found):
    front = found[0]
    front = xr.concat([front, front.sel(design=["design-1"])], "design", data_vars="minimal")
    front = front.assign_coords(design=["present", "design-1", "design-2"])
    front["check_beyond"][:] = 0.5
    text = "\n".join(line for table in front_tables(front) for line in table.lines())
    assert "design-1 and design-2 are least beyond" in text


def test_command_prints_what_the_file_holds_and_draws_it(found, file, monkeypatch):
    front, out = found
    done = CliRunner().invoke(cli, ["optimise", str(file), "--out", str(out), "--plot"])
    assert done.exit_code == 0, done.output
    assert (out / "front-fig-front.png").stat().st_size > 20_000
    lines = done.output.splitlines()
    row = next(line for line in lines if line.startswith("peak_tension (mean) (N)"))
    told = float(row.split()[-1])
    np.testing.assert_allclose(told, front["objective_value"].values[1, 0], rtol=1e-3)
    assert any(line.split()[:1] == ["verdict"] and "met" in line for line in lines)
    again = xr.load_dataset(out / FRONT)
    xr.testing.assert_identical(again, front)


@pytest.mark.parametrize("wrong", [[], ["present"], ["present", "design-1"]])
def test_engines_that_differ_too_much_in_any_design_are_told(
    wrong, found, file, tmp_path, monkeypatch
):
    """Checks of three samples are made up: a third off in some designs, equal in others."""
    shutil.copytree(found[1], tmp_path / "out")

    def checked(folder):
        made = ringsim.open_campaign(folder)
        for name in ("status", "outcome", "reason", "peak_tension", "deployment_time"):
            values = made[name].values.copy()
            if name == "status":
                values[3:] = -1
            if name == "peak_tension" and folder.name in wrong:
                values *= 1.5
            made[f"{name}_checked"] = made[name].dims, values, made[name].attrs
        return made.assign_attrs(max_difference='{"peak_tension": 0.3}')

    monkeypatch.setattr(optimisation, "open_campaign", checked)
    words = ["optimise", str(file), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(cli, words, standalone_mode=False)
    assert done.return_value == (3 if wrong else 0)
    told = [line for line in done.output.splitlines() if "engines differ by more" in line]
    assert [line.partition(":")[0] for line in told] == wrong
    assert all("peak_tension (0.33 of the value in sample" in line for line in told)
    assert "wrote" in done.output


def test_what_is_missing_is_run_and_nothing_else(found, file, tmp_path):
    front, out = found
    again = tmp_path / "out"
    shutil.copytree(out, again)
    (again / FRONT).unlink()
    shutil.rmtree(sorted((again / "designs").glob("*-search"))[-2])  # all others are there
    kept = {path: path.stat().st_mtime_ns for path in again.rglob("*.journal")}
    xr.testing.assert_equal(ringsim.Optimisation.read(file).run(workers=0, out=again), front)
    assert all(path.stat().st_mtime_ns == time_ for path, time_ in kept.items())


@pytest.mark.slow
def test_killed_and_finished_by_other_workers_it_is_the_same(found, file, tmp_path):
    front, _ = found
    out = tmp_path / "killed"
    command = [sys.executable, "-m", "ringsim", "optimise", str(file), "--workers", "2", "--out",
               str(out)]  # fmt: skip
    process = subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT)  # fmt: skip
    end = time.monotonic() + 120.0
    while not (out / "designs" / "003-search").exists() and time.monotonic() < end:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not (out / FRONT).exists()
    again = ringsim.Optimisation.read(file).run(workers=1, out=out)
    xr.testing.assert_equal(again, front)


REFUSED = [
    (('low = 0.08', 'low = 0.3'), "variables.speed.low = 0.3 must be below high = 0.2"),
    (('high = 0.2', 'high = 0.1'), "the scene has 0.16, where the search begins, and 0.08 .. 0.1"),
    (("upper.winch.winding.speed", "upper.winch.winding.sped"), "winding.sped"),
    (('["cables.upper.winch.winding.speed"', '["structure.sections"'), "structure.sections"),
    (('["cables.upper.friction.coefficient", ', '["cables.upper.winch.winding.speed", '), "drawn"),
    (("designs = 10", "designs = 5"), "too few for 1 variable: set designs = 8 at least"),
    (("verdict = 24", "verdict = 20"), "set verdict = 22 at least"),
    (("peak_tension", "peak_tensio"), "did you mean peak_tension"),
    (("peak_tension", "cable_tension"), "peak_tension"),
    (('minimise = "mean"', 'minimise = "quantile"'), "probability goes with a quantile"),
    (('minimise = "mean"', 'maximise = "mean", minimise = "mean"'), "minimise or maximise: give"),
    (('minimise = "mean"', 'minimise = "probability"'), 'minimise = "probability", max = 10.0'),
    (('minimise = "mean"', 'maximise = "probability"'), "must be 'mean' or 'quantile'"),
    (('name = "quick"\n', ""), "name is missing"),
    (('name = "quick"', "name = 4"), "name = 4 must be text in quotes"),
    (("seed = 4", 'seed = "x"'), 'seed = "x" must be a whole number'),
    (("seed = 4", "seed = [1]"), "seed = [1] must be a whole number"),
    (("seed = 4", "seed = 2.7"), "seed = 2.7 must be a whole number"),
    (("seed = 4", "seed = -4"), "seed = -4 must be at least 0"),
    (("designs = 10", "desins = 10"), "desins is not a known key (did you mean designs?)"),
    (("high = 0.2", "high = 1e9"), "variables.speed.high: "),
    (("shared = [\"cables.upper.winch", "#"), "speed is no scene path: give those"),
    (("deployment_time = {", "peak_motor_torque = {"), "constraints.peak_motor_torque: runs of"),
    (('peak_tension = { minimise = "mean" }', ""), "objectives must have 1 or more entries"),
    (('"cables.lower.winch.winding.speed"]', '"cables.upper.winch.winding.speed"]'), "before"),
    (("[objectives]", '[variables."solver.restarts"]\nlow = 1.0\nhigh = 9.0\n[objectives]'),
     "whole number, and variables have decimals"),
    (("[objectives]", '[variables."cables.upper.winch.winding.speed"]\nlow = 0.1\nhigh = 0.2\n'
      "[objectives]"), "is also set by variable speed: leave out one"),
    (("[objectives]", '[variables.a]\nlow = 0.1\nhigh = 0.6\nshared = ["joints.vjoint.viscous"]\n'
      '[variables.b]\nlow = 0.1\nhigh = 0.6\nshared = ["joints.vjoint.viscous[2]"]\n[objectives]'),
     "is also set by variable a: leave out one"),
    (("designs = 10", "designs = 10\nfront = 3"), "one objective has one best design"),
    (("designs = 10", 'designs = 10\ndesign = { kind = "random", samples = 3 }'), "leave it out"),
    (("[constraints]", "[requirements]"), "calls them constraints"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), REFUSED)
def test_what_is_refused(change, words, tmp_path):
    text = FILE.replace(*change)
    assert text != FILE
    with pytest.raises(InputError) as error:
        optimisation_of(text, tmp_path / "quick.toml")
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith("quick.toml: ")


def test_other_verbs_name_this_one(file):
    done = CliRunner().invoke(cli, ["campaign", str(file)])
    assert "variables: this is no campaign file: run it with ringsim optimise" in done.output


MPIEXEC = shutil.which(
    "mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
)


@pytest.mark.slow
@pytest.mark.skipif(MPIEXEC is None, reason="there is no mpiexec: install ringsim[mpich]")
def test_ranks_of_mpi_find_the_same(found, file, tmp_path):
    front, _ = found
    done = subprocess.run(
        [MPIEXEC, "-n", "2", sys.executable, "-m", "mpi4py", "-m", "ringsim", "optimise", str(file),
         "--out", str(tmp_path / "out")],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("wrote ") == 1
    xr.testing.assert_equal(xr.load_dataset(tmp_path / "out" / FRONT), front)


def test_friction_of_chosen_pulleys_may_be_a_variable(file):
    text = FILE.replace(', "cables.lower.friction.coefficient"', "").replace(
        "designs = 10", "designs = 30"
    )
    text = text.replace(
        "[objectives]",
        """[variables.cables.lower.friction.coefficient]
    "section 2 V" = { low = 1e-4, high = 1e-3 }

    [variables."cables.lower.friction.coefficient[2]"]
    low = 1e-4
    high = 1e-3

    [objectives]""",
    )
    given = optimisation_of(text, file)
    scene = given.present.scene
    [place] = [k for k in range(1, 7) if with_number(
        scene, 'cables.lower.friction.coefficient["section 2 V"]').endswith(f"[{k}]")]  # fmt: skip
    values = given.settings_of(np.array([0.5, 0.0, 1.0]))
    told = scene.with_values(values).cables.lower.friction.coefficient
    assert (told[place - 1], told[1]) == (1e-4, 1e-3)
    others = [told[k] for k in range(len(told)) if k not in (place - 1, 1)]
    assert others == [scene.cables.lower.friction.coefficient] * len(others)


@pytest.mark.parametrize("first", [True, False])
def test_a_variable_comes_after_what_the_call_sets_of_the_whole(first, file):
    """Of a place that the file sets, too: its value in the design counts, and others the call's."""
    place = "joints.vjoint.viscous[2]"
    text = FILE.replace("designs = 10", "designs = 12")
    text = text.replace("[set]", f'[set]\n"{place}" = 0.6')
    text = text.replace(
        "[objectives]", f"[variables.'{place}']\nlow = 0.3\nhigh = 1.0\n[objectives]"
    )
    settings = {"joints.vjoint.viscous": 0.5}
    settings = settings | {place: 0.7} if first else {place: 0.7} | settings
    given = optimisation_of(text, file, settings)
    assert given.values(given.start)[place] == (0.7 if first else 0.5)
    for share, value in ((0.0, 0.3), (1.0, 1.0)):
        scene = given.campaign(Wanted(SEARCH, np.array([0.5, share])), "x").scene
        assert scene.joints.vjoint.viscous == (0.5, value, 0.5)


def test_budget_can_be_set_in_the_call(file):
    given = optimisation_of(FILE, file, {"designs": 20, "verdict": 50, "solver.step": 0.02})
    assert (given.budget.designs, given.budget.verdict) == (20, 50)
    assert given.present.scene.solver.step == 0.02


def test_a_search_goes_by_outputs_by_expressions(found, file, tmp_path):
    """The peak of what is recorded, on each of the first designs, by hand."""
    own = '[outputs]\npull = "max(cable_tension)"\nlate = "max(lock_time)"\n'
    text = FILE.replace("peak_tension = {", "pull = {").replace("deployment_time = {", "late = {")
    given = optimisation_of(f"{text}\n{own}", file)
    course = optimisation._Course(given, tmp_path)
    order = course.order()
    shutil.copytree(found[1] / "designs" / "001-search", order.folder)  # the same samples
    order.prepare()
    values = course._values(order.folder)
    with ringsim.open_campaign(order.folder) as ran:
        pull = ran["cable_tension"].max(["plane", "span", "time"]).values
        np.testing.assert_array_equal(values["pull"], pull)
        np.testing.assert_array_equal(values["late"], ran["lock_time"].max(["plane", "section"]))
    assert np.isfinite(pull).all()
    derived.forget(derived.declared())


def test_outputs_by_expressions_are_objectives_and_constraints():
    """And of the file that has them alone."""
    own = '[outputs]\npull = "max(cable_tension)"\nlag = "difference(lock_time)"\n'
    text = FILE.replace("peak_tension = {", "pull = {").replace(
        "[constraints]\n",
        "[constraints]\nlag = { max = 1.0, probability = 0.9, confidence = 0.9 }\n",
    )
    given = optimisation_of(f"{text}\n{own}", Path("quick.toml"))
    assert [*given.budget.objectives] == ["pull"]
    assert given.present.specification.outputs.keys() == {"pull", "lag"}
    assert "lag" in given.present.specification.requirements
    with pytest.raises(InputError, match=r"lag|pull"):
        optimisation_of(text, Path("quick.toml"))
    derived.forget(derived.declared())
