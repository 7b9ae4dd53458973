"""Failed samples run again with other numerical settings; nothing of the first try is lost."""

from __future__ import annotations

import pytest
import xarray as xr

from campaign_bench import comparable, journals, lose
from ringsim.storage.journal import read_journal
from ringsim.variables import Status

START = ("campaign", "listed.toml", "--out", "out")
BETTER = ("--retry-failed", "--set", "solver.tolerance=1e-4", "--set", "solver.step=0.1")
WORDS = "solver.tolerance = 0.0001, solver.step = 0.1"


def poisoned(bench, *words, code=0):
    """In one process, which failures of these kinds leave alone."""
    return bench.run(*START, "--workers", 0, *words, solver="fake_solver:poisoned", code=code)


def stored(bench):
    return [each for path in journals(bench) for *_, each in read_journal(path)]


def test_failed_samples_run_again_with_other_settings(bench):
    """Those only; the file says how each was computed, and replay repeats it so."""
    bench.write_listed([30, 12, 30, 12, 9])
    poisoned(bench)
    before = bench.result("out")
    assert before.status.values.tolist() == [0, 2, 0, 2, 2]
    assert set(before.overrides.values) == {""}
    printed = poisoned(bench, *BETTER)
    assert f"3 of 5 samples were run again with {WORDS} (overrides): 2 ok" in printed
    after = bench.result("out")
    assert after.status.values.tolist() == [0, 0, 0, 0, 2]
    assert after.overrides.values.tolist() == ["", WORDS, "", WORDS, WORDS]
    assert after.attempts.values.tolist() == [1, 2, 1, 2, 2]
    sound = {"sample": [0, 2]}
    xr.testing.assert_identical(comparable(before.isel(sound)), comparable(after.isel(sound)))
    # The first failures are on file, with what they were computed with.
    first = [r for r in stored(bench) if r.status is Status.SOLVER_FAILED and not r.overrides]
    assert sorted(r.sample for r in first) == [1, 3, 4]
    printed = bench.run("replay", "out", 1)
    assert "solver.tolerance = 0.0001" in printed
    assert "identical to the stored result" in printed
    assert "tolerance = 0.0001" in bench.run("replay", "out", 1, "--scene")
    assert "tolerance = 0.0003" in bench.run("replay", "out", 0, "--scene")
    assert "3 of 5 samples done, 2 left" not in poisoned(bench)  # the plain command goes on as ever


def test_a_dry_run_counts_the_samples_that_would_run_again(bench):
    bench.write_listed([30, 12, 30, 12])
    poisoned(bench)
    lose(bench, [2])
    before = journals(bench)
    for words, count in (((), 1), (("--retry-failed",), 3), (BETTER, 2)):
        assert f"4 samples (list design), {count} to run" in poisoned(bench, *words, "--dry-run")
    assert journals(bench) == before


def test_samples_that_have_not_run_are_left_to_the_plain_command(bench):
    bench.write_listed([30, 12, 30])
    poisoned(bench)
    lose(bench, [2])
    printed = poisoned(bench, *BETTER)
    assert "1 sample left: run the command without --retry-failed and --set" in printed
    poisoned(bench)
    assert bench.result("out").status.values.tolist() == [0, 0, 0]
    assert bench.result("out").overrides.values.tolist() == ["", WORDS, ""]


@pytest.mark.slow  # workers do above
def test_all_ranks_run_with_the_other_settings(bench, mpi):
    bench.write_listed([12, 12, 12, 12, 30, 12])
    poisoned(bench)
    bench.run(*START, *BETTER, ranks=2, solver="fake_solver:poisoned")
    assert bench.result("out").status.values.tolist() == [0] * 6
    assert bench.result("out").overrides.values.tolist() == [WORDS] * 4 + ["", WORDS]


def test_nothing_failed_nothing_runs(bench):
    bench.write_listed([30, 30])
    poisoned(bench)
    assert "no sample has failed: nothing to run again" in poisoned(bench, *BETTER)
    assert len(stored(bench)) == 2


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--retry-failed", "--set", "loads.force=0.02"], "for a change of the antenna"),
        (["--retry-failed", "--set", "solver={ step = 0.1 }"], "solver.* or record.* settings"),
        (["--retry-failed", "--set", "solver.end_time=30.0"], "it changes the size of the result"),
        (["--retry-failed", "--set", "record.interval=0.2"], "it changes the size of the result"),
        (["--retry-failed", "--set", "solver.tolerance=1.0"], "must be at most 0.1"),
        (["--retry-failed", "--set", "solver.tolerence=1e-4"], "did you mean tolerance?"),
        (["--set", "solver.tolerance=1e-4"], "its scene differs: solver.tolerance"),
    ],
)  # fmt: skip
def test_other_physics_is_refused(words, told, bench):
    bench.write_listed([30, 12])
    poisoned(bench)
    printed = poisoned(bench, *words, code=2)
    assert told in printed
    assert len(printed.splitlines()) == 1
    assert len(stored(bench)) == 2


def test_a_changed_file_is_refused_as_without_the_flag(bench):
    """Other inputs and more samples were passed over, and the old campaign was told as done."""
    bench.write_listed([30, 12])
    poisoned(bench)
    bench.write_listed([30, 11])
    assert "this folder has another campaign" in poisoned(bench, "--retry-failed", code=2)
    bench.write_listed([30, 12, 30])
    (line,) = poisoned(bench, "--retry-failed", code=2).splitlines()
    assert "was begun with 2 samples, and --retry-failed runs failed ones of these" in line
    bench.write_listed([30, 12])
    assert "2 samples, 1 failed" in poisoned(bench, "--retry-failed")


def test_settings_that_a_campaign_was_begun_with_stay(bench):
    bench.write_listed([30, 12])
    poisoned(bench, "--set", "structure.sections=4")
    assert "2 samples, 1 failed" in poisoned(bench, "--retry-failed")
    assert "this folder has another campaign" in poisoned(bench, code=2)
