"""Subset simulation grows a campaign with its results, to a probability known in closed form."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
from scipy.stats import norm

from campaign_bench import Bench, assert_same, finished
from ringsim.analysis.study import analyse
from ringsim.analysis.tails import approach
from ringsim.plots import figures
from ringsim.report.page import page

DESIGN = """
[design]
kind = "subset-simulation"
of = "deployment_time"
above = {above:.17g}
samples = 40
share = 0.5
replicates = 4
"""
FORCE = '"loads.force" = { kind = "lognormal", mean = 0.02, standard_deviation = 0.004 }\n'
BETA = 1.6
"""The event, in standard deviations of the logarithm of the force."""
START = ("campaign", "tail.toml", "--out", "out")


def write(bench):
    """The stand-in deploys in 2 / sqrt(force) * (1 + 1e9 / modulus)."""
    deviation = np.sqrt(np.log1p(0.2**2))
    weakest = np.exp(np.log(0.02) - deviation**2 / 2 - BETA * deviation)
    above = 2.0 / np.sqrt(weakest) * (1 + 1e9 / 120e9)
    path = bench.folder / "tail.toml"
    path.write_text(
        'name = "tail"\nseed = 3\nscene = "ring18"\n[set]\nname = "ring6"\n'
        '"structure.sections" = 6\nboom = "none"\n"solver.end_time" = 40.0\n'
        f'"rods.young_modulus" = 120e9\n[inputs]\n{FORCE}{DESIGN.format(above=above)}'
    )
    return path


@pytest.fixture(scope="module")
def tail(tmp_path_factory):
    """As one process finds it."""
    bench = Bench(tmp_path_factory.mktemp("tail"))
    write(bench)
    bench.printed = bench.run(*START, "--workers", 0)
    return bench


def test_the_probability_is_that_of_the_closed_form(tail):
    found = analyse(tail.result("out"))
    exact = norm.cdf(-BETA)
    variation = found.tail_variation.item()
    assert found.tail_ended.item() == 1
    assert 0.05 < variation < 0.5
    # Few samples: four standard errors, of the logarithm.
    assert abs(np.log(found.tail_probability.item() / exact)) < 4.0 * variation
    low, high = found.tail_probability_interval.values
    assert low < found.tail_probability.item() < high
    for printed in (tail.printed, tail.run("analyse", "out")):
        assert re.search(r"rare event +deployment_time > [\d.]+ s", printed)
        assert re.search(rf"probability +{found.tail_probability.item():.3g}\n", printed)


def test_the_report_shows_the_tail_and_no_means_of_its_samples(tail, monkeypatch):
    shown = ("rare_event", "convergence")
    monkeypatch.setattr(figures, "PICTURES", [p for p in figures.PICTURES if p.name in shown])
    campaign = tail.result("out")
    found, text = analyse(campaign), page(campaign, "runs/tail")
    low, high = found.tail_probability_interval.values
    assert f"<td>{found.tail_probability.item():.3g}</td>" in text
    assert f'<td class="range">{low:.2g} .. {high:.2g}</td>' in text
    assert 'id="figure-rare_event"' in text
    assert "Samples of a subset-simulation design do not represent a population" in text
    assert 'id="figure-convergence"' not in text
    for (places, shares), each in zip(
        approach(campaign), found.tail_replicate_probability.values, strict=True
    ):
        assert shares[-1] == each
        assert (np.diff(places) > 0).all()
        assert (np.diff(shares) < 0).all()
        # States that a chain repeats tie with a threshold, and stay behind with it.
        halves = shares[:-1] / 0.5 ** np.arange(1, len(shares))
        assert halves[0] == 1.0
        assert ((halves <= 1.0) & (halves > 0.7)).all()


def test_plan_and_status_tell_that_more_runs_follow(tail, bench):
    write(bench)
    printed = bench.run(*START, "--dry-run")
    assert "160 so far, at most 800: results decide on further ones" in printed
    assert re.search(r"predicted +about .* for these, up to .* for all levels$", printed.strip())
    assert re.search(r"runs +\d+, all levels completed", tail.run("status", "out"))
    assert "nothing is left to run" in tail.run(*START, "--dry-run")


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_it_does_not_depend_on_the_number_of_workers(workers, tail, bench):
    write(bench)
    bench.run(*START, "--workers", workers)
    assert_same(bench, tail)


@pytest.mark.slow
def test_nor_on_mpi(tail, bench, mpi):
    write(bench)
    bench.run(*START, ranks=3)
    assert_same(bench, tail)


@pytest.mark.slow  # test_stop_when.py and test_campaign_kills.py kill what decides as it runs
def test_nor_on_a_kill(tail, bench):
    write(bench)
    process = bench.start(*START, "--workers", 0)
    end = time.monotonic() + 60.0
    while len(finished(bench.folder / "out")) < 170 and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    process.kill()
    process.communicate()
    bench.run(*START, "--workers", 0)
    assert_same(bench, tail)
    assert "rare event" in bench.run(*START, "--workers", 0)


def test_runs_in_the_event_are_repeated_with_the_full_engine(bench, tail):
    """The stand-in for it deploys a tenth of a percent later, so that all are confirmed, and runs
    outside may be in the event there.
    """
    path = write(bench)
    text = path.read_text().replace('kind = "subset', 'check = 7\nkind = "subset')
    path.write_text(text.replace('scene = "ring18"', 'scene = "ring18"\nfidelity = "frame"'))
    more = ("--workers", 0, "--judge", "fake_solver:judge")
    printed = bench.run(*START, *more)
    assert re.search("in the event with the full engine, too +4 of 4 repeated runs", printed)
    found = bench.result("out")
    checked = found.status_checked.values == 0
    assert checked.sum() == 7
    above, times = float(re.search(r"above = ([\d.]+)", text)[1]), found.deployment_time.values
    assert (times[checked] > above).sum() == 4
    below = np.sort(times[times <= above])
    np.testing.assert_array_equal(np.sort(times[checked])[:3], below[-3:])
    analysis = analyse(found)
    full = found.deployment_time_checked.values
    assert analysis.tail_missed.item() == ((times <= above) & (full > above) & checked).sum()
    assert analysis.tail_difference.item() == np.abs(full - times)[checked].max()
    farther, nearer = analysis.tail_probability_moved.values
    assert farther <= analysis.tail_probability.item() <= nearer
    plain = tail.result("out")
    np.testing.assert_array_equal(found.deployment_time, plain.deployment_time)


def test_parts_and_retries_are_refused(bench):
    write(bench)
    assert "leave --part out" in bench.run(*START, "--part", "1/2", code=2)
    assert "leave --retry-failed out" in bench.run(*START, "--retry-failed", code=2)
