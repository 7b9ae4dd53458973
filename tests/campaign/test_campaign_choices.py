"""Tables in campaign files, --set and --samples, from the file to campaign.nc and back."""

from __future__ import annotations

import re

import numpy as np
import pytest
from loops import for_each

from ringsim.campaign.specification import load_campaign
from ringsim.cli.campaign import changed
from ringsim.refusal import InputError

CHOOSING = """
name = "choosing"
seed = 3
scene = "truss2"
fidelity = "frame"
design = { kind = "random", samples = 12 }

[set]
solver.end_time = 0.5
record.interval = 0.25
"cables.lower.winch.winding" = { kind = "ramp", speed = 0.02, duration = 0.1 }

[inputs]
faults = { kind = "discrete", values = [[{ kind = "stuck-vjoint", section = 2, time = 0.2 }], []] }
"cables.upper.winch.stop_time" = { kind = "discrete", values = [0.25, "none"] }

[inputs.friction]
kind = "lognormal"
mean = 4e-4
standard_deviation = 1e-4
each_section = true
shared = ["cables.upper.friction.coefficient", "cables.lower.friction.coefficient"]
"""


def written(folder, text=CHOOSING):
    path = folder / "choosing.toml"
    path.write_text(text)
    return path


def test_tables_under_set_are_joined_into_the_scene(tmp_path):
    scene = load_campaign(written(tmp_path)).scene
    assert scene.cables.lower.winch.winding.kind == "ramp"
    assert scene.cables.lower.winch.winding.duration == 0.1
    assert scene.cables.upper.winch.winding.kind == "constant"


def test_kind_can_be_drawn_by_a_nested_path(tmp_path):
    text = CHOOSING.partition("[inputs]")[0] + (
        '[inputs.cables.upper.friction]\nkind = { kind = "discrete", values = ["none", "bearing"] }'
    )
    (column,) = load_campaign(written(tmp_path, text)).draw().columns
    assert column.path == "cables.upper.friction.kind"


def test_set_and_samples_stand_above_the_file(tmp_path):
    more = {"solver.end_time": 0.75, "stop": {"kind": "spring-damper", "stiffness": 50.0}}
    campaign = load_campaign(written(tmp_path), more, 3)
    assert campaign.scene.solver.end_time == 0.75
    assert campaign.scene.stop.stiffness == 50.0
    assert campaign.draw().samples == 3
    assert load_campaign(campaign.file).draw().starts_with(campaign.draw())
    (tmp_path / "again.toml").write_text(campaign.text)
    assert "--samples 3" in campaign.text
    assert "--set solver.end_time = 0.75" in campaign.text
    assert load_campaign(tmp_path / "again.toml").scene.solver.end_time == 0.5  # only remarks


@for_each(
    ("old", "new", "settings", "samples", "words"),
    [
        ("", "", {"solver.step": -1.0}, None, r"choosing.toml: set: .*solver.step = -1.0 s must"),
        ("", "", {"faults": []}, None, "faults is set by .set. or --set and also drawn"),
        (
            "random", "random",
            {"cables.upper.friction.coefficient[2]": 1e-4}, None, "is set by .set. or --set",
        ),
        ("random", "grid", {}, 4,
            '--samples 4: a design of kind "grid" has a fixed number of samples'),
        (', samples = 12', "", {}, None, r"design.samples is missing"),
        ("random", "randon", {}, 4, "did you mean random"),
    ],
)  # fmt: skip
def test_senseless_calls_are_refused_in_one_line(old, new, settings, samples, words, tmp_path):
    text = CHOOSING.replace(old, new) if old else CHOOSING
    with pytest.raises(InputError, match=words) as refusal:
        load_campaign(written(tmp_path, text), settings, samples).draw()
    assert "\n" not in str(refusal.value)


def test_samples_stand_in_for_a_size_that_the_file_lacks(tmp_path):
    campaign = load_campaign(written(tmp_path, CHOOSING.replace(", samples = 12", "")), None, 5)
    assert campaign.draw().samples == 5


def test_choices_reach_the_runs_and_the_merged_file(bench):
    file = written(bench.folder)
    start = ("campaign", file, "--samples", 3, "--set", "solver.tolerance=3e-3", "--out", "out")
    plan = bench.run(*start, "--dry-run", solver="fake_solver:spy")
    assert "faults: none, stuck-vjoint(section=2, time=0.2)" in plan
    bench.run(*start, "--workers", 0, solver="")
    result = bench.result("out")
    assert result.sizes["sample"] == 3
    assert (result.status == 0).all()
    assert set(result.faults.values) == {"none", "stuck-vjoint(section=2, time=0.2)"}
    assert result.groupby("faults").mean(...).final_time.notnull().all()
    upper, lower = (result[f"cables_{p}_friction_coefficient"] for p in ("upper", "lower"))
    assert upper.dims == ("sample", "pulley")
    assert upper.equals(lower)
    bench.run(*start, solver="")  # nothing is left to run
    assert "identical to the stored result" in bench.run("replay", "out", 1)
    # With another value, what it would have given: what the summary tells of both, and the way.
    told = bench.run("replay", "out", 1, "--set", "solver.tolerance=1e-3")
    assert "with solver.tolerance = 0.001 beside the stored result:" in told
    stored = int(result.steps.sel(sample=1))
    before, after, more = re.search(r"\n  steps +(\d+) -> (\d+) \((\S+) %\)", told).groups()
    assert int(before) == stored != int(after)
    assert float(more) == pytest.approx(100.0 * (int(after) / stored - 1.0), rel=0.05)
    assert "identical" not in told
    assert "keeps" not in told
    told = bench.run("replay", "out", 1, "--set", "cables.upper.friction.coefficient=1e-3")
    path = "cables.lower.friction.coefficient"
    assert f"  {path} keeps [{lower.values[1, 0]:.6g}, " in told
    assert "which it shared with cables.upper.friction.coefficient: set it, too" in told
    told = bench.run("replay", "out", 1, "--set", "limits.tension=20")
    assert re.search(r"\n  outcome +\S.* -> overloaded\n", told)
    # Numbers in another unit than that of files, too, with their bars.
    set_ = "--set", "record.stress=true", "--set", "solver.error_bars=true"
    told = bench.run("replay", "out", 1, *set_)
    assert re.search(r"largest asynchrony +\S+ deg -> \S+ \+- \S+ deg", told)
    assert "did you mean" in bench.run("replay", "out", 1, "--set", "solver.tolerances=1", code=2)
    more = bench.run(*start[:2], "--out", "out", solver="", code=2)
    assert "this folder has another campaign (its scene differs: solver.tolerance" in more
    assert "is not in the range" in bench.run(*start[:2], "--samples", 0, code=2)


@pytest.mark.quick
def test_a_changed_stress_is_told_in_its_unit_with_the_bar_of_either_side():
    old = {"peak_rod_stress": np.array(5e6)}
    new = {"peak_rod_stress": np.array(6e6), "peak_rod_stress_error": np.array(2e4)}
    (line,) = changed(new, old)
    assert " ".join(line.split()) == "largest rod stress 5 MPa -> 6 +- 0.02 MPa (+20 %)"


@pytest.mark.quick
def test_more_joints_than_the_scene_has_cannot_be_required(tmp_path):
    law = "\n[requirements]\n{} = {{ min = {}, probability = 0.9, confidence = 0.9 }}\n"
    for name in ("latched_joints", "locked_joints"):
        load_campaign(written(tmp_path, CHOOSING + law.format(name, 4)))
        with pytest.raises(InputError, match=rf"{name}\.min = 5: must be at most 4, the V-joints"):
            load_campaign(written(tmp_path, CHOOSING + law.format(name, 5)))
