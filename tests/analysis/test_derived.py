"""Outputs by expressions: numbers against numpy, what is refused, and where they count."""

from __future__ import annotations

import json
import random
import string
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import made_campaign, with_motors
from pydantic import TypeAdapter, ValidationError

from made import drawn_campaign
from ringsim import InputError, analyse, compare
from ringsim.analysis import derived
from ringsim.analysis.comparison_text import sections
from ringsim.analysis.derived import FUNCTIONS, Derived, over_samples
from ringsim.analysis.intervals import quantities
from ringsim.analysis.study_text import statistics_table, told, verdict_lines
from ringsim.campaign import merging
from ringsim.campaign.specification import Campaign, campaign_of
from ringsim.cli import cli
from ringsim.measured import is_instant
from ringsim.outputs import VARIABLES
from ringsim.plots.campaign.numbers import convergence
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.report.dossier import dossier
from ringsim.report.page import page
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import RandomDesign
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.storage import netcdf
from ringsim.variables import Status

FILE = """
name = "own"
seed = 1
scene = "truss2"
fidelity = "frame"
design = {{ kind = "random", samples = 3 }}

[set]
"solver.end_time" = 0.5
"record.interval" = 0.05

[inputs]
"cables.lower.axial_stiffness" = {{ kind = "uniform", low = 0.9e5, high = 1.1e5 }}

[outputs]
{outputs}

{more}
"""


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    """Other tests do not know what these define."""
    yield
    derived.forget(derived.declared())


def of(outputs: str, more: str = "") -> Campaign:
    return campaign_of(FILE.format(outputs=outputs, more=more), Path("own.toml"))


def stored() -> tuple[dict[str, Any], dict[str, Any]]:
    """Made records of four samples, one of which ends early and one without any."""
    stream = np.random.default_rng(3)
    axes = {"plane": np.array(["upper", "lower"]), "section": np.arange(1, 4),
            "span": np.arange(1, 6), "time": np.linspace(0.0, 2.0, 21)}  # fmt: skip
    arrays = {
        "cable_tension": stream.random((4, 2, 5, 21)), "asynchrony": stream.random((4, 21)),
        "opening_angle": stream.random((4, 2, 3, 21)), "lock_time": stream.random((4, 2, 3)),
        "peak_tension": stream.random(4), "locked_joints": np.array([6, 5, -1, 0]),
    }  # fmt: skip
    for name in ("cable_tension", "asynchrony", "opening_angle"):
        arrays[name][1, ..., 12:] = np.nan
        arrays[name][2] = np.nan
    return arrays, axes


A, _X = stored()
T, ASYNC, ANGLE, LOCK = (
    A[name] for name in ("cable_tension", "asynchrony", "opening_angle", "lock_time")
)
MISSING = np.arange(4) == 2


def without(values: Any) -> Any:
    return np.where(MISSING, np.nan, values)


with np.errstate(all="ignore"):
    KNOWN = {
        "max(cable_tension)": np.nan_to_num(T).max((1, 2, 3)),
        "min(cable_tension(plane='lower', span=(2, 4)))":
            np.nan_to_num(T[:, 1, 1:4], nan=9.0).min((1, 2)),
        "max(cable_tension(span=3, time=(0.5, 1.0)))":
            np.nan_to_num(T[:, :, 2, 5:11]).max((1, 2)),
        "max(cable_tension(span=1, time=0.55))": T[:, :, 0, 5:7].mean(-1).max(1),
        "mean(asynchrony)": np.array([a[np.isfinite(a)].mean() if k != 2 else np.nan
                                      for k, a in enumerate(ASYNC)]),
        "difference(lock_time)": np.ptp(LOCK.reshape(4, -1), axis=1),
        "max(difference(lock_time, over='plane'))": np.abs(LOCK[:, 0] - LOCK[:, 1]).max(1),
        "max(abs(opening_angle(plane='upper') - opening_angle(plane='lower')))":
            np.nan_to_num(np.abs(ANGLE[:, 0] - ANGLE[:, 1])).max((1, 2)),
        "max(abs(asynchrony - asynchrony(time=0)))":
            np.nan_to_num(np.abs(ASYNC - ASYNC[:, :1])).max(1),
        "asynchrony(time=0.3) - asynchrony(time=0.1)": ASYNC[:, 3] - ASYNC[:, 1],
        "argmax(asynchrony)": _X["time"][np.nan_to_num(ASYNC, nan=-1.0).argmax(1)],
        "argmin(lock_time, over='section')": _X["section"][LOCK.min(1).argmin(1)],
        "integral(asynchrony)": np.array([np.trapezoid(a[np.isfinite(a)], dx=0.1)
                                          for a in ASYNC]),
        "integral(asynchrony > 0.5)":
            np.array([np.trapezoid(1.0 * (a[np.isfinite(a)] > 0.5), dx=0.1) for a in ASYNC]),
        "sum(lock_time(plane='upper'))": LOCK[:, 0].sum(1),
        "max(cable_tension) / peak_tension - 2 * 0.5":
            np.nan_to_num(T).max((1, 2, 3)) / A["peak_tension"] - 1.0,
        "sqrt(mean(asynchrony * asynchrony))":
            np.array([np.sqrt(np.nanmean(a * a)) if np.isfinite(a).any() else np.nan
                      for a in ASYNC]),
        "-(+peak_tension)": -A["peak_tension"],
        "max(max(asynchrony), min(asynchrony))":
            np.nan_to_num(ASYNC).max(1),
        "integral(asynchrony(time=(0.25, 0.55)))": 0.05 * (
            0.5 * (0.5 * (ASYNC[:, 2] + ASYNC[:, 3]) + ASYNC[:, 3])
            + (ASYNC[:, 3] + ASYNC[:, 4]) + (ASYNC[:, 4] + ASYNC[:, 5])
            + 0.5 * (ASYNC[:, 5] + 0.5 * (ASYNC[:, 5] + ASYNC[:, 6]))),
        "peak_tension / (0 * peak_tension)": np.full(4, np.nan),
        "1 / 0 + locked_joints": np.full(4, np.nan),
        "locked_joints / 2": np.array([3.0, 2.5, np.nan, 0.0]),
    }  # fmt: skip


@pytest.mark.quick
@pytest.mark.parametrize("text", KNOWN)
def test_values_are_those_of_numpy(text: str) -> None:
    """Also of a run that ends early; NaN of one without records."""
    arrays, axes = stored()
    found = over_samples({"x": Derived(of=text)}, arrays, axes)["x"]
    recorded = ("cable_tension", "asynchrony", "opening_angle")
    expected = without(KNOWN[text]) if any(name in text for name in recorded) else KNOWN[text]
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12, nan_ok=True)


@pytest.mark.quick
def test_numbers_of_several_joints_need_all_of_them() -> None:
    """A joint without a time did not lock; those of the other plane may have."""
    arrays, axes = stored()
    arrays["lock_time"][1, 1, 2] = np.nan
    for text in ("difference(lock_time)", "max(lock_time)", "mean(lock_time) / 2",
                 "sum(lock_time < 0.5)", "max(difference(lock_time, over='plane'))",
                 "max(lock_time * peak_tension)", "argmax(lock_time, over='section')"):  # fmt: skip
        found = over_samples({"x": Derived(of=text)}, arrays, axes)["x"]
        assert np.isfinite(found).tolist() == [True, False, True, True], text
    for text in ("difference(lock_time(plane='upper'))", "max(lock_time(section=(1, 2)))"):
        found = over_samples({"x": Derived(of=text)}, arrays, axes)["x"]
        assert np.isfinite(found).all(), text


@pytest.mark.quick
@pytest.mark.parametrize(
    ("text", "unit"),
    [("max(cable_tension)", "N"), ("argmax(asynchrony)", "s"), ("max(lock_time) * 2", "s"),
     ("integral(cable_tension(plane='upper', span=1))", "N s"), ("locked_joints", "1"),
     ("peak_tension / deployment_time", "N s-1"), ("max(latch_rate) / peak_latch_rate", "1"),
     ("argmax(lock_time, over='section')", "1"), ("sqrt(peak_tension * peak_tension)", "N"),
     ("integral(asynchrony > 10)", "s")],
)  # fmt: skip
def test_units_follow_from_those_of_the_variables(text: str, unit: str) -> None:
    assert Derived(of=text).variable("x").units == unit


@pytest.mark.quick
def test_another_unit_takes_a_factor() -> None:
    """Nothing is converted."""
    with pytest.raises(InputError, match="put a factor into the expression"):
        of('x = { of = "peak_tension", unit = "kN" }')
    each = of('x = { of = "peak_tension / 1000", unit = "kN" }').specification.outputs["x"]
    assert each.variable("x").units == "kN"


@pytest.mark.quick
@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("max(cable_tension", "is no expression"),
        ("().__class__", "is not allowed"),
        ("max(cable_tension).real", "is not allowed"),
        ("__import__('os')", "is not allowed"),
        ("__builtins__", "is no variable of a run"),
        ("10**10**10", "is not allowed"),
        ("max(cable_tension) if 1 else 2", "is not allowed"),
        ("max(x for x in y)", "is not allowed"),
        ("(lambda: 1)()", "is not allowed"),
        ("[1][0]", "is not allowed"),
        ("f'{1}'", "is not allowed"),
        ("max(cable_tension, over='foo')", 'over must be "plane" or "span" or "time"'),
        ("cable_tension", "max(cable_tension)"),
        ("3", "has no variable of a run"),
        ("max(tension)", "is no variable of a run"),
        ("max(asynchrony) + max(cable_tension)", "cannot be added"),
        ("max(asynchrony) > max(cable_tension)", "compared"),
        ("max(cable_tension(span=99))", "span = 99.0 is no span of this scene"),
        ("max(cable_tension(plane='left'))", "(upper, lower)"),
        ("max(cable_tension(span=(3, 1)))", "the smaller first"),
        ("max(cable_tension(section=1))", "is no dimension of it"),
        ("max(peak_tension)", "is of one number already"),
        ("argmax(lock_time)", 'say over="plane"'),
        ("argmax(cable_tension, over='plane')", "are words"),
        ("integral(lock_time, over='section')", "of what depends on time"),
        ("1e999 * peak_tension", "must be a finite number"),
        ("True + peak_tension", "must be a number"),
        ("max(status)", "is no variable of a run"),
        ("max(rod_stress)", "the scene has no stress"),
        ("(" * 230 + "peak_tension" + ")" * 230, "is no expression"),
        ("-" * 480 + "locked_joints", ""),
        ("max(cable_tension)" * 40, "at most 500"),
        ("max(asynchrony(time=(5, 6)))", "time = (5.0, 6.0) is no time of this scene"),
        ("max(opening_angle(section=(9, 10)))", "is no section of this scene"),
        ("max(cable_tension(plane=(0, 1)))", "plane must be one of its words"),
        ("max(asynchrony(time='x'))", "time must be a number, or (from, to)"),
        ("max(asynchrony(time=0.1, time=0.2))", "time is given twice"),
        ("max(lock_time(section=(1, 1)) - lock_time(section=(2, 2)))", "another range of section"),
        ("max(peak_tension, deployment_time)", "cannot be added or compared"),
        ("sqrt(peak_tension)", "has no root"),
        ("peak_tension / (deployment_time / 1 - peak_tension / 1)", "cannot be added"),
        ("peak_tension\0", "is no expression"),
    ],
)  # fmt: skip
def test_what_is_no_expression_is_refused_in_one_line(text: str, told: str) -> None:
    """And what only looks strange is not."""
    given = f"x = {json.dumps(text)}"
    if not told:
        assert of(given).specification.outputs["x"].names == ["locked_joints"]
        return
    with pytest.raises(InputError) as refused:
        of(given)
    assert "outputs" in str(refused.value)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.quick
def test_texts_of_chance_are_refused_or_computed_and_never_run() -> None:
    """Nothing of them is seen by Python: an import, a call or a file would be."""
    stream, seen = random.Random(7), []
    sys.addaudithook(lambda event, _: seen.append(event) if watched else None)
    words = [
        *FUNCTIONS, *list(VARIABLES)[:40], *"+-*/()[]{}<>=.,:'\"", "__class__", "over=", "1e9",
        "lambda", "import", "open", "exec", "eval", "**", "time=(0, 1)", "plane='upper'",
    ]  # fmt: skip
    arrays, axes = stored()
    watched, lines = False, list[str]()
    # xarray imports dask, where that is installed, when it is first used.
    over_samples({"x": Derived(of="locked_joints")}, arrays, axes)
    for _ in range(2_000):
        text = "".join(stream.choice([*words, stream.choice(string.printable)])
                       for _ in range(stream.randrange(1, 12)))  # fmt: skip
        try:
            each = Derived(of=text[:500])
            watched = True
            told = each.told()
            if not told.dims and each.names:
                over_samples({"x": each}, arrays, axes)
        except InputError as error:
            lines.append(str(error))
        except ValidationError:  # an empty one
            assert not text
        finally:
            watched = False
    assert not any("\n" in line for line in lines)
    assert not {"import", "open", "exec", "os.system", "subprocess.Popen"} & set(seen)


def test_they_count_as_all_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the file, in requirements, in analyses and in figures; a changed one runs nothing again,
    and so does one of a folder that another process reads.
    """
    monkeypatch.chdir(tmp_path)
    outputs = """
pull = { of = "max(cable_tension(plane='upper'))", meaning = "largest pull", worse = "larger" }
apart = "max(abs(opening_angle(plane='upper') - opening_angle(plane='lower')))"
when_time = "argmax(asynchrony)"
apart_span = "max(asynchrony)"
last_section = "argmax(max(max(opening_angle, over='plane'), over='time'), over='section')"
"""
    more = "[requirements]\npull = { max = 1e3, probability = 0.5, confidence = 0.5 }"
    Path("own.toml").write_text(FILE.format(outputs=outputs, more=more), encoding="utf-8")

    def call(*words: str) -> str:
        done = CliRunner().invoke(cli, list(words))
        assert done.exit_code == EXIT_DONE, done.output
        return done.output

    call("campaign", "own.toml", "--workers=0")
    found = xr.load_dataset("runs/own/campaign.nc")
    assert (found["status"] == Status.OK).all()
    pull = found["cable_tension"].sel(plane="upper").max(["span", "time"])
    np.testing.assert_array_equal(found["pull"], pull)
    angle = found["opening_angle"]
    apart = abs(angle.sel(plane="upper") - angle.sel(plane="lower")).max(["section", "time"])
    np.testing.assert_array_equal(found["apart"], apart)
    assert found["pull"].attrs["long_name"] == "largest pull"
    assert found["apart"].attrs["units"] in ("deg", "degree")

    derived.forget(derived.declared())  # as in a process that has not read the campaign file
    told = call(
        "analyse", "runs/own", "--require", "apart: max 90, probability 0.5, confidence 0.5"
    )
    assert "pull <= 1000 N" in told
    assert "apart <= 90 deg" in told
    verdicts = analyse(xr.open_dataset("runs/own/campaign.nc"))
    assert verdicts["pull"].sel(statistic="maximum").item() == pull.max().item()
    # Those that are named as the time or place of something stand in the tables, too.
    lines = "\n".join(statistics_table(verdicts).lines())
    assert all(name in lines for name in ("when_time", "apart_span", "last_section"))

    outputs = outputs.replace("largest pull", "least pull").replace("max(cable", "min(cable")
    Path("own.toml").write_text(FILE.format(outputs=outputs, more=more), encoding="utf-8")
    monkeypatch.setattr(merging, "BLOCK_BYTES", 1)  # sample by sample, as blocks of large ones
    monkeypatch.setattr(netcdf, "CHUNK_BYTES", 1)
    assert "3 of 3" in call("campaign", "own.toml", "--workers=0")
    again = xr.load_dataset("runs/own/campaign.nc")
    *_, changed, designed = again.attrs["history"].splitlines()
    assert designed == found.attrs["history"].splitlines()[-1]
    assert "designed by" in designed
    assert "number of samples changed by" in changed
    np.testing.assert_array_equal(again["wall_time"], found["wall_time"])
    least = found["cable_tension"].sel(plane="upper").min(["span", "time"])
    np.testing.assert_array_equal(again["pull"], least)
    assert again["pull"].attrs["long_name"] == "least pull"


@pytest.mark.quick
@pytest.mark.parametrize(
    "name",
    ["peak_tension", "section", "max", "_own", "a b", "lück", "sample", "log", "overrides",
     "x_checked", "missing"],
)  # fmt: skip
def test_names_that_mean_something_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="outputs"):
        of(f"{json.dumps(name)} = 'peak_tension'")


def test_a_number_of_the_users_own_is_a_duration_for_the_clock_of_a_test() -> None:
    of("spread_time = 'difference(lock_time)'")
    assert not is_instant("spread_time")
    assert is_instant("deployment_time")


def test_requirements_are_not_at_fault_where_another_output_is_refused() -> None:
    """Nor are those on outputs that are sound: none is known then."""
    apart = "apart = \"max(abs(opening_angle(plane='upper') - opening_angle(plane='lower')))\""
    wanted = "[requirements]\napart = { max = 5.0, probability = 0.9, confidence = 0.9 }"
    with pytest.raises(InputError) as told:
        of(f"{apart}\nbad = \"max(cable_tension, over='time')\"", wanted)
    assert "outputs.bad" in str(told.value)
    assert "at fault" not in str(told.value)
    with pytest.raises(InputError, match=r"requirements\.aprt is not an output"):
        of(apart, wanted.replace("apart", "aprt"))


def test_a_plan_tells_that_records_miss_short_peaks(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(FILE.format(outputs="x = 'max(asynchrony)'", more=""), encoding="utf-8")
    done = CliRunner().invoke(cli, ["campaign", str(file), "--dry-run", f"--out={tmp_path / 'o'}"])
    assert done.exit_code == EXIT_DONE
    assert "read from records every 0.05 s: x; peaks between two records are missed" in done.output
    bad = CliRunner().invoke(cli, ["analyse", str(tmp_path / "o")])
    assert bad.exit_code == EXIT_BAD_INPUT


BOUND = {"probability": 0.5, "confidence": 0.5}


def with_own(bound: dict[str, float], **more: str) -> xr.Dataset:
    """Eight samples whose own outputs are 0 to 7 degrees, one from series and one from numbers."""
    made = made_campaign(8)
    own = {"far_apart": {"of": "max(asynchrony)", **more}, "twice": {"of": "2 * asynchrony_max"}}
    made["far_apart"] = made["twice"] = "sample", np.arange(8.0), {"units": "degree"}
    wanted = {"far_apart": bound | BOUND} if bound else {}
    return made.assign_attrs(outputs=json.dumps(own), requirements=json.dumps(wanted))


@pytest.mark.quick
@pytest.mark.parametrize(
    ("bound", "more", "worst"),
    [
        ({"max": 5.0}, {}, 7),
        ({"min": 5.0}, {}, 0),
        ({"min": 1.0, "max": 5.0}, {}, -1),
        ({}, {}, -1),
        ({"max": 5.0}, {"worse": "smaller"}, 0),
        ({"max": 5.0}, {"worse": "neither"}, -1),
    ],
)
def test_what_is_required_on_one_side_tells_which_end_is_worse(
    bound: dict[str, float], more: dict[str, str], worst: int
) -> None:
    """Unless ``worse`` says it: in tables, figures and comparisons."""
    made = with_own(bound, **more)
    found = analyse(made)
    assert int(found["far_apart_worst_sample"]) == worst
    (row,) = (row for row in statistics_table(found).rows if row[0] == "far_apart")
    assert row[-2] == ("-" if worst < 0 else str(worst))
    cure = '; of far_apart, worse = "larger" or "smaller" under [outputs] says it'
    unsaid = any(note.endswith(cure) for note in statistics_table(found).notes)
    assert unsaid == (worst < 0 and not more)
    short = [line for line in told(found, full=False) if line.startswith("far_apart: mean")]
    if bound and worst >= 0:  # the samples' values are their numbers
        assert f"worst {worst} deg in sample {worst}" in short[0]
    one = {"far_apart": bound | BOUND} if bound else {}
    assert int(analyse(made, one)["far_apart_worst_sample"]) == worst
    other = made.assign(far_apart=made["far_apart"] + 1.0)
    (table,) = sections(compare(made, other))["outputs"].tables
    (cells,) = (dict(zip(table.head, row, strict=True)) for row in table.rows
                if row[0] == "far_apart")  # fmt: skip
    # Where neither is worse of any output the column is left out.
    assert cells.get("worse in", "-") == {7: "second", 0: "first", -1: "-"}[worst]
    # Of 0 to 7 the quantile that is drawn is 6.65, or 0.35 where small values are feared.
    panel = next(
        axes for axes in convergence(made).axes
        if axes.get_title("left").startswith("Far_apart")
    )  # fmt: skip
    far = next(x for x in panel.lines if x.get_linestyle() == "--")
    assert far.get_ydata()[-1] == pytest.approx(0.35 if worst == 0 else 6.65)


def test_that_records_miss_what_is_between_them_is_told_where_such_outputs_stand() -> None:
    """Once in each: in an analysis, on both pages, and below verdicts."""
    made = with_own({"max": 5.0})
    every = tomllib.loads(made.attrs["scene"])["record"]["interval"]
    note = f"far_apart is of records every {every:g} s: what happens between two is missed"
    for full in (False, True):
        lines = told(analyse(made), full=full)
        assert [note in line for line in lines].count(True) == 1
    assert verdict_lines(made)[-1] == note
    assert page(made, "runs/made").count(note) >= 1
    cells = [cell for table in dossier(made) for row in table.rows for cell in row if note in cell]
    assert len(cells) == 1
    assert "violate it" in cells[0]
    # What is of numbers alone misses nothing.
    wanted = json.dumps({"twice": {"max": 5.0, **BOUND}})
    plain = made.assign_attrs(requirements=wanted)
    assert not any("of records" in line for line in verdict_lines(plain))


@pytest.mark.quick
def test_a_campaign_may_end_by_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the first look, by hand: all of its samples keep to the bound; and the folder is read."""
    monkeypatch.chdir(tmp_path)
    outputs = 'pull = "max(cable_tension)"'
    more = "[requirements]\npull = { max = 1e3, probability = 0.5, confidence = 0.5 }"
    rule = 'stop_when = [{ requirement = "pull" }, { of = "pull", half_width = 1e3 }]'
    text = FILE.format(outputs=outputs, more=more).replace(
        "samples = 3 }", f"samples = 40 }}\n{rule}"
    )
    text = text.replace('"solver.end_time" = 0.5', '"solver.end_time" = 0.1')
    Path("own.toml").write_text(f"{text}\n[looks]\nfirst = 8\n", encoding="utf-8")
    for verb in ("campaign", "merge", "status"):
        words = ["own.toml", "--workers=0"] if verb == "campaign" else ["runs/own"]
        done = CliRunner().invoke(cli, [verb, *words])
        assert done.exit_code == EXIT_DONE, done.output
    found = xr.load_dataset("runs/own/campaign.nc")
    assert found.sizes["sample"] == found.attrs["stopped_after"] == 8
    np.testing.assert_array_equal(
        found["pull"], found["cable_tension"].max(["plane", "span", "time"])
    )


def test_what_expressions_read_may_be_left_out_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And campaigns that mean two things by one name are not compared by it."""
    monkeypatch.chdir(tmp_path)
    found = []
    for sense in ("max", "min"):
        text = FILE.format(outputs=f'pull = "{sense}(cable_tension)"', more="").replace(
            'name = "own"', f'name = "{sense}"\noutput = {{ leave_out = ["cable_tension"] }}'
        )
        Path("own.toml").write_text(text, encoding="utf-8")
        done = CliRunner().invoke(cli, ["campaign", "own.toml", "--workers=0"])
        assert done.exit_code == EXIT_DONE, done.output
        found.append(xr.load_dataset(f"runs/{sense}/campaign.nc"))
        assert "cable_tension" not in found[-1]
    assert (found[0]["pull"] > found[1]["pull"]).all()
    told = compare(*found)
    assert "pull_difference" not in told
    assert "output pull" in told["setting"].values
    assert "pull_difference" in compare(found[0], found[0])


def _made() -> Iterator[xr.Dataset]:
    """Analyses and comparisons that between them have all that there is."""
    required = {"asynchrony_max": {"max": 3.0, "probability": 0.9, "confidence": 0.9}}
    law = {"x1": {"kind": "uniform", "low": 0.0, "high": 0.9}}

    def drawn(design: Any) -> xr.Dataset:
        return drawn_campaign(design, lambda x: 3 * x[:, 0] + x[:, 1] ** 2, 2, 1)

    yield analyse(drawn(RandomDesign(samples=200)), required, law)
    yield analyse(drawn(Saltelli(samples=512, second_order=True)), required)
    yield analyse(drawn(Morris(samples=60)), required)
    levels = SubsetSimulation(of="asynchrony_max", above=1.0, samples=100, share=0.1, replicates=4)
    first = np.linspace(0.0, 2.0, 100), np.zeros(100, dtype=bool)
    yield analyse(drawn(levels.knowing(levels.responses(*first))))
    many = with_motors(made_campaign(12, failed=(1,), stalled=(4, 6)))
    yield analyse(many)
    yield analyse(many.assign_attrs(design='{"kind": "one-at-a-time"}'))
    yield compare(many, many.assign(asynchrony_max=1.1 * many["asynchrony_max"]))


def test_no_name_is_taken_that_analyses_give_themselves() -> None:
    """All that they make is refused as the name of an output; those of others beside them not."""
    own = quantities().keys()
    names = {str(name) for each in _made() for name in (*each.variables, *each.dims)} - own
    assert len(names) > 250
    free = [name for name in sorted(names) if not _taken(name)]
    assert not free
    assert {"asynchrony_max_same_within", "case_peak_tension", "first_order_index"} <= names
    assert _taken("apart_mean", apart="max(asynchrony)")
    for name in ("apart_mean", "failed_latches", "tail_lag", "input_power", "latch_rate_mean"):
        assert not _taken(name)


def _taken(name: str, **more: str) -> bool:
    try:
        TypeAdapter(derived.Outputs).validate_python({name: "max(asynchrony)", **more})
    except ValidationError as error:
        return "choose another name" in str(error)
    return False


def test_outputs_may_begin_as_other_names_do() -> None:
    """They are from the runs that hold, as all others are; a file of before is still read."""
    made = made_campaign(60)
    force = np.random.default_rng(1).normal(size=60)
    made["rods_young_modulus"][:] = force
    gone = force > 0.5
    made["status"] = made["status"].where(~gone, Status.DIVERGED).astype("i1")
    names = ("failed_latches", "tail_lag", "peak_lower")
    for k, name in enumerate(names):
        made[name] = "sample", np.where(gone, np.nan, (k + 1) * force), {"units": "1"}
    made.attrs["outputs"] = json.dumps({name: {"of": "max(asynchrony)"} for name in names})
    found = analyse(made)
    lines = statistics_table(found).lines()
    for name in names:
        assert any(line.startswith(f"{name} *") for line in lines)
        for ending in ("", "_interval", "_convergence"):
            assert "lost_runs" in found[f"{name}{ending}"].attrs
    assert "lost_runs" not in found["outcome_share"].attrs
    derived.known_from({"outputs": '{"missing": {"of": "max(asynchrony)"}}'})
