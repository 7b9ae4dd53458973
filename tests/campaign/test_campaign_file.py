"""Campaign files: what is read from them, and one clear line for each mistake."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from loops import for_each

from ringsim.campaign.plan import extent_told
from ringsim.campaign.specification import load_campaign
from ringsim.execution.work import longest_first, relative_cost
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.tables import size_text

ROOT = Path(__file__).parents[2]
GOOD = """
name = "good"
seed = 3
scene = "ring18"
design = { kind = "random", samples = 4 }
[set]
boom = "none"
structure.sections = 6
[inputs]
rods.young_modulus = { kind = "normal", mean = 120e9, standard_deviation = 6e9 }
"loads.force" = { kind = "uniform", low = 0.01, high = 0.02 }
"""


def loaded(folder, text=GOOD):
    path = folder / "good.toml"
    path.write_text(text)
    return load_campaign(path)


def write_posterior(path, **inputs):
    """A file like that of a calibration."""
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts({"inputs": json.dumps(inputs), "correlations": "[]", "clocks": "{}"})


def test_an_input_and_one_that_was_learnt_have_no_name_in_common(tmp_path):
    """Each gives its value to a path of its own, and may not replace the other."""
    law = '{ kind = "normal", mean = 100e9, standard_deviation = 1e9, shared = [PATHS] }'
    write_posterior(tmp_path / "posterior.nc", stiff={
        "kind": "calibrated", "of": {"kind": "normal", "mean": 1.2e11, "standard_deviation": 6e9},
        "shift": 0.0, "remaining_scatter": 0.5, "data": "stand", "shared": ["rods.young_modulus"],
    })  # fmt: skip
    head = GOOD.partition("[inputs]")[0] + '[inputs]\nfrom = "posterior.nc"\n'
    own = law.replace("PATHS", '"rods.shear_modulus"')
    with pytest.raises(InputError, match=r'stiff is given by inputs and by .* without = \["stiff"'):
        loaded(tmp_path, f"{head}stiff = {own}\n")
    found = loaded(tmp_path, f"{head}other = {own}\n").specification.inputs
    assert [*found] == ["other", "stiff"]


def test_what_the_call_sets_again_counts_where_it_is_set_last(tmp_path):
    text = GOOD.replace("[set]", '[set]\n"rods.young_modulus[2]" = 1e11\n', 1)
    (tmp_path / "good.toml").write_text(text)
    settings = {"rods.young_modulus": 2e11, "rods.young_modulus[2]": 3e11}
    told = load_campaign(tmp_path / "good.toml", settings).scene.rods.young_modulus
    assert told[:3] == (2e11, 3e11, 2e11)


def test_paths_may_be_quoted_or_nested(tmp_path):
    campaign = loaded(tmp_path)
    assert campaign.scene.structure.sections == 6
    assert campaign.scene.boom is None
    assert list(campaign.specification.inputs) == ["rods.young_modulus", "loads.force"]


@pytest.mark.quick
def test_scene_file_is_looked_up_beside_the_campaign_file(tmp_path):
    scene = loaded(tmp_path).scene
    (tmp_path / "mine.toml").write_text(scene.to_toml())
    again = loaded(tmp_path, GOOD.replace('"ring18"', '"mine.toml"'))
    assert again.scene == scene


@for_each("file", sorted((ROOT / "campaigns").glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_campaigns_can_be_drawn(file):
    campaign = load_campaign(file)
    assert campaign.draw().samples >= 1


@pytest.mark.quick
def test_example_in_the_guide_can_be_drawn(tmp_path):
    guide = ROOT / "docs" / "guide"
    page = (guide / "campaigns.md").read_text(encoding="utf-8")
    (example,) = re.findall(r'```toml\n(name = "study".*?)```', page, re.DOTALL)
    page = (guide / "requirements.md").read_text(encoding="utf-8")
    (required,) = re.findall(r"```toml\n(\[requirements\].*?)```", page, re.DOTALL)
    campaign = loaded(tmp_path, example + required)
    assert campaign.draw().samples == 256
    assert len(campaign.specification.requirements) == 2


@pytest.mark.quick
@for_each(
    ("old", "new", "words"),
    [
        ("seed = 3", "sead = 3", r"sead is not a known key \(did you mean seed\?\)"),
        ("seed = 3", "seed = -3", "seed = -3 must be at least 0"),
        ("seed = 3", "seed = 3.5", "whole number"),
        ('name = "good"', 'name = "a/b"', "name"),
        ('"ring18"', '"ring19"', r"scene: .*ring19: no such file.*did you mean ring18"),
        ('kind = "random"', 'kind = "randon"', "did you mean random"),
        ("samples = 4", "samples = 0", r"design\.samples = 0 must be at least 1"),
        ("samples = 4", "sample = 4", "sample"),
        ('kind = "normal"', 'kind = "norm"', "did you mean normal"),
        ("mean = 120e9, ", "", "mean is missing"),
        ("structure.sections = 6", "structure.section = 6", "structure.section is not a known key"),
        ('boom = "none"', "boom = 3", "boom"),
        ("low = 0.01", "low = 0.03", "must be below high"),
        (
            '{ kind = "normal", mean = 120e9, standard_deviation = 6e9 }',
            '{ kind = "truncated", low = 130e9, high = 110e9, of = { kind = "normal", '
            "mean = 120e9, standard_deviation = 6e9 } }",
            r"low = 130000000000\.0 must be below high = 1100",
        ),
        ("[set]", "[set", "not valid TOML"),
        ("[inputs]", "[limits]\ntimeout = 0\n[inputs]", r"limits\.timeout = 0 s must be at least"),
        ("[inputs]", "[limits]\nmemory = 1\n[inputs]", r"limits\.memory"),
        ("[inputs]", "[retry]\ntimes = 2\n[inputs]", "retry is not a known key .*solver.restarts"),
        ("[inputs]", "[output]\ncompression = 10\n[inputs]", "compression = 10"),
        (
            "[inputs]",
            "[output]\nshard_samples = 8\n[inputs]",
            "shard_samples is not.*no limit any more",
        ),
        ("seed = 3", "seed = 3\nmax_failed = -1", "max_failed = -1"),
        (
            "[inputs]",
            '[output]\nleave_out = ["opening_angel"]\n[inputs]',
            r"opening_angel is not an output variable \(did you mean opening_angle\?\)",
        ),
        (
            "[inputs]",
            '[output]\nleave_out = ["lock_time", "cause"]\n[inputs]',
            r"output\.leave_out: cause says how each sample ended, .*: take it out of the list",
        ),
    ],
)
def test_mistakes_are_refused_in_one_line(old, new, words, tmp_path):
    with pytest.raises(InputError, match=words) as refusal:
        loaded(tmp_path, GOOD.replace(old, new)).draw()
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith("good.toml: ")


@pytest.mark.quick
def test_a_refused_median_is_told_as_what_it_is(tmp_path):
    """A value that stands nowhere in the file; one that does needs no word."""
    head = GOOD.partition("[set]")[0].replace("ring18", "ring18-motor")
    speed = '[inputs]\n"cables.upper.winch.winding.speed" = '
    with pytest.raises(InputError) as refused:
        loaded(tmp_path, f'{head}{speed}{{ kind = "uniform", low = 380.0, high = 820.0 }}\n').draw()
    assert "speed: 600.0 is among what is drawn for it, and scene" in str(refused.value)
    assert "speed = 600.0 rad/s must be below" in str(refused.value)


@for_each("part", ["0/2", "3/2", "2", "a/b", "-1/2", "1/0", "\N{SUPERSCRIPT TWO}/3"])
def test_senseless_parts_are_refused(part, bench):
    printed = bench.run("campaign", bench.write(2), "--part", part, code=2)
    assert "must read i/n" in printed


def test_a_file_may_leave_out_what_the_antenna_did(bench):
    """The file was written, and then the command failed."""
    bench.write(2, more='[output]\nleave_out = ["outcome"]\n')
    bench.run("campaign", "small.toml", "--workers", 0, "--out", "out")
    assert "outcome" not in bench.result("out")


def test_output_is_rounded_and_left_out_where_asked(bench):
    more = '[output]\nleave_out = ["lock_time"]\nsignificant_digits = { opening_angle = 4 }\n'
    exact, rough = bench.write(4), bench.write(4, more=more, name="rough.toml")
    bench.run("campaign", exact, "--workers", 0, "--out", "exact")
    bench.run("campaign", rough, "--workers", 0, "--out", "rough")
    exact, rough = bench.result("exact"), bench.result("rough")
    assert "lock_time" in exact
    assert "lock_time" not in rough
    np.testing.assert_allclose(rough.opening_angle, exact.opening_angle, rtol=5e-4)
    assert not np.array_equal(rough.opening_angle, exact.opening_angle, equal_nan=True)
    np.testing.assert_array_equal(rough.deployment_time, exact.deployment_time)
    sizes = [(bench.folder / out / "campaign.nc").stat().st_size for out in ("rough", "exact")]
    assert sizes[0] < sizes[1]


def test_who_answers_for_a_file_and_who_made_it_stand_in_it(bench):
    """A licence "None", as ACDD has it, and no creator where nobody states them."""
    stated = '[output]\nlicense = "CC-BY-4.0"\ncreator = "Antenna team"\n'
    file = bench.write(4, more=stated)
    for part in (1, 2):
        bench.run("campaign", file, "--part", f"{part}/2", "--out", "out")
    found = bench.result("out").attrs
    assert (found["license"], found["creator_name"]) == ("CC-BY-4.0", "Antenna team")
    assert found["execution"] == "1 local worker in each of 2 parts"
    bench.run("merge", "out")
    assert bench.result("out").attrs["execution"] == "merged on its own, from 2 journals"
    blank = bench.write(2, more='[output]\nlicense = " "\ncreator = ""\n', name="blank.toml")
    bench.run("campaign", blank, "--workers", 0, "--out", "blank")
    found = bench.result("blank").attrs
    assert found["license"] == "None"
    assert "creator_name" not in found


def test_dry_run_tells_the_plan_and_keeps_nothing(bench):
    printed = bench.run("campaign", bench.write(16), "--workers", 2, "--dry-run", "--out", "out")
    assert "16 to run" in printed
    begun = printed.index("trial run of sample")  # which takes long, and is told before
    assert begun < printed.index("from a trial run of sample")
    assert " to predict the cost ..." in printed
    assert "rods.young_modulus" in printed
    assert not (bench.folder / "out").exists()
    bench.run("campaign", bench.write(16), "--workers", 2, "--out", "out")
    printed = bench.run("campaign", bench.write(20), "--dry-run", "--out", "out")
    assert "4 to run" in printed
    assert "from 16 completed samples" in printed
    written = sum(file.stat().st_size for file in (bench.folder / "out/journals").iterdir())
    assert f"{size_text(written / 16)} a run, {size_text(written / 16 * 20)} for all" in printed


def test_dry_run_says_where_there_will_be_no_intervals_and_no_range_of_one(bench):
    file = bench.write(1)
    start = ("campaign", file, "--dry-run", "--out", "out")
    printed = bench.run(*start)
    assert "no intervals" not in printed
    assert "s each, from a trial run" in printed
    file.write_text(file.read_text().replace('"random"', '"sobol"'))
    assert "set design.replicates = 8" in bench.run(*start)


def test_dry_run_says_which_requirement_so_many_samples_cannot_show(bench):
    """21 samples without a violation have the bound 0.1 ** (1 / 21) = 0.896, 22 have 0.901."""
    more = "[requirements]\nasynchrony_max = { max = 10.0, probability = 0.9, confidence = 0.9 }"
    for samples, told in ((21, True), (22, False)):
        printed = bench.run("campaign", bench.write(samples, more=more), "--dry-run", "--out", "o")
        assert (f"asynchrony_max: {samples} samples cannot prove" in printed) == told
        assert ("at least 22 are needed" in printed) == told
        line = "  requirement    asynchrony_max <= 10 deg with probability 0.9, confidence 0.9\n"
        assert line in printed
    more = "[requirements]\nasynchrony_max = { min = 1.0, probability = 0.9, confidence = 0.9 }"
    printed = bench.run("campaign", bench.write(22, more=more), "--dry-run", "--out", "o")
    assert "confidence 0.9 (doubtful: larger values are the worse ones: is max meant?)" in printed


def test_dry_run_says_where_the_design_makes_inputs_go_together(bench):
    """111 inputs: 100 points a replicate are few, 512 are enough."""
    file = bench.folder / "friction.toml"
    own = (ROOT / "campaigns" / "nonsync_friction.toml").read_text()
    plan = ("campaign", file, "--judge", "fake_solver:spy", "--dry-run", "--out", "out")
    for samples, told in ((1000, True), (5120, False)):
        design = f"samples = {samples}, replicates = 10"
        file.write_text(own.replace("samples = 5120, replicates = 10", design))
        printed = bench.run(*plan, solver="fake_solver:spy")
        lines = [line for line in printed.splitlines() if "have a rank correlation of" in line]
        assert len(lines) == told
        if told:
            both = '["section 12 second hinge"] and rods.young_modulus'
            assert f"{both} have a rank correlation of -0.60" in lines[0]


def test_a_folder_without_any_result_is_not_merged(bench):
    bench.run("campaign", bench.write(2), "--out", "out")
    for journal in (bench.folder / "out" / "journals").glob("*.journal"):
        journal.unlink()
    (bench.folder / "out" / "campaign.nc").unlink()
    assert "no sample has run" in bench.run("merge", "out", code=2)
    assert not (bench.folder / "out" / "campaign.nc").exists()


def test_dry_run_says_what_there_is_a_value_for(bench):
    file = ROOT / "campaigns" / "nonsync_quick.toml"
    plan = ("campaign", file, "--judge", "fake_solver:spy", "--dry-run", "--out", "out")
    printed = bench.run(*plan, solver="fake_solver:spy")
    for plane in ("upper", "lower"):
        (line,) = (x for x in printed.splitlines() if f"cables.{plane}.friction.coefficient" in x)
        assert line.endswith(", for each pulley")
    printed = bench.run("campaign", bench.write(2), "--dry-run", "--out", "out")
    (line,) = (x for x in printed.splitlines() if "rods.young_modulus" in x)
    assert line.endswith(" Pa, for each section")


def test_replay_gives_the_stored_result_and_saves_it(bench):
    bench.run("campaign", bench.write(4), "--workers", 2, "--out", "out")
    refused = bench.run("replay", "out", 2, "--scene", "--save", "two.nc", code=2)
    assert "nothing runs with --scene: leave out one of the two" in refused
    printed = bench.run("replay", "out", 2, "--save", "two.nc")
    assert "identical to the stored result" in printed
    with xr.open_dataset(bench.folder / "two.nc") as saved:
        assert saved.attrs["title"].endswith(", sample 2 of small")
    assert "young_modulus" in bench.run("replay", "out", 2, "--scene")
    assert "choose one from 0 to 3" in bench.run("replay", "out", 4, code=2)
    assert "absent: there is no such folder" in bench.run("replay", "absent", 0, code=2)


@pytest.mark.quick
def test_long_runs_come_first(tmp_path):
    text = GOOD + 'rods.elements = { kind = "discrete", values = [1, 2, 4] }\n'
    campaign = loaded(tmp_path, text.replace("samples = 4", "samples = 30"))
    table = campaign.draw()
    cost = relative_cost(table, campaign.scene)
    elements = next(c.values for c in table.columns if c.path == "rods.elements")
    order = longest_first(np.arange(30), cost)
    assert sorted(order) == list(range(30))
    assert elements[order[0]] == 4
    assert elements[order[-1]] == 1
    assert cost.mean() == pytest.approx(1.0)
    assert longest_first(np.array([4, 2, 9]), np.ones(10)) == [4, 2, 9]


@pytest.mark.quick
def test_samples_with_error_bars_cost_more_and_are_no_trial(tmp_path):
    """A run with error bars has a second one of half the steps: it foretells no other sample."""
    text = "error_bars_every = 4\n" + GOOD
    campaign = loaded(tmp_path, text.replace("samples = 4", "samples = 8"))
    table = campaign.draw()
    cost = relative_cost(table, campaign.scene)
    barred = next(c.values for c in table.columns if c.path == "solver.error_bars").astype(bool)
    assert barred.tolist() == [True, False, False, False] * 2
    without = loaded(tmp_path, GOOD.replace("samples = 4", "samples = 8")).draw()
    plain = relative_cost(without, campaign.scene)
    np.testing.assert_allclose(cost / plain, np.where(barred, 3.3, 1.0) * (cost / plain)[1])
    assert not barred[np.argsort(cost)[4]]
    (bars,) = (column for column in table.columns if column.path == "solver.error_bars")
    assert extent_told(bars) == "  error bars     samples 0, 4"


@pytest.mark.quick
def test_inputs_of_several_paths_are_told_by_both_names(tmp_path):
    paths = [f"joints.{family}.viscous" for family in ("hinge", "pivot")]
    shared = f'[inputs.drag]\nkind = "uniform"\nlow = 1e-4\nhigh = 8e-4\nshared = {paths}\n'
    campaign = loaded(tmp_path, GOOD + shared.replace("'", '"'))
    lines = [extent_told(column) for column in campaign.draw().columns if column.input == "drag"]
    assert [line.partition(":")[0] for line in lines] == [f"  drag, {path}" for path in paths]
    assert lines[0].endswith(" N m s/rad")


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="there is no ncdump")
def test_file_opens_in_ncdump(bench):
    bench.run("campaign", bench.write(2), "--workers", 0, "--out", "out")
    path = bench.folder / "out" / "campaign.nc"
    header = subprocess.run(["ncdump", "-h", path], capture_output=True, text=True, check=True)
    assert 'sample:standard_name = "realization"' in header.stdout


OF_CABLE = "cables.upper.friction.coefficient"


@pytest.mark.parametrize(
    ("text", "others"),
    [
        (f'[set."{OF_CABLE}"]\n"section 6 V" = 0.002', None),
        (f'[set]\n{OF_CABLE}."section 6 V" = 0.002', None),
        (f'[set."{OF_CABLE}"]\n"section 6 V" = 0.002\ndefault = 0.001', 0.001),
        (f'[set]\n"{OF_CABLE}" = {{ default = 0.001, "section 6 V" = 0.002 }}', 0.001),
    ],
)
def test_named_pulleys_under_set_join_the_values_of_the_scene(tmp_path, text, others):
    head = GOOD.partition("[set]")[0].replace("ring18", "ring18-cable")
    scene = loaded(tmp_path, f"{head}{text}\n").scene
    base = load_scene("ring18-cable")
    expected = base if others is None else base.with_values({OF_CABLE: others})
    assert scene == expected.with_values({f'{OF_CABLE}["section 6 V"]': 0.002})
    assert scene != expected


def test_an_unknown_pulley_under_set_is_refused_with_the_nearest(tmp_path):
    head = GOOD.partition("[set]")[0].replace("ring18", "ring18-cable")
    with pytest.raises(InputError) as refused:
        loaded(tmp_path, f'{head}[set."{OF_CABLE}"]\n"section 6 W" = 0.002\n')
    assert str(refused.value) == (
        f'good.toml: set: {OF_CABLE}["section 6 W"]: there is no pulley or span of that name '
        '(did you mean "section 6 V"?)'
    )


@pytest.mark.quick
def test_status_loads_nothing_that_it_does_not_need():
    """xarray alone takes half a second, and campaigns and status begin so."""
    heavy = "{'xarray', 'pandas', 'matplotlib', 'exudyn', 'mpi4py'}"
    code = f"import sys, ringsim.cli.campaign; print(*{heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_dry_run_lays_limits_beside_what_its_trial_has(bench):
    """A limit in another unit, or for another antenna, shows before anything has run."""
    more = "[requirements]\ndeployment_time = { max = 10.0, probability = 0.9, confidence = 0.5 }"
    file = bench.write(4, more=more)
    printed = bench.run("campaign", file, "--dry-run", "--out", "out")
    (told,) = re.findall(r"it has deployment_time (\S+) s$", printed, re.MULTILINE)
    trial = int(re.search(r"from a trial run of sample (\d+)", printed)[1])
    bench.run("campaign", file, "--out", "out")
    has = float(bench.result("out")["deployment_time"].sel(sample=trial))
    assert float(told) == pytest.approx(has, rel=1e-3)
