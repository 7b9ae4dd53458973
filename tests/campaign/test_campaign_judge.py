"""Samples of the frame engine are repeated with the full one, and the file holds both."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
import xarray as xr
from loops import for_each

from campaign_bench import Bench, comparable, journals, lose
from ringsim.campaign import merging
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import merge
from ringsim.campaign.specification import load_campaign
from ringsim.refusal import InputError
from ringsim.storage.journal import read_journal
from ringsim.storage.result import check_of, sample_of
from ringsim.variables import Status

CHECKED = 'fidelity = "frame"\ncheck_every = 2\n'
CALL = ("campaign", "small.toml", "--out", "out", "--judge", "fake_solver:judge")
START = (*CALL, "--workers", 0)


def written(bench, top=CHECKED, samples=5):
    path = bench.write(samples)
    path.write_text(top + path.read_text())
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished campaign whose samples 0, 2 and 4 were checked, and what it printed."""
    bench = Bench(tmp_path_factory.mktemp("checked"))
    written(bench)
    return bench, bench.run(*START, "--workers", 2)


@pytest.fixture
def checked(finished, tmp_path):
    """A copy of it."""
    shutil.copytree(finished[0].folder, tmp_path, dirs_exist_ok=True)
    return Bench(tmp_path)


def stored(bench):
    return [each.sample for path in journals(bench) for *_, each in read_journal(path)]


def test_the_file_does_not_depend_on_how_much_is_written_at_once(checked, monkeypatch):
    whole = checked.result("out")
    for name, size in (("_ROWS", 2), ("BLOCK_BYTES", 1), ("_READ", 1)):
        monkeypatch.setattr(merging, name, size)
    merge(open_folder(checked.folder / "out"), execution="", partly=True)
    xr.testing.assert_equal(checked.result("out"), whole)


def test_the_file_holds_the_answers_of_both_engines(checked):
    found = checked.result("out")
    assert found.sizes["sample"] == 5
    assert found.status_checked.values.tolist() == [0, -1, 0, -1, 0]
    frame, full = found.deployment_time.values, found.deployment_time_checked.values
    assert full[::2] == pytest.approx(1.001 * frame[::2], rel=1e-12)
    assert np.isnan(full[1::2]).all()
    assert found.steps_checked.values[0] == 100
    assert np.isnan(found.steps_checked.values[1])
    assert found.reason_checked.values[1] == ""
    assert found.deployment_time_checked.attrs["units"] == "s"
    assert "check with the full engine" in found.deployment_time_checked.attrs["long_name"]
    # What has dimensions beside the samples is not kept twice.
    assert "opening_angle_checked" not in found
    assert found.attrs["fidelity"] == "frame"
    assert found.attrs["check_every"] == 2


def test_checks_change_nothing_of_the_samples(checked):
    both = checked.result("out")
    checked.write(5)
    checked.run("campaign", "small.toml", "--out", "alone")
    alone = comparable(checked.result("alone"))
    xr.testing.assert_identical(comparable(both)[list(alone.data_vars)], alone)


def test_campaign_merge_and_status_tell_of_the_checks(checked, finished):
    found = checked.result("out")
    times = found.deployment_time.values
    k = int(np.argmax(times[::2])) * 2  # a thousandth of the longest time is the most
    for printed in (finished[1], checked.run("merge", "out")):
        assert "3 of 5 samples were checked with the full engine" in printed
        (row,) = [line.split() for line in printed.splitlines() if "deployment_time " in line]
        median, worst, sample, share, bars, error = row[-6:]
        assert float(median) == pytest.approx(0.001 * np.median(times[::2]), rel=0.05)
        assert float(worst) == pytest.approx(0.001 * times[k], rel=0.05)
        assert (int(sample), float(share), bars) == (k, pytest.approx(0.001, rel=0.01), "-")
        assert float(error) == pytest.approx(times.std(ddof=1) / np.sqrt(5), rel=0.05)
    assert "0 of 5 samples done, 2 workers, 3 checks to run" in finished[1]
    assert "checked        3 of 3" in checked.run("status", "out")
    assert "3 samples with the full engine, too, 0 to run" in checked.run(*START, "--dry-run")


@pytest.mark.parametrize(
    ("most", "code"),
    [
        ("0.002", 0),
        pytest.param("5e-4", 3, marks=pytest.mark.slow),
        ("{ deployment_time = 5e-4 }", 3),
        pytest.param("{ peak_tension = 5e-4 }", 0, marks=pytest.mark.slow),
    ],
)
def test_a_campaign_whose_engines_differ_too_much_ends_with_code_3(bench, most, code):
    written(bench, f"{CHECKED}max_difference = {most}\n")
    printed = bench.run(*START, code=code)
    last = printed.strip().splitlines()[-1]
    told = "the engines differ by more than the campaign allows in deployment_time (0.001 of"
    assert (told in last) == (code == 3)
    assert bench.run(*START, code=code).strip().splitlines()[-1] == last  # nothing runs again


def test_a_check_that_dies_costs_no_sample_and_can_be_repeated(bench):
    written(bench)
    bench.extra["JUDGE_DIES"] = "1"
    printed = bench.run(*START, "--workers", 2)
    assert "5 samples, 0 failed" in printed
    assert "3 checks failed, first sample 0: the solver process died of SIGSEGV" in printed
    found = bench.result("out")
    assert found.status.values.tolist() == [0] * 5
    assert found.status_checked.values.tolist() == [
        Status.CRASHED,
        -1,
        Status.CRASHED,
        -1,
        Status.CRASHED,
    ]
    del bench.extra["JUDGE_DIES"]
    bench.run(*START)
    assert len(stored(bench)) == 8  # a failure is a result, as of samples
    bench.run(*START, "--retry-failed")
    assert bench.result("out").status_checked.values.tolist() == [0, -1, 0, -1, 0]
    assert len(stored(bench)) == 11


def test_nothing_checked_cannot_keep_max_difference(bench):
    written(bench, f"{CHECKED}max_difference = 0.5\n")
    bench.extra["JUDGE_DIES"] = "1"
    printed = bench.run(*CALL, code=3)  # in a process that may die
    last = printed.strip().splitlines()[-1]
    assert "no sample was completed by both engines" in last


def test_lost_checks_and_samples_run_again_and_nothing_else(checked):
    before = comparable(checked.result("out"))
    lose(checked, [1, check_of(2)])
    assert "2 of 3" in checked.run("status", "out")
    checked.run(*START)
    assert sorted(stored(checked)) == sorted([*range(5), *map(check_of, (0, 2, 4))])
    xr.testing.assert_identical(comparable(checked.result("out")), before)


def test_a_finished_campaign_may_be_checked_later(bench):
    written(bench, 'fidelity = "frame"\n')
    bench.run(*START)
    assert "status_checked" not in bench.result("out")
    written(bench)
    bench.run(*START)
    assert sorted(map(sample_of, stored(bench))) == [0, 0, 1, 2, 2, 3, 4, 4]
    assert bench.result("out").status_checked.values.tolist() == [0, -1, 0, -1, 0]


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_every_way_to_run_gives_the_same(ranks, checked, mpi):
    before = comparable(checked.result("out"))
    start = (*CALL[:2], "--out", f"by{ranks}", *CALL[4:])
    checked.run(*start, *(() if ranks else ("--workers", 0)), ranks=ranks)
    xr.testing.assert_identical(comparable(checked.result(f"by{ranks}")), before)


def test_parts_check_their_own_samples(bench):
    written(bench)
    assert "left" in bench.run(*START, "--part", "1/2")
    assert sorted(stored(bench)) == sorted([0, 2, 4, *map(check_of, (0, 2, 4))])
    bench.run(*START, "--part", "2/2")
    assert bench.result("out").status_checked.values.tolist() == [0, -1, 0, -1, 0]


def test_no_figures_are_drawn_while_a_check_is_left(bench):
    """That of another part, or behind a signal: the exit code stays that of the run."""
    written(bench)
    bench.run(*START, "--part", "1/2")
    lose(bench, [check_of(2)])
    bench.run(*START, "--part", "2/2", "--plot", code=0)
    assert not list((bench.folder / "out").glob("*.png"))
    bench.run(*START, "--plot")
    assert list((bench.folder / "out").glob("*.png"))


@for_each(
    ("top", "words"),
    [
        ("check_every = 2\n", 'but fidelity = "full": leave check_every out'),
        ('fidelity = "ideal"\n', 'fidelity = "ideal": .* no longer available: .* "frame"'),
        ('fidelity = "frame"\nmax_difference = 0.1\n', "has no effect without check_every"),
        (f"{CHECKED}max_difference = 0.0\n", "max_difference"),
        (f"{CHECKED}max_difference = {{ deploymenttime = 0.1 }}\n", "did you mean deployment_time"),
        (
            f"{CHECKED}max_difference = {{ steps = 0.1 }}\n",
            "not an output that can be compared between engines",
        ),
        ('fidelity = "fram"\n', "must be 'full' or 'frame'"),
    ],
)
def test_senseless_checks_are_refused_in_one_line(bench, top, words):
    with pytest.raises(InputError, match=words) as refusal:
        load_campaign(written(bench, top))
    assert "\n" not in str(refusal.value)


def test_a_dry_run_tells_what_checks_cost(checked):
    """From one trial check, or from those that are done."""
    written(checked, samples=9)
    for out, open_, basis in (("new", 5, "from a trial run of sample"), ("out", 2, "from 3 com")):
        command = ("campaign", "small.toml", "--out", out, *CALL[4:])
        printed = checked.run(*command, "--dry-run")
        assert f"5 samples with the full engine, too, {open_} to run" in printed
        (cost,) = (line for line in printed.splitlines() if "cost of checks" in line)
        assert basis in cost
        assert "predicted      about" in printed
    assert not (checked.folder / "new").exists()


def test_a_dry_run_tells_what_samples_with_error_bars_cost(checked):
    path = written(checked, samples=9)
    path.write_text("error_bars_every = 4\n" + path.read_text())
    printed = checked.run("campaign", "small.toml", "--out", "new", *CALL[4:], "--dry-run")
    (cost,) = re.findall(r"  cost           (\S+) s each \((.*?)\), from", printed)
    own, barred = (part.rpartition("bars ")[2].split() for part in cost[1].split(";"))
    assert float(barred[0]) > 2.0 * float(own[-2])
    assert float(own[0]) < float(cost[0]) < float(barred[-2])


def test_of_a_check_that_takes_long_the_cost_is_estimated_and_none_is_run(tmp_path):
    """Samples of about 0.8 s, so that a check would take 24 s; this judge would kill itself."""
    bench = Bench(tmp_path, {"JUDGE_DIES": "1"})
    path = written(bench)
    path.write_text(path.read_text().replace("[set]", '[set]\n"rods.damping" = 0.9'))
    printed = bench.run(*CALL, "--dry-run", solver="fake_solver:slow")
    (cost,) = (line for line in printed.splitlines() if "cost of checks" in line)
    assert "estimated as 30 times a sample's" in cost
    assert 20.0 <= float(cost.split()[3]) < 60.0
    assert "trial run of the check" not in printed
    # Of those with error bars a check has them, too.
    path.write_text("error_bars_every = 2\n" + path.read_text())
    call = *CALL[:2], "--out", "new", *CALL[4:], "--dry-run"
    printed = bench.run(*call, solver="fake_solver:slow")
    own, judged = re.findall(r"  cost (?: |of checks)  *(\S+) s each (.*)", printed)
    barred = own[1].partition("bars ")[2].partition(" s)")[0].split(" to ")
    assert 29.5 * float(barred[0]) <= float(judged[0]) <= 30.5 * float(barred[-1])
    assert 25.0 * float(own[0]) < float(judged[0])


def test_replay_repeats_the_check_too(checked):
    printed = checked.run("replay", "out", 2, "--check", "--save", "full.nc")
    assert "check of sample 2: ok" in printed
    assert "identical to the stored result" in printed
    full = xr.load_dataset(checked.folder / "full.nc")
    both = checked.result("out").sel(sample=2)
    assert float(full.deployment_time) == float(both.deployment_time_checked)
    assert float(full.deployment_time) != float(both.deployment_time)
    assert "no stored result" in checked.run("replay", "out", 1, "--check")
