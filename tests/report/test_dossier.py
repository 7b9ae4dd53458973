"""The dossier: each number is that of the campaign's file, what is missing is told with what would
supply it, and the terminal, the page and Python tell the same.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import made_campaign, with_motors

from read_page import Page
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.outputs.family import holds
from ringsim.reference import tree
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.report import dossier as subject
from ringsim.report import shell
from ringsim.report.dossier import ECSS, HEAD, NASA, STATES, Answer, Of, dossier, item
from ringsim.scene import load_scene
from test_numbers_told import COUNT, made, near
from told_numbers import (
    File,
    agrees,
    bootstrap,
    bound,
    correlation_interval,
    interval_agrees,
    share_interval,
)

Rows = dict[str, dict[str, str]]


def rows_of(campaign: xr.Dataset, standard: str = ECSS) -> Rows:
    """Rows by their clauses, cells by their heads."""
    table = next(each for each in dossier(campaign) if each.title == standard)
    return {row[0]: dict(zip(HEAD, row, strict=True)) for row in table.rows}


def row(rows: Rows, clause: str) -> dict[str, str]:
    (found,) = [each for name, each in rows.items() if name.endswith(clause)]
    return found


# Each line that has a number is read by one of these, and its numbers are computed anew.


def output(file: File, said: re.Match[str]) -> None:
    name, values = said["name"], file.of(said["name"])
    low, high = (float(end) for end in said["ends"].split(" .. "))
    near(said["ends"], bootstrap(values, "mean"))
    assert abs(float(said["mean"]) - values.mean()) <= 0.051 * (high - low)
    smaller = name.startswith("least")
    assert said["level"] == ("5" if smaller else "95")
    every = np.where(file.ok, file.values[name], 0.0)
    assert int(said["absent"] or 0) == int(np.isnan(every).sum())
    agrees(said["far"], np.quantile(values, 0.05 if smaller else 0.95))
    agrees(said["worst"], values.min() if smaller else values.max())
    assert int(said["sample"]) == file.worst(name)[0]
    for unit in (said["unit"], said["unit2"], said["unit3"]):
        assert unit.strip() == ("" if file.units[name] == "1" else file.units[name])


def ending(file: File, said: re.Match[str]) -> None:
    own, _ = file.group(said["name"])
    total, gone = int((file.ok | file.lost).sum()), int(file.lost.sum())
    count, more = int(own.sum()), 0 if said["name"].startswith("failed") else gone
    assert (int(said["count"]), int(said["of"]), int(said["gone"] or 0)) == (count, total, more)
    ends = share_interval(count, total)[0], share_interval(count + more, total)[1]
    interval_agrees(said["ends"], ends)


def requirement(file: File, said: re.Match[str]) -> None:
    (name,) = [each for each in file.wanted if file.text(each) == said["text"]]
    share, level = file.wanted[name]["probability"], file.wanted[name]["confidence"]
    assert (float(said["share"]), float(said["level"])) == (share, level)
    bad, lost, used = int(file.violating(name).sum()), int(file.lost.sum()), int(file.ok.sum())
    run = used + lost
    ends = bound(run - bad - lost, run, level)[0], bound(run - bad, run, level)[1]
    word = "met" if ends[0] >= share else "not met" if ends[1] < share else "not yet shown"
    assert said["verdict"] == word
    told = dict(re.findall(r"(at least|at most) ([\d.]+)", said["bound"]))
    assert told.keys() == {
        "met": {"at least"}, "not met": {"at most"}, "not yet shown": {"at least", "at most"},
    }[word]  # fmt: skip
    for side, end in zip(("at least", "at most"), ends, strict=True):
        assert float(told.get(side, end)) == pytest.approx(end, rel=1e-3)


def violating(file: File, said: re.Match[str]) -> None:
    assert int(said["bad"]) == int(file.violating(said["name"]).sum())
    assert (int(said["of"]), int(said["lost"] or 0)) == (int(file.ok.sum()), int(file.lost.sum()))


def samples(file: File, said: re.Match[str]) -> None:
    names = (said["names"] or "deployment_time").split(", ")
    if said["names"]:
        assert {len(file.of(name)) for name in names} == {int(said["count"])}
    assert int(said["of"]) == int((file.ok | file.lost).sum())
    ended_short = file.ok & np.isin(file.values["outcome"], [2, 3, 5, 6, 8, 9])
    if said["names"]:
        ended_short &= np.isfinite(file.values[names[0]])
        assert int(said["short"] or 0) == int(ended_short.sum())
    assert int(said["short"] or 0) <= int(ended_short.sum())
    if said["bar"]:
        bars = np.where(file.ok, file.values["peak_tension_error"], np.nan)
        assert int(said["bars"]) == int(np.isfinite(bars).sum())
        assert float(said["bar"]) == pytest.approx(np.nanmax(bars), rel=0.051)
        assert int(said["sample"]) == int(np.nanargmax(bars))


def place(file: File, said: re.Match[str]) -> None:
    k = file.worst("least_drive_margin")[0]
    assert int(said["sample"]) == k
    for word in ("angle", "time"):
        agrees(said[word], file.values[f"least_drive_margin_{word}"][k], 3)


def short(file: File, said: re.Match[str]) -> None:
    values = file.of("least_drive_margin")
    assert (int(said["count"]), int(said["of"])) == (int((values < 0).sum()), len(values))
    assert bool(said["not"]) == bool((values < 0).any())


def rigid(file: File, said: re.Match[str]) -> None:
    margin = file.of("least_drive_margin")
    at_rest = np.isin(file.values["outcome"][file.ok], [2, 3])
    assert (int(said["count"]), int(said["of"])) == (((margin >= 0) & at_rest).sum(), len(margin))


def tolerance(file: File, said: re.Match[str]) -> None:
    assert float(said["most"]) == file.scene["solver"]["energy_tolerance"]


def balance(file: File, said: re.Match[str]) -> None:
    assert said["name"] == file.words["energy_error"]
    values = np.where(file.ok, file.values["energy_error"], np.nan)
    assert float(said["median"]) == pytest.approx(np.nanmedian(values), rel=0.051)
    assert float(said["most"]) == pytest.approx(np.nanmax(values), rel=0.051)
    assert int(said["sample"]) == int(np.nanargmax(values))


def worst(file: File, said: re.Match[str]) -> None:
    own, run = file.group(said["name"])[0], file.ok | file.lost
    assert (int(said["count"]), int(said["of"])) == (int(own.sum()), int(run.sum()))
    assert own[int(said["sample"])]


def matters(file: File, said: re.Match[str]) -> None:
    value = file.partial(said["output"], said["input"])
    count = len(file.of(said["output"]))
    assert abs(float(said["value"]) - value) < 0.0051
    ends = correlation_interval(value, count, len(file.inputs) - 1)
    interval_agrees(said["ends"], ends, digits=2)


def drawn(file: File, said: re.Match[str]) -> None:
    values = file.input(said["name"])[file.ok | file.lost]
    assert float(said["low"]) == pytest.approx(values.min(), rel=1e-4)
    assert float(said["high"]) == pytest.approx(values.max(), rel=1e-4)


def summed(file: File, said: re.Match[str]) -> None:
    parts = [int(each) for each in re.findall(r"(\d+) [a-z]", said["parts"])]
    assert sum(parts) == int(said["count"])


def setting(file: File, said: re.Match[str]) -> None:
    value: object = file.scene
    for key in said["path"].split("."):
        assert isinstance(value, dict)
        value = value[key]
    assert json.dumps(value) == said["value"]


def held(file: File, said: re.Match[str]) -> None:
    assert int(said["count"]) == int(file.ok.sum())


def complete(file: File, said: re.Match[str]) -> None:
    assert {int(said["count"]), int(said["of"])} == {COUNT}


def sampling(file: File, said: re.Match[str]) -> None:
    """Of outputs that have error bars, which err alike: their root mean square."""
    values, bars = file.of("peak_tension"), file.of("peak_tension_error")
    less = np.sqrt(np.mean(bars**2)) < values.std(ddof=1) / np.sqrt(len(values))
    assert int(said["count"]) == int(less) == 1


def anything(file: File, said: re.Match[str]) -> None:
    """Words without a number of the samples: names, laws, versions, the scene's own values."""


N, U = r"[-+\d.e]+", r"(?: [a-zA-Z][\w ]*?)?"
KNOWN = {
    rf"(?P<name>\w+)(?: \*)?: mean (?P<mean>{N})(?P<unit>{U}) \(interval (?P<ends>.+?)\); "
    rf"(?P<level>5|95) % quantile (?P<far>{N})(?P<unit2>{U}); worst (?P<worst>{N})(?P<unit3>{U})"
    r" in sample (?P<sample>\d+)(?:; (?P<absent>\d+) samples? without a value)?": output,
    r"(?P<name>[a-z :]+): (?P<count>\d+) of (?P<of>\d+)(?: \((?P<gone>\d+) failed\))?, share \S+ "
    r"\(interval (?P<ends>.+)\)": ending,
    r"(?P<text>.+) in at least (?P<share>\S+) of all \(confidence (?P<level>\S+)\): "
    r"(?P<verdict>[a-z ]+); share that meets it: (?P<bound>.+)": requirement,
    r"(?P<name>\w+): (?P<bad>\d+) of (?P<of>\d+) samples violate it(?:, (?P<lost>\d+) failed)?"
    r"(?:; \d+ more without a violation would prove it)?": violating,
    r"(?:(?P<names>[\w, ]+): )?(?P<count>\d+) of (?P<of>\d+) samples"
    r"(?:, (?P<short>\d+) of them not deployed, as they ended)?(?:; largest of (?P<bars>\d+) "
    rf"error bars: (?P<bar>{N}) N \(sample (?P<sample>\d+)\))?": samples,
    rf"in sample (?P<sample>\d+) it is least at (?P<angle>{N}) deg, (?P<time>{N}) s": place,
    r"in (?P<count>\d+) of (?P<of>\d+) samples the least drive margin is enough and the ring came "
    r"to rest before .*": rigid,
    r"below 0 in (?P<count>\d+) of (?P<of>\d+) samples(?P<not>: NOT enough)?": short,
    rf"(?P<name>.*imbalance.*): median (?P<median>{N}), largest (?P<most>{N}) "
    r"\(sample (?P<sample>\d+)\)": balance,
    r"(?P<name>.+) \((?P<count>\d+) of (?P<of>\d+) samples?\): worst sample (?P<sample>\d+), .*":
        worst,
    rf"(?P<output>\w+) most by (?P<input>[\w.]+): .*partial rank correlation (?P<value>{N}) "
    r"\((?P<ends>.+)\)": matters,
    rf"(?P<name>[\w.]+): uniform, low 0, high 1; values: (?P<low>{N}) to (?P<high>{N}) m": drawn,
    r"(?P<count>\d+) values: (?P<parts>.+)": summed,
    r"(?P<path>[\w.]+) = (?P<value>.+), set by the campaign": setting,
    r"(peak_tension): largest of .*": anything,  # as in its row
    r"(?P<count>\d+) samples": held,
    rf"a run is refused whose imbalance exceeds (?P<most>{N})": tolerance,
    r"(?P<count>\d+) of (?P<of>\d+) samples have run": complete,
    r"largest part of the error of the mean is sampling: (?P<count>\d+) outputs?": sampling,
    r"95 % intervals: .*|\d+ of \d+ runs failed, .*": anything,
    r"static margin at all angles passed.*|(sources|identity|ringsim version|git commit|seed) .*|"
    r"(python|exudyn) version .*": anything,
}  # fmt: skip


@pytest.fixture(scope="module", params=["violating", "lost"])
def stored(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[File, xr.Dataset]:
    path = tmp_path_factory.mktemp("dossier") / "campaign.nc"
    save(made(request.param), path)
    return File(path), xr.load_dataset(path)


def test_every_number_is_that_of_the_file(stored: tuple[File, xr.Dataset]) -> None:
    file, campaign = stored
    read = dict.fromkeys(KNOWN.values(), 0)
    for table in dossier(campaign):
        for *_, result, evidence in table.rows:
            for line in (*result.splitlines(), *evidence.splitlines()):
                if line.startswith("Missing: ") or not re.search(r"\d", line):
                    continue
                found = ((check, re.fullmatch(form, line)) for form, check in KNOWN.items())
                said = [(check, each) for check, each in found if each is not None]
                assert said, line
                said[0][0](file, said[0][1])
                read[said[0][0]] += 1
    at_rest = np.isin(file.values["outcome"][file.ok], [2, 3])
    told = bool((at_rest & (file.of("least_drive_margin") >= 0.0)).any())
    assert bool(read.pop(rigid)) == told
    assert all(read.values()), {check.__name__: count for check, count in read.items()}


@pytest.mark.quick
@pytest.mark.parametrize(("latest", "fails"), [(0.004, False), (0.05, True)])
def test_a_winch_that_starts_late_is_a_failure_and_a_tolerance_is_none(
    latest: float, fails: bool
) -> None:
    """Of the time that runs take, so much at most."""
    campaign, path = made_campaign(8), "cables.lower.winch.start_time"
    stops = [n for n, v in campaign.items() if "stop_time" in v.attrs.get("path", "")]
    campaign = campaign.drop_vars(stops)
    starts = np.linspace(0.0, latest, 8) * np.median(campaign["final_time"])
    about = {"role": "input", "path": path, "units": "s", "distribution": "uniform"}
    made = campaign.assign(late=("sample", starts, about))
    own = row(rows_of(made), "Failure cases")
    assert ("start_time" in own["result"]) == fails
    assert own["state"] == ("in part" if fails else "not analysed")
    assert "Missing: failures (draw faults under [inputs], or " in own["result"]


@pytest.mark.quick
def test_what_a_campaign_lacks_is_missing_with_its_cure() -> None:
    """Neither motors, latches, allowables, temperatures nor a test."""
    ecss, nasa = rows_of(made_campaign()), rows_of(made_campaign(), NASA)
    lacking = ("Thermal design", "Loads", "motorization)", "Latching or locking", "Shock", "Test",
               "Tolerance budget", "Other analyses")  # fmt: skip
    for own in (row(ecss, clause) for clause in lacking):
        assert own["state"] == "not analysed"
        lines = own["result"].splitlines()
        assert all(re.fullmatch(r"Missing: .+ \(.+\)", line) for line in lines)
        assert own["evidence"] == ""
    assert row(ecss, "Margin of safety")["state"] == "in part"
    assert row(ecss, "Integrity check")["state"] == "analysed"
    assert row(nasa, "verification (second-hand)")["state"] == "in part"
    assert {"factor 6, use history (second-hand)", "factor 8, people (second-hand)"} <= {
        clause for clause, own in nasa.items() if own["state"] == "not analysed"
    }


@pytest.mark.quick
def test_error_bars_of_a_list_of_cases_are_told_although_it_has_no_means() -> None:
    campaign = made_campaign(4)
    campaign.attrs["design"] = json.dumps({"kind": "list", "file": "cases.csv"})
    bars = np.array([0.1, np.nan, 0.4, 0.2])
    campaign["asynchrony_max_error"] = "sample", bars, {"units": "degree"}
    nasa = rows_of(campaign, NASA)
    own = row(nasa, "verification (second-hand)")["result"].splitlines()
    assert "asynchrony_max: largest of 3 error bars: 0.4 deg (sample 2)" in own
    assert not any("error bars (error_bars_every)" in line for line in own)
    uncertain = row(nasa, "results uncertainty (second-hand)")["result"]
    assert "numerical errors" not in uncertain
    campaign = campaign.drop_vars("asynchrony_max_error")
    for name in [n for n in campaign if str(n).endswith("_error") and n[:-6] in campaign]:
        campaign = campaign.drop_vars(name)
    nasa = rows_of(campaign, NASA)
    assert "error bars (error_bars_every)" in row(nasa, "verification (second-hand)")["result"]
    assert "numerical errors (" in row(nasa, "results uncertainty (second-hand)")["result"]


@pytest.mark.quick
def test_of_one_change_each_the_farthest_is_told() -> None:
    campaign = made_campaign(4)
    campaign.attrs["design"] = json.dumps({"kind": "one-at-a-time"})
    campaign["asynchrony_max"] = "sample", np.array([5.0, 6.0, 2.0, 5.0]), {"units": "degree"}
    named = [n for n, v in campaign.variables.items() if v.attrs.get("role") == "input"]
    told = row(rows_of(campaign), "Sensitivity analysis")["result"]
    (line,) = (li for li in told.splitlines() if li.startswith("asynchrony_max"))
    assert line.startswith("asynchrony_max: 5 deg in the base case, farthest 2 deg with ")
    assert any(str(campaign[n].attrs.get("path") or n) in line for n in named)


@pytest.mark.quick
def test_a_key_that_is_set_is_no_cure() -> None:
    """Nothing carries a ring on a free base without a spacecraft, whose rotation is recorded."""
    campaign = made_campaign(4)
    on = "record.reactions = true"
    carries, free = 'boom.base = "fixed" or [spacecraft]', 'boom.base = "free"'
    for base, records, force, rotation in (
        ("free", False, f"{carries}, {on}", on),
        ("free", True, carries, "no sample has a value"),
        ("fixed", False, on, f"{free}, {on}"),
        ("fixed", True, "no sample has a value", free),
    ):
        values = {"boom.base": base, "record.reactions": records}
        scene = load_scene("ring18-cable").with_values(values)
        campaign.attrs["scene"] = scene.to_toml()
        lines = row(rows_of(campaign), "Loads")["result"].splitlines()
        assert f"Missing: peak_base_force ({force})" in lines
        assert f"Missing: base_rotation_max ({rotation})" in lines
        assert ("held base or spacecraft" in holds(scene)) == ("[spacecraft]" not in force)


@pytest.mark.quick
def test_rates_of_latches_by_section_and_antennas_without_cables_are_told() -> None:
    campaign = made_campaign(4).assign(least_latch_rate=("sample", np.array([0.2, 0.3, 0.1, 0.4])))
    scene = campaign.attrs["scene"]
    assert "[latch]" not in scene
    campaign.attrs["scene"] = f"{scene}\n[latch]\nmin_rate = [0.05, 0.06, 0.05, 0.06]\n"
    told = row(rows_of(campaign), "Latching or locking")["evidence"]
    assert "rate from which a latch catches, rad/s: [0.05, 0.06, 0.05, 0.06]" in told
    without = row(rows_of(campaign.drop_vars("peak_tension")), "Margin of safety")["result"]
    assert "limits.tension" not in without
    assert "limits.tension" in row(rows_of(campaign), "Margin of safety")["result"]


@pytest.mark.quick
def test_a_field_that_is_drawn_is_told_as_it_was_drawn() -> None:
    """Not as the scene has it: factors of the margin, the rate of latches, the lines of a stand."""
    campaign = with_motors(made_campaign(6))
    campaign["least_drive_margin_time"] = campaign["least_drive_margin"] * 0.0
    campaign["least_drive_margin_angle"] = campaign["least_drive_margin_time"] + 20.0
    campaign["latched_joints"] = "sample", [36] * 6
    scene = load_scene("ring18-motor").with_values(
        {"latch": {"peak_torque": 0.1, "min_rate": 0.01}, "gravity.vector": [0.0, 0.0, -9.81],
         "offload": {"planes": "upper", "friction": 0.002}}
    )  # fmt: skip
    campaign.attrs["scene"] = scene.to_toml()
    for path, low, high in (
        ("latch.min_rate", 0.04, 0.05),
        ("margin.friction", 1.5, 2.0),
        ("offload.friction", 0.004, 0.006),
    ):
        says = {"role": "input", "path": path, "units": "1", "distribution": "{}"}
        campaign[path.replace(".", "_")] = "sample", np.linspace(low, high, 6), says
    rows = rows_of(campaign)
    told = row(rows, "Latching or locking")["evidence"]
    assert "rate from which a latch catches, rad/s: 0.04 .. 0.05 (drawn)" in told
    assert "friction 1.5 .. 2 (drawn)" in row(rows, "(motorization)")["evidence"]
    told = row(rows, "4.8.2.1 Cases")["result"]
    assert "offload.friction = 0.004 .. 0.006 (drawn)" in told
    assert 'offload.planes = "upper"' in told


def test_temperatures_are_told_with_what_became_of_the_antennas_and_remarks_of_runs_too() -> None:
    campaign = made_campaign(4)
    law = json.dumps({"kind": "uniform", "low": 210.0, "high": 310.0})
    says = {"role": "input", "path": "", "input": "cold", "units": "K", "distribution": law}
    campaign["cold"] = "sample", np.array([220.0, 250.0, 280.0, 300.0]), says
    campaign["reason"] = "sample", np.array(["all open; friction is smoothed"] * 4, dtype=object)
    own = row(rows_of(campaign), "Thermal design")
    assert own["state"] == "in part"
    assert "values: 220 to 300 K" in own["result"]
    assert "deployed: 4 of 4" in own["result"]
    assert "Missing: gradients" in own["result"]
    evidence = row(rows_of(campaign), "Integrity check")["evidence"]
    assert "in all 4 samples, for example in sample 0: friction is smoothed" in evidence
    told = row(rows_of(campaign, NASA), "results uncertainty (second-hand)")["evidence"]
    assert "largest part of the error of the mean" not in told  # nothing but sampling is known


@pytest.mark.quick
def test_every_key_of_a_cure_exists() -> None:
    known = {*tree.paths("scene"), *tree.paths("campaign")}
    text = "\n".join(
        line for standard in (ECSS, NASA) for own in rows_of(made_campaign(), standard).values()
        for line in own["result"].splitlines() if line.startswith("Missing: ")
    )  # fmt: skip
    tables = "record|limits|margin|stop|boom|temperature|rods|structure|design"
    named = set(re.findall(rf"\b((?:{tables})(?:\.[a-z_]+)+)", text))
    named |= set(re.findall(r"\b(check_every|error_bars_every|requirements)\b", text))
    assert len(named) >= 12
    kinds = {"design.kind", "margin.kind"}  # which no record has as a field of its family
    assert named - kinds <= known | {path.rpartition(".")[0] for path in known}


@pytest.mark.quick
def test_more_of_a_campaign_is_analysed_once_it_has_it() -> None:
    campaign = with_motors(made_campaign(12))
    scene = campaign.attrs["scene"].replace("[limits]\n", "[limits]\ntension = 80.0\n", 1)
    scene += '\n[margin]\nkind = "ecss-e-st-33-01c"\nfriction = 3.0\n'
    campaign.attrs["scene"] = scene
    for place in ("angle", "time"):
        campaign[f"least_drive_margin_{place}"] = "sample", 20.0 + np.arange(12.0)
    law = json.dumps({"kind": "uniform", "low": 220.0, "high": 330.0})
    warm = {"role": "input", "path": "temperature.joint.value", "units": "K", "distribution": law}
    campaign["temperature_joint_value"] = "sample", np.linspace(225.0, 325.0, 12), warm
    long = warm | {"path": "rods.length_error.upper_bar", "units": "1"}
    campaign["rods_length_error_upper_bar"] = "sample", np.linspace(-1e-4, 1e-4, 12), long
    rows = rows_of(campaign)
    drive = row(rows, "motorization)")
    assert drive["state"] == "analysed"
    assert "worst -0.5 in sample 0" in drive["result"]
    assert "in sample 0 it is least at 20 deg, 20 s" in drive["result"]
    assert "below 0 in 5 of 12 samples: NOT enough" in drive["result"]  # -0.5 + 0.1 k
    assert "friction 3.0" in drive["evidence"]
    assert "values: 225 to 325 K" in row(rows, "Thermal design")["result"]
    assert "upper_bar" in row(rows, "Tolerance budget")["result"]
    # 80 N over 20 + 11 N, less 1.
    strength = row(rows, "Margin of safety")
    assert "limits.tension = 80 N: margin +1.58" in strength["result"]
    assert "of cables against rupture 3" in strength["result"]
    campaign.attrs["scene"] = scene.replace("ecss-e-st-33-01c", "nasa-std-5017b")
    assert row(rows_of(campaign), "motorization)")["state"] == "in part"


@pytest.mark.quick
def test_each_clause_gives_the_verdicts_on_the_outputs_that_it_names() -> None:
    campaign = made_campaign(8).assign(peak_latch_rate=("sample", np.linspace(0.2, 0.9, 8)))
    about = {"probability": 0.5, "confidence": 0.9}
    wanted = {"deployment_time": 99.0, "asynchrony_max": 1.0, "peak_latch_rate": 0.6}
    limits = {name: about | {"max": most} for name, most in wanted.items()}
    campaign.attrs["requirements"] = json.dumps(limits)
    rows = rows_of(campaign)
    for clause, name in (
        ("Mechanism function", "deployment_time"), ("Mechanism function", "asynchrony_max"),
        ("Shock", "peak_latch_rate"),
    ):  # fmt: skip
        said = [line for line in row(rows, clause)["result"].splitlines() if name in line]
        assert said[0].startswith(f"{name}: ")
        assert said[1].startswith(f"{name} <= {wanted[name]:g} ")
        assert f"{name}: " in row(rows, clause)["evidence"]
    found = row(rows, "Shock")
    assert "in at least 0.5 of all (confidence 0.9): not yet shown" in found["result"]
    assert "peak_latch_rate: 3 of 8 samples violate it" in found["evidence"]


@pytest.mark.quick
def test_a_margin_from_the_start_of_the_last_winch_on_has_its_own_count_and_verdict() -> None:
    campaign = with_motors(made_campaign(12))
    for place in ("angle", "time"):
        campaign[f"least_drive_margin_{place}"] = "sample", 20.0 + np.arange(12.0)
    name = "least_drive_margin_started"
    campaign[f"{name}_angle"] = "sample", np.full(12, 25.0)
    campaign[name] = campaign["least_drive_margin"] + 0.3
    said = row(rows_of(campaign), "motorization)")["result"].splitlines()
    assert "below 0 in 5 of 12 samples: NOT enough" in said
    assert f"{name}: below 0 in 2 of 12 samples: NOT enough" in said
    about = {"min": 0.0, "probability": 0.9, "confidence": 0.9}
    campaign.attrs["requirements"] = json.dumps({name: about})
    own = row(rows_of(campaign), "motorization)")
    assert f"{name} >= 0 in at least 0.9 of all" in own["result"]
    assert f"{name}: 2 of 12 samples violate it" in own["evidence"]
    # Where all winches start at once both are the same, and one is told.
    campaign.attrs["requirements"] = "{}"
    campaign[name] = campaign["least_drive_margin"]
    assert name not in row(rows_of(campaign), "motorization)")["result"]


@pytest.mark.quick
def test_values_of_a_scene_of_ones_own_may_be_defaults() -> None:
    campaign = made_campaign(4)

    def told() -> str:
        own = row(rows_of(campaign, NASA), "input pedigree (second-hand)")
        return own["result"].splitlines()[0]

    assert " of the scene's file, " in told()
    assert re.search(r"\d defaults of ringsim$", told())
    campaign.attrs["campaign"] = campaign.attrs["campaign"].replace("ring18-cable", "mine.toml")
    assert told().endswith(" of the scene's file or defaults of ringsim")


@pytest.mark.quick
def test_both_engines_are_told_apart() -> None:
    campaign = made_campaign(8)
    own = {name: campaign[name].copy(deep=True) for name in ("status", "outcome", "peak_tension")}
    checked = np.arange(8) % 4 == 0
    campaign["status_checked"] = own["status"].where(checked, -1).astype("i1")
    campaign["outcome_checked"] = own["outcome"].where(checked, -1).astype("i1")
    campaign["reason_checked"] = "sample", np.full(8, "")
    apart = 0.25 + 0.25 * (np.arange(8) == 4)
    campaign["peak_tension_checked"] = own["peak_tension"].where(checked) + apart
    strength = row(rows_of(campaign), "Margin of safety")["evidence"]
    assert "largest of 2 engine differences: 0.5 N (sample 4)" in strength
    sure = row(rows_of(campaign, NASA), "verification (second-hand)")
    assert "2 samples answered by both engines" in sure["evidence"]
    assert "check_every" not in sure["result"]


@pytest.mark.quick
def test_an_item_is_one_record(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "ITEMS", [*subject.ITEMS])

    @item(ECSS, "4.7.5.4.10 Threads", "Are they locked?")
    def threads(of: Of) -> Answer:
        return Answer(["locked"], ["by wire"], {"torque": "measure it"})

    clauses = list(rows_of(made_campaign()))
    at = clauses.index("4.7.5.4.10 Threads")
    assert clauses[at - 1].startswith("4.7.5.4.3")
    assert clauses[at + 1].startswith("4.8.2.1")
    own = rows_of(made_campaign())["4.7.5.4.10 Threads"]
    assert own["state"] == "in part"
    assert own["result"].splitlines() == ["locked", "Missing: torque (measure it)"]
    assert own["evidence"] == "by wire"


@pytest.mark.quick
def test_the_terminal_the_page_and_python_tell_the_same(tmp_path: Path) -> None:
    campaign = made_campaign(8, failed=(2,), stalled=(4,))
    save(campaign, tmp_path / "campaign.nc")
    page = tmp_path / "out.html"
    done = CliRunner().invoke(cli, ["dossier", str(tmp_path), "--out", str(page)])
    assert done.exit_code == EXIT_DONE, done.output
    with xr.open_dataset(tmp_path / "campaign.nc") as stored:
        frames = stored.ring.dossier()
    assert list(frames) == [ECSS, NASA]
    text = page.read_text(encoding="utf-8")
    found, told = Page(text), " ".join(done.output.split())
    assert f"wrote {page}" in done.output
    for frame in frames.values():
        assert list(frame.columns) == list(HEAD)
        assert set(frame["state"]) <= set(STATES)
        for cells in frame.to_numpy().tolist():
            for cell in cells:
                assert cell.replace("\n", "") in found.cells
                assert all(" ".join(line.split()) in told for line in cell.splitlines())
        assert all(" ".join(note.split()) in told for note in frame.attrs["notes"])
    assert max(map(len, done.output.splitlines()[:-1])) <= 100
    assert not re.search(r"https?:|@import|url\(", text)
    assert found.loads == []
    # The title is <&>, and a reason has </script>: both are text.
    assert "Made by hand &lt;&amp;&gt; quoted" in text
    assert "</script>" not in text


@pytest.mark.quick
def test_what_cannot_be_told_is_refused_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = made_campaign(4)
    save(campaign, tmp_path / "campaign.nc")
    save(campaign.isel(sample=0, drop=True), tmp_path / "run.nc")
    bare = campaign.copy()
    bare.attrs = {name: value for name, value in campaign.attrs.items() if name != "campaign"}
    save(bare, tmp_path / "bare.nc")
    monkeypatch.setattr(shell.shutil, "which", lambda _: None)
    none = tmp_path / "none"
    for words, said in (
        ([str(none)], str(none)),
        ([str(tmp_path / "run.nc")], "this is not a campaign"),
        ([str(tmp_path / "bare.nc")], "this is not a campaign"),
        ([str(tmp_path), "--out", "d.txt"], "--out d.txt: the page is HTML"),
        ([str(tmp_path), "--out", str(none / "d.html")], str(none)),
        ([str(tmp_path), "--out", str(tmp_path / "d.html"), "--pdf"], "--pdf: needs a browser"),
    ):
        done = CliRunner().invoke(cli, ["dossier", *words])
        assert done.exit_code == EXIT_BAD_INPUT, words
        assert said in done.output
        assert len(done.output.strip().splitlines()) == 1
    assert not (tmp_path / "d.html").exists()
