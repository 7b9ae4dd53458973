"""A campaign that may end early ends at one sample, whoever runs it and however often it stops."""

from __future__ import annotations

import json
import re
import time

import pytest
from loops import for_each

from campaign_bench import Bench, assert_same, finished, opened
from ringsim.analysis.requirements import Looks
from ringsim.campaign.specification import load_campaign
from ringsim.refusal import InputError

RULE = """
stop_when = [
    {{ requirement = "deployment_time" }}, {{ of = "deployment_time", half_width = {half} }},
]
looks = {{ first = 16, growth = 1.5 }}
[requirements]
deployment_time = {{ max = 19.0, probability = 0.7, confidence = 0.9 }}
"""
"""Of forces of 0.01 to 0.05 N some 94 of 100 deploy within 19 s."""
LOOKS = [16, 24, 36, 54, 81, 122, 183]


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """The campaign as one process runs it; 0.8 s are known after some hundred samples."""
    bench = Bench(tmp_path_factory.mktemp("ended"))
    write(bench)
    bench.printed = bench.run("campaign", "small.toml", "--workers", 0, "--out", "out")
    return bench


def write(bench, samples=240, half=0.6):
    path = bench.write(samples)
    name, rest = path.read_text().split("seed = 7", 1)
    path.write_text(f"{name}seed = 7\n{RULE.format(half=half).split('[req')[0]}{rest}"
                    f"[req{RULE.format(half=half).split('[req')[1]}")  # fmt: skip
    return path


def test_it_ends_at_a_look_and_tells_why(ended):
    found = ended.result("out")
    count = found.sizes["sample"]
    assert count in LOOKS[1:]
    assert (found.status == 0).all()
    assert int(found.attrs["stopped_after"]) == count
    assert int(found.attrs["planned_samples"]) == 240
    assert "deployment_time <= 19 s is met" in found.attrs["stop_reason"]
    assert json.loads(found.attrs["stop_when"])["looks"] == {"first": 16, "growth": 1.5}
    words = f"ended the campaign after {count} of at most 240 samples"
    for printed in (ended.printed, ended.run("merge", "out"), ended.run("analyse", "out")):
        assert words in printed
        assert "allow for these repeated checks" in printed
        assert " met " in printed
    assert f"ended          {count} of at most 240 samples" in ended.run("status", "out")
    assert finished(ended.folder / "out") == set(range(count))


@pytest.mark.parametrize("workers", [*(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2)), 4])
def test_it_ends_there_for_any_number_of_workers(workers, ended, bench):
    write(bench)
    bench.run("campaign", "small.toml", "--workers", workers, "--out", "out")
    assert_same(bench, ended)


@pytest.mark.slow  # for workers, in parts and after a kill it does by default
def test_it_ends_there_under_mpi(ended, bench, mpi):
    write(bench)
    bench.run("campaign", "small.toml", "--out", "out", ranks=2)
    assert_same(bench, ended)


def test_it_ends_there_in_parts_and_with_samples_beyond(ended, bench):
    """The last part runs to its end before the first one has begun."""
    write(bench)
    for part in ("2/2", "1/2"):
        bench.run("campaign", "small.toml", "--part", part, "--workers", 0, "--out", "out")
    assert max(finished(bench.folder / "out")) == 239
    assert_same(bench, ended)


def test_it_ends_there_after_a_kill(ended, bench):
    write(bench)
    start = ("campaign", "small.toml", "--workers", 2, "--out", "out")
    process = bench.start(*start)
    end = time.monotonic() + 60.0
    while len(finished(bench.folder / "out")) < 10 and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    process.kill()
    process.communicate()
    bench.run(*start)
    assert_same(bench, ended)
    again = bench.run(*start)  # has nothing to do
    assert "ended the campaign" in again


def test_without_enough_samples_it_runs_to_its_end_and_says_so(bench):
    write(bench, samples=40, half=0.01)
    printed = bench.run("campaign", "small.toml", "--workers", 0, "--out", "out")
    assert bench.result("out").sizes["sample"] == 40
    assert "did not end the campaign of 40 samples (3 looks: 16, 24, 36)" in printed


def write_drawn(bench, design, inputs):
    """A campaign that fails as its inputs say, see ``fake_solver.poisoned``."""
    path = bench.write_listed([30])
    listed = 'design = { kind = "list", file = "ways.csv" }'
    path.write_text(path.read_text().replace(listed, design) + inputs)


def test_samples_that_failed_once_are_judged_again(bench):
    """All fail at first, which shows nothing; once they hold, the first look is enough."""
    write_drawn(
        bench,
        'design = { kind = "random", samples = 60 }\n'
        'stop_when = { of = "deployment_time", half_width = 3.0 }\nlooks = { first = 20 }\n',
        '[inputs]\n"loads.force" = { kind = "uniform", low = 0.01, high = 0.05 }\n'
        '"rods.poisson_ratio" = { kind = "discrete", values = [0.11, 0.3] }\n',
    )
    start = ("campaign", "listed.toml", "--workers", 0, "--out", "out")
    bench.run(*start, solver="fake_solver:poisoned")
    count = bench.result("out").sizes["sample"]
    assert count in (20, 30, 45)
    bench.extra["CURED"] = "yes"
    bench.run(*start, "--retry-failed", solver="fake_solver:poisoned")
    found = opened(bench.folder / "out/campaign.nc")
    assert found.sizes["sample"] <= count
    assert (found.status == 0).all()


def test_looks_are_whole_replicates():
    numbers = Looks(first=20, growth=1.5).numbers(8)
    assert [next(numbers) for _ in range(4)] == [24, 32, 48, 72]


@for_each(
    ("change", "words"),
    [
        (
            ('kind = "random"', 'kind = "latin-hypercube"'),
            "a latin-hypercube design needs all its samples",
        ),
        (('kind = "random"', 'kind = "sobol"'), "design.replicates = 8"),
        (('requirement = "dep', 'requirement = "de'), "not among the requirements"),
        ((", half_width = 0.6", ""), "needs half_width"),
        (('{ of = "deployment_time"', '{ of = "opening_angle"'), "has a value for each plane"),
        (('{ of = "dep', '{ requirement = "x", of = "dep'), "needs either"),
        (("stop_when = [", "set_aside = ["), "set_aside"),
        (('of = "deployment_time"', 'of = "peak_tension"'), "the scene has no cables"),
    ],
)
def test_rules_that_cannot_be_followed_are_refused(change, words, tmp_path):
    path = write(Bench(tmp_path))
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    with pytest.raises(InputError, match=re.escape(words)):
        load_campaign(path)


def test_a_look_at_samples_without_numbers_ends_nothing(bench):
    """All of the first look have failed: the campaign goes on, as its resumption would."""
    write_drawn(
        bench,
        'design = { kind = "random", samples = 24 }\n'
        'stop_when = { requirement = "deployment_time" }\nlooks = { first = 8 }\n',
        '[inputs]\n"rods.poisson_ratio" = { kind = "discrete", values = [0.12] }\n'
        "[requirements]\n"
        "deployment_time = { max = 15.0, probability = 0.5, confidence = 0.9 }\n",
    )
    start = ("campaign", "listed.toml", "--workers", 0, "--out", "out")
    bench.run(*start, solver="fake_solver:poisoned", code=3)
    found = bench.result("out")
    assert found.sizes["sample"] == 24
    assert (found.status > 0).all()
