"""Whatever a run does, it costs that sample and no other."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr

from campaign_bench import comparable
from ringsim.variables import Status

POISON = {
    3: (1, Status.ERROR, "ZeroDivisionError: on purpose"),
    7: (2, Status.CRASHED, "SIGSEGV"),
    8: (3, Status.CRASHED, "exit code 7"),
    20: (4, Status.TIMEOUT, "limits.timeout = 4 s"),
    21: (5, Status.MEMORY, "memory"),
    30: (6, Status.DIVERGED, "asynchrony is not a number"),
    31: (7, Status.ERROR, "TypeError"),
    44: (8, Status.ERROR, "SystemExit: 5"),
    49: (9, Status.SOLVER_FAILED, "smaller step"),
}
SAMPLES = 50
LIMITS = "[limits]\ntimeout = 4.0\nmemory = 6e8\n"


def ways():
    found = [30] * SAMPLES
    for sample, (way, _, _) in POISON.items():
        found[sample] = way
    return found


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    from campaign_bench import Bench

    bench = Bench(tmp_path_factory.mktemp("healthy"))
    bench.run("campaign", bench.write_listed([30] * SAMPLES), "--workers", 2, "--out", "out")
    return bench.result("out")


@pytest.fixture(scope="module")
def poisoned(tmp_path_factory):
    from campaign_bench import Bench

    bench = Bench(tmp_path_factory.mktemp("poisoned"))
    file = bench.write_listed(ways(), more=LIMITS)
    start = ("campaign", file, "--out", "out", "--workers", 2)
    bench.run(*start, solver="fake_solver:poisoned", fresh=True)
    return bench.result("out")


def test_poisoned_samples_are_kept_with_their_reason(poisoned, healthy):
    for sample, (way, status, reason) in POISON.items():
        assert poisoned.status.values[sample] == status, (sample, poisoned.reason.values[sample])
        assert re.search(reason, str(poisoned.reason.values[sample]))
        assert f"way {way}" in str(poisoned.log.values[sample])
    assert np.isnan(poisoned.deployment_time.values[[3, 7, 8, 20, 21]]).all()
    good = [k for k in range(SAMPLES) if k not in POISON]
    assert len(good) == 41
    assert (poisoned.status.values[good] == Status.OK).all()
    xr.testing.assert_identical(
        comparable(poisoned.isel(sample=good)).drop_vars("rods_poisson_ratio"),
        comparable(healthy.isel(sample=good)).drop_vars("rods_poisson_ratio"),
    )


@pytest.mark.slow  # of healthy samples: test_campaign_identity.py; of poison without MPI: above
@pytest.mark.parametrize("ranks", [2, 3])
def test_poison_gives_the_same_file_under_mpi(ranks, bench, poisoned, mpi):
    file = bench.write_listed(ways(), more=LIMITS)
    bench.run("campaign", file, "--out", "out", solver="fake_solver:poisoned", ranks=ranks)
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(poisoned))


def test_log_of_a_crash_and_of_a_hang_says_where(poisoned):
    """Of a process that holds nothing but the solver: the log ends with all that it has loaded."""
    logs = poisoned.log.values
    assert "Segmentation fault" in logs[7]
    for log in logs[[7, 20]]:
        assert "fake_solver.py" in log
        assert "in poisoned" in log
    assert set(logs[[k for k in range(SAMPLES) if k not in POISON]]) == {""}


def test_too_many_failures_stop_the_campaign(bench):
    file = bench.write_listed([1] * 5 + [30] * 15, more="max_failed = 2")
    text = file.read_text().replace("max_failed = 2", "")
    file.write_text("max_failed = 2\n" + text)
    printed = bench.run(
        "campaign", file, "--workers", 1, "--out", "out", solver="fake_solver:poisoned", code=3
    )
    assert "3 samples failed, more than max_failed = 2; 17 samples left" in printed
    assert "raise max_failed" in printed
    told = (
        "3 samples failed, more than max_failed = 2: raise it, or run these again: ringsim campaign"
    )
    assert told in bench.run("status", "out")
    file.write_text(file.read_text().replace("max_failed = 2", "max_failed = 5"))
    bench.run("campaign", file, "--workers", 1, "--out", "out", solver="fake_solver:poisoned")
    assert (bench.result("out").status.values == Status.ERROR).sum() == 5


def test_no_failure_is_put_up_with_if_none_may_be(bench):
    file = bench.write_listed([30, 30, 1, 30, 30])
    file.write_text("max_failed = 0\n" + file.read_text())
    start = ("campaign", file, "--workers", 1, "--out", "out")
    told = "1 sample failed, more than max_failed = 0; 2 samples left: raise max_failed"
    for _ in range(2):  # a second run does not start anything
        assert told in bench.run(*start, solver="fake_solver:poisoned", code=3)
    file.write_text(file.read_text().replace("max_failed = 0", "max_failed = 1"))
    assert "1 failed" in bench.run(*start, solver="fake_solver:poisoned")


def test_last_sample_that_fails_too_much_is_merged_and_told(bench):
    file = bench.write_listed([30, 1])
    file.write_text("max_failed = 0\n" + file.read_text())
    printed = bench.run(
        "campaign", file, "--workers", 1, "--out", "out", solver="fake_solver:poisoned", code=3
    )
    assert "2 samples, 1 failed" in printed
    assert "more than max_failed = 0" in printed
    assert bench.result("out").status.values.tolist() == [0, 4]


def test_failures_of_other_parts_count_against_the_limit(bench):
    file = bench.write_listed([30, 1] * 4)
    file.write_text("max_failed = 3\n" + file.read_text())
    start = ("campaign", file, "--out", "out", "--part")
    assert "4 samples failed, more than max_failed = 3" in bench.run(
        *start, "2/2", solver="fake_solver:poisoned", code=3
    )
    assert "4 samples failed, more than max_failed = 3; 4 samples left" in bench.run(
        *start, "1/2", solver="fake_solver:poisoned", code=3
    )


def test_campaign_without_any_success_says_so_in_its_exit_code(bench):
    file = bench.write_listed([1, 1])
    bench.run("campaign", file, "--out", "out", solver="fake_solver:poisoned", code=3)


def test_failed_samples_run_again_only_when_asked(bench):
    file = bench.write_listed([1, 30, 11])
    start = ("campaign", file, "--workers", 1, "--out", "out")
    bench.run(*start, solver="fake_solver:poisoned")
    bench.extra["CURED"] = "yes"
    assert "3 of 3 samples done" in bench.run(*start, solver="fake_solver:poisoned")
    assert bench.result("out").status.values.tolist() == [4, 0, 4]
    printed = bench.run(*start, "--retry-failed", solver="fake_solver:poisoned")
    assert "1 of 3 samples done" in printed
    assert bench.result("out").status.values.tolist() == [4, 0, 0]


def test_solver_that_cannot_be_loaded_is_refused(bench):
    printed = bench.run(
        "campaign", bench.write(samples=2), "--out", "out", solver="absent:run", code=2
    )
    assert printed.splitlines()[-1].startswith("solver absent:run cannot be loaded")


def test_serial_run_gives_the_same_statuses_where_it_survives(bench):
    file = bench.write_listed([30, 1, 6, 8, 9])
    start = ("campaign", file, "--out", "out", "--workers", 0)
    bench.run(*start, solver="fake_solver:poisoned")
    expected = [Status.OK, Status.ERROR, Status.DIVERGED, Status.ERROR, Status.SOLVER_FAILED]
    assert bench.result("out").status.values.tolist() == expected


def test_much_that_is_printed_stays_with_its_own_sample(bench):
    """Also what the solver did not flush, and text that no file can hold."""
    file = bench.write_listed([30, 20, 30, 20])
    bench.run("campaign", file, "--workers", 1, "--out", "out", solver="fake_solver:loud")
    result = bench.result("out")
    assert result.status.values.tolist() == [Status.OK, Status.ERROR] * 2
    for sample, force in ((1, 0.0105), (3, 0.0115)):
        log = str(result.log.values[sample])
        assert re.findall(r"force ([0-9.]+)", log) == [f"{force}"]
        assert "xxx" in log
        assert "a name that is no text: ? and a zero byte" in str(result.reason.values[sample])


@pytest.mark.parametrize("workers", [1, 2])
def test_results_that_do_not_fit_together_cost_only_themselves(workers, bench):
    file = bench.write_listed([30] * 10)
    start = ("campaign", file, "--workers", workers, "--out", "out")
    bench.run(*start, solver="fake_solver:shapeless")
    result = bench.result("out")
    force = result.loads_force.values
    fits = force <= 0.0125
    assert (result.status.values[fits] == Status.OK).all()
    assert np.isfinite(result.deployment_time.values[fits]).all()
    assert (result.status.values[~fits] == Status.ERROR).all()
    for k in np.flatnonzero(~fits):
        what = (
            "another size than those of the first samples" if force[k] <= 0.0135 else "along time"
        )
        assert what in str(result.reason.values[k])
