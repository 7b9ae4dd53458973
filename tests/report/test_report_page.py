"""The report is whole: one well-formed page that loads nothing and hides no sample."""

from __future__ import annotations

import base64
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import SECTIONS, TIMES, made_campaign, made_scene, with_positions
from matplotlib.figure import Figure

from read_page import Page
from ringsim.analysis.campaign_notes import outcome_lines
from ringsim.analysis.influence_text import sensitivity_tables, what_matters
from ringsim.analysis.intervals import share_interval
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import (
    digits_of,
    error_tables,
    every_statistic,
    statistics_table,
    told,
)
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.layout.layout import layout_of
from ringsim.layout.points import points_of
from ringsim.overrides import pulleys_at
from ringsim.plots import figures as of_campaigns
from ringsim.plots.ring import lines_at
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.report import page as model
from ringsim.report import shell
from ringsim.report.page import page
from ringsim.report.player import player
from ringsim.report.shell import LARGEST, Sheet, filling
from ringsim.scene import load_scene
from ringsim.shapes import COMPUTED, FROM_ANGLES
from ringsim.tables import interval_text, number_text, slim

KINDS = {
    "mixed": {"failed": (2, 5), "stalled": (4,), "not_run": (7,)},
    "good": {},
    "lost": {"failed": tuple(range(8))},
}


@pytest.fixture
def _undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without figures and player, where words and tables are what matters."""
    monkeypatch.setattr(of_campaigns, "PICTURES", [])
    monkeypatch.setattr(model, "player", lambda *_: None)


@pytest.fixture(scope="module", params=KINDS)
def made(request: pytest.FixtureRequest) -> tuple[str, xr.Dataset, str]:
    campaign = made_campaign(8, **KINDS[request.param])
    return request.param, campaign, page(campaign, "runs/made here")


def test_the_page_is_well_formed_small_and_loads_nothing(
    made: tuple[str, xr.Dataset, str],
) -> None:
    text = made[2]
    found = Page(text)
    assert len(text.encode()) < LARGEST
    assert len(found.ids) == len(set(found.ids))
    assert all(load.startswith(("#", "data:image/png;base64,")) for load in found.loads)
    assert not re.search(r"https?:|@import|url\((?!#)", text)
    own = {load[1:] for load in found.loads if load.startswith("#")}
    own |= set(re.findall(r"url\(#([^)]+)\)", text))
    assert own <= set(found.ids)


def test_every_figure_and_section_is_there(made: tuple[str, xr.Dataset, str]) -> None:
    kind, _, text = made
    ids = set(Page(text).ids)
    own = [each for each in of_campaigns.PICTURES if each.of == "campaign"]
    held = [
        each for each in own
        if set(each.needs) <= set(made[1])
        and all(np.isfinite(made[1][name]).any() for name in each.needs[:1])
    ]  # fmt: skip
    figures = {f"figure-{each.name}" for each in held} - {"figure-rare_event", "figure-one_by_one"}
    figures -= {"figure-tornado"} if kind == "mixed" else set()  # of too few samples
    assert ids & figures == ({"figure-by_input"} if kind == "lost" else figures)
    sections = {"outcomes", "figures", "failures", "inputs", "model", "provenance"}
    sections |= set() if kind == "lost" else {"statistics", "errors"}
    assert sections | {"requirements", "player", "evidence"} <= ids


def test_the_answer_comes_before_failures_and_what_it_is_from(
    made: tuple[str, xr.Dataset, str],
) -> None:
    kind, _, text = made
    order = ["requirements", "outcomes", *(["statistics"] if kind != "lost" else []), "figures"]
    order += ["failures", "player", "evidence", "inputs", "model", "provenance"]
    places = [text.index(f'<section id="{name}">') for name in order]
    assert places == sorted(places)
    # Figures that answer stand before the evidence, three at most; all others within it.
    figures = [(text.index(f'id="figure-{n}"'), n) for n in re.findall(r'id="figure-(\w+)"', text)]
    first = [name for at, name in sorted(figures) if at < places[order.index("evidence")]]
    # What matters has its figure beside its table.
    if "tornado" in first:
        assert text.index('<section id="matters">') < text.index('id="figure-tornado"')
        first.remove("tornado")
    assert first == [name for _, name in sorted(figures) if name != "tornado"][:3]
    answers = [name for name in ("distributions", "fan") if f"figure-{name}" in text]
    assert [name for name in first if name in answers] == answers
    # What is evidence is folded.
    assert not re.search(r"<details[^>]* open", text)


def test_the_page_has_no_figure_of_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    own = [each for each in of_campaigns.PICTURES if each.name == "tornado"]
    monkeypatch.setattr(of_campaigns, "PICTURES", own)
    assert 'id="figure-tornado"' in page(made_campaign(30), "runs/made")
    campaign = made_campaign(30)
    dice = np.random.default_rng(5)
    for name in ("asynchrony_max", "peak_tension", "deployment_time"):
        campaign[name] = "sample", 1.0 + dice.random(30)
    text = page(campaign, "runs/made")
    assert "o significant input" in text
    assert 'id="figure-tornado"' not in text


def test_a_page_that_would_be_too_large_has_pictures_for_lines(monkeypatch) -> None:
    own = [each for each in of_campaigns.PICTURES if each.name == "distributions"]
    monkeypatch.setattr(of_campaigns, "PICTURES", own)
    campaign = made_campaign(8)
    lines = page(campaign, "runs/made")
    monkeypatch.setattr(shell, "LARGEST", len(lines.encode()) - 1)
    smaller = page(campaign, "runs/made")
    assert lines.count("<svg") > smaller.count("<svg")
    assert lines.count("<figure") == smaller.count("<figure")


def test_failures_and_violations_have_their_replay_commands(
    made: tuple[str, xr.Dataset, str],
) -> None:
    kind, campaign, text = made
    cells = Page(text).cells
    short = {*KINDS[kind].get("failed", ()), *KINDS[kind].get("stalled", ())}
    apart = np.where(campaign["status"] == 0, campaign["asynchrony_max"], 0.0)
    violating = [int(k) for k in np.argsort(-apart)[:3] if apart[k] > 3.0]
    commands = {cell for cell in cells if cell.startswith("ringsim replay")}
    wanted = {*violating, *(() if kind == "lost" else short)}
    assert {f"ringsim replay 'runs/made here' {k}" for k in wanted} <= commands
    assert len(violating) == (0 if kind == "lost" else 3)
    # Whatever fell short or violates something is told, and no sentence denies it.
    assert ("No run ended short of its goal" in text) == (kind == "good")
    assert ("those above violate a requirement" in " ".join(text.split())) == (kind == "good")
    names = re.findall(r"<h3>(Violates .*|Stalled .*|Failed: .*)</h3>", text)
    assert len(names) == {"good": 1, "mixed": 3, "lost": 1}[kind]
    for k in KINDS[kind].get("failed", ()):
        assert f"broke </script> at 4 s in sample {k}" in cells


def test_the_tables_hold_the_numbers(made: tuple[str, xr.Dataset, str]) -> None:
    kind, campaign, text = made
    if kind != "mixed":
        return
    cells = Page(text).cells
    good = campaign["peak_tension"].values[[0, 1, 3, 4, 6]]
    at = cells.index("peak_tension", cells.index("std. dev."))
    assert cells[at + 1 : at + 3] == ["N", f"{good.mean():.4g}"]
    row = cells[at : at + len(statistics_table(analyse(campaign)).head)]
    assert {"20", "26", "6", "5 of 7"} <= set(row)
    # Shares of outcomes have intervals, those of the analysis.
    at = cells.index("deployed")
    low, high = share_interval(4, 7)[0], share_interval(6, 7)[1]
    assert cells[at + 1 : at + 4] == [
        "4 of 7 (2 failed)", f"{4 / 7:.2f}", f"{low:.2f} .. {high:.2f}"
    ]  # fmt: skip
    at = cells.index("outcome is deployed")
    assert cells[at + 6 : at + 9] == ["5", "1", "2"]


def test_samples_that_ended_alike_share_a_row_and_words_have_no_unit() -> None:
    campaign = made_campaign(30, failed=(2,), stalled=tuple(range(5, 30)))
    # What steps leave uncertain parts no rows, and is told elsewhere.
    campaign["reason"] = campaign["reason"].astype(object)
    for k, name in ((5, "peak_latch_rate"), (6, "least_latch_rate"), (7, "peak_tension")):
        campaign["reason"][k] += (
            f"; steps of {k} ms at the lock at 9 s are too long for the rate at which a latch is "
            f"met, so {name} may be off: set solver.tolerance = 1e-05 (2 to 3 times the steps)"
        )
    assert not any("too long" in line for line in outcome_lines(campaign))
    rows, more = model.failures(campaign, "made")
    assert [row[1] for row in rows] == ["failed: timeout (time limit)", "stalled"]
    assert [row[0] for row in rows] == [
        "sample 2", f"samples {', '.join(map(str, range(5, 25)))} and 5 more",
    ]  # fmt: skip
    assert (rows[1][-1], more) == ("ringsim replay made 5", 0)
    assert {row[0]: row[1] for row in model.drawn_inputs(campaign)}[
        "cables.lower_winch_stop_time"
    ] == "s"
    campaign["cables_lower_winch_stop_time"].attrs.pop("units")  # as of words alone
    assert {row[0]: row[1] for row in model.drawn_inputs(campaign)}[
        "cables.lower_winch_stop_time"
    ] == "-"


@pytest.mark.usefixtures("_undrawn")
def test_how_runs_ended_is_not_told_twice() -> None:
    """Of three samples the worst ones tell it; of four one more would be missing."""
    for stalled in ((5,), (5, 6, 7), (4, 5, 6, 7)):
        campaign = made_campaign(8, stalled=stalled)
        campaign["reason"] = campaign["reason"].astype(object)
        campaign["reason"][list(stalled)] = "no V-joint moves; steps of 43 ms are long"
        text = page(campaign, "made")
        told = [cell for cell in Page(text).cells if "no V-joint moves" in cell]
        assert ("failures-table" in text) == (len(stalled) == 4)
        assert "No run ended short of its goal" not in text
        if len(stalled) == 4:  # all of them, not what is left
            assert "samples 4, 5, 6, 7" in Page(text).cells
        # Both the requirement on the time and the outcome fail, by samples and for one reason.
        assert len([each for each in told if "43 ms" not in each]) == min(len(stalled), 3)


def test_every_value_of_the_scene_has_its_origin(made: tuple[str, xr.Dataset, str]) -> None:
    cells = Page(made[2]).cells
    for path, value, origin in (
        ("structure.opening_angle", "20.0", "inferred"),
        ("structure.sections", "4", "campaign"),
        ("structure.half_bar", "0.2889", "scene"),
        ("rods.elements", "1", "default"),
        ("rods.young_modulus", "120000000000.0", "drawn"),
        # Drawn, and not in the scene, which leaves it out.
        ("cables.lower_winch_stop_time", "-", "drawn"),
    ):
        at = cells.index(path, cells.index("Origin"))
        assert cells[at + 1 : at + 3] == [value, origin]


def test_inputs_of_one_place_and_of_several_paths_have_their_origin() -> None:
    campaign = made_campaign(4)
    law = {"kind": "uniform", "shared": ["rods.young_modulus", "rods.density"]}
    campaign["rods_young_modulus"].attrs["distribution"] = json.dumps(law)
    one = 'cables.upper.friction.coefficient["section 3 V"]'
    campaign["cables_upper_friction_coefficient"].attrs["path"] = one
    found = {each.path: each.origin for each in model.values_of(campaign)[0]}
    assert found["rods.young_modulus"] == found["rods.density"] == "drawn"
    assert found["cables.upper.friction.coefficient"] == "drawn in part"
    assert found["cables.lower.friction.coefficient"] == "inferred"
    assert one not in found
    # Of every place one by one, as of a posterior, or beside a place with a law of its own.
    scene = tomllib.loads(campaign.attrs["scene"])
    last = campaign["cables_upper_friction_coefficient"]
    for number, name in enumerate(pulleys_at(scene, "cables.upper.friction.coefficient")):
        path = f'cables.upper.friction.coefficient["{name}"]'
        says = last.attrs | {"path": path, "input": path}
        campaign[f"pulley_{number}"] = "sample", last.values.reshape(4, -1)[:, 0], says
    campaign = campaign.drop_vars("cables_upper_friction_coefficient")
    found = {each.path: each.origin for each in model.values_of(campaign)[0]}
    assert found["cables.upper.friction.coefficient"] == "drawn"


def test_values_that_their_paths_do_not_explain_have_a_remark() -> None:
    told = {each.path: each.comment for each in model.values_of(made_campaign(2))[0]}
    assert told["rods.elements"] == "per rod half"
    assert told["structure.polygon_sections"].startswith("without effect")
    campaign = made_campaign(2)
    arc = {"structure.closed": False, "structure.sections": 4}
    campaign.attrs["scene"] = made_scene().with_values(arc).to_toml()
    told = {each.path: each.comment for each in model.values_of(campaign)[0]}
    assert "without effect" not in told["structure.polygon_sections"]


@pytest.mark.usefixtures("_undrawn")
def test_the_page_begins_with_the_question() -> None:
    campaign = made_campaign(3)
    asked, text = '<p id="question">Does it open &amp; is it &lt;3 deg?</p>', page(campaign, "here")
    assert text.index("</h1>") < text.index(asked) < text.index("<main>")
    # The scene's title, with the number of sections that it has.
    assert "4-section" in text.partition("<main>")[0].partition("samples of the scene")[2]
    campaign.attrs["campaign"] = campaign.attrs["campaign"].replace("question", "# question")
    assert 'id="question"' not in page(campaign, "here")


@pytest.mark.usefixtures("_undrawn")
def test_the_page_counts_what_failed_and_what_has_not_run() -> None:
    """Nothing is said to be listed that is not there; inputs are of the samples that have run."""
    for lost, left, words in (
        ((), (6, 7), "6 of 8</b> samples are in the statistics: 2 have not run yet; none that ran "
         "has failed."),
        ((), (7,), "7 of 8</b> samples are in the statistics: 1 has not run yet; none that"),
        ((1, 2), (7,), "5 of 8</b> samples are in the statistics: 2 failed, as listed below, and 1 "
         "has not run yet."),
        ((1,), (), "7 of 8</b> samples are in the statistics: 1 failed, as listed below."),
        ((), (), "All samples have valid results"),
    ):  # fmt: skip
        campaign = made_campaign(8, failed=lost, not_run=left)
        drawn = {"role": "input", "path": "net.stiffness", "units": "N m-1", "distribution": "{}"}
        campaign["net.stiffness"] = "sample", np.arange(8.0), drawn
        text = " ".join(page(campaign, "here").split())
        assert words in text
        assert (f"what the {8 - len(left)} samples have that have run" in text) == bool(left)
        assert f"<td>0 to {7 - len(left)}</td>" in text


def test_the_player_holds_what_was_computed(made: tuple[str, xr.Dataset, str]) -> None:
    _, campaign, text = made
    held = re.search(r'id="player-data">(.*?)</script>', text, re.DOTALL)
    assert held is not None
    data = json.loads(held[1])
    for each in data["samples"]:
        k = int(re.match(r"sample (\d+)", each["name"])[1])
        angles = np.frombuffer(base64.b64decode(each["angles"]), "<i2").reshape(-1, 2 * SECTIONS)
        own = campaign["opening_angle"].sel(sample=k, time=each["times"])
        own = own.transpose("time", "plane", "section").values.reshape(len(angles), -1)
        np.testing.assert_allclose(angles / 100.0, own, atol=0.0051)


def test_the_player_offers_median_worst_and_failures() -> None:
    data = shown(made_campaign(8, **KINDS["mixed"]))
    assert data is not None
    assert [each["name"] for each in data["samples"]] == [
        "sample 3: median by asynchrony_max, violates asynchrony_max <= 3 deg, deployed",
        "sample 6: worst by asynchrony_max, violates asynchrony_max <= 3 deg, deployed",
        "sample 4: violates deployment_time <= 40 s, violates outcome is deployed, "
        "violates asynchrony_max <= 3 deg, stalled",
        "sample 2: failed: timeout", "sample 5: failed: timeout",
    ]  # fmt: skip
    assert len(data["samples"][0]["times"]) == len(TIMES)
    assert data["samples"][3]["times"][-1] == 4.0


def test_the_players_ring_is_that_of_the_figure() -> None:
    data = shown(made_campaign(2))
    assert data is not None
    ring = data["ring"]
    fixed, joints = ring["fixed"], ring["joints"]
    points = np.frombuffer(base64.b64decode(ring["points"]), "<i2")
    points = ring["unit"] * points.reshape(len(ring["means"]), fixed + 2 * joints, 3)
    pose = len(ring["means"]) // 2
    openings = np.radians(ring["means"][pose] + np.linspace(-3.0, 3.0, joints).reshape(2, -1))
    middle, aside = points[pose, fixed : fixed + joints], points[pose, fixed + joints :]
    folded = np.cos(0.5 * openings.ravel())[:, None]
    places = np.concatenate([points[pose, :fixed], middle + folded * aside])
    wanted = lines_at(made_scene(), openings)
    wanted.pop("V-joints")
    wanted["net"] = np.concatenate(
        [wanted.pop(n) for n in ("net, taut", "net, slack") if n in wanted]
    )
    assert set(ring["groups"]) == set(wanted)
    for number, name in enumerate(ring["groups"]):
        own = places[[line[:2] for line in ring["lines"] if line[2] == number]]
        np.testing.assert_allclose(own, wanted[name], atol=1e-4)


def test_the_player_has_the_positions_that_were_computed() -> None:
    campaign = with_positions(made_campaign(8, **KINDS["mixed"]))
    data = shown(campaign)
    assert data is not None
    assert data["words"] == COMPUTED
    chosen = [int(each["name"].split()[1].rstrip(":")) for each in data["samples"]]
    for sample, each in zip(chosen, data["samples"], strict=True):
        known = campaign["position"].sel(sample=sample).dropna("time").transpose("time", ...)
        assert each["places"]["times"] == known["time"].to_numpy().tolist()
        found = np.frombuffer(base64.b64decode(each["places"]["points"]), "<i2")
        found = each["places"]["unit"] * found.reshape(known.shape)
        moved = found - known.to_numpy()
        np.testing.assert_allclose(moved, np.broadcast_to(moved[-1:, :1], moved.shape), atol=3e-4)
        middle = 0.5 * (found[-1].min(axis=0) + found[-1].max(axis=0))
        np.testing.assert_allclose(middle, 0.0, atol=3e-4)
    only = campaign.copy(deep=True)
    only["position"][chosen[0]] = np.nan
    assert shown(only)["words"] == f"{COMPUTED}, or {FROM_ANGLES}"  # type: ignore[index]


def test_the_player_ends_where_the_ring_is_deployed() -> None:
    """At its last lock, which lies behind the last record."""
    campaign = made_campaign(8, **KINDS["mixed"])
    campaign["opening_angle"][..., -3:] = np.nan
    data = shown(campaign)
    assert data is not None
    for each in data["samples"]:
        own = campaign.sel(sample=each["sample"])
        locks = [None if np.isnan(t) else t for t in own["lock_time"].values.ravel()]
        assert each["locks"] == locks
        deployed = np.isfinite(own["deployment_time"].item())
        assert each["end"] == (10.0 if deployed else each["times"][-1])
        assert each["times"][-1] < 9.0


def test_the_player_draws_the_spacecraft() -> None:
    """On the boom's upper end, in every pose."""
    scene = load_scene("ring18-flight").with_values({"structure.sections": SECTIONS})
    data = shown(made_campaign(2).assign_attrs(scene=scene.to_toml()))
    assert data is not None
    ring = data["ring"]
    points = np.frombuffer(base64.b64decode(ring["points"]), "<i2")
    points = ring["unit"] * points.reshape(len(ring["means"]), -1, 3)
    named = points_of(layout_of(scene))
    top = named.of_body(layout_of(scene).base)
    arm = points[:, ring["craft"]] - points[:, top]
    np.testing.assert_allclose(arm, np.tile(scene.spacecraft.centre, (len(arm), 1)), atol=1e-3)
    (line,) = [each for each in ring["lines"] if ring["groups"][each[2]] == "spacecraft"]
    assert line[:2] == [top, ring["craft"]]
    joints = {point for *pair, _ in ring["lines"] for point in pair if point > ring["craft"]}
    assert max(joints) == ring["fixed"] + ring["joints"] - 1


def shown(campaign: xr.Dataset) -> dict | None:
    return player(campaign, analyse(campaign))


def run(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["report", *words])
    return done.exit_code, done.output


@pytest.mark.usefixtures("_undrawn")
def test_the_verb(tmp_path: Path) -> None:
    out = str(tmp_path / "page.html")
    save(made_campaign(3), tmp_path / "campaign.nc")
    for where in (tmp_path, tmp_path / "campaign.nc"):
        code, told = run(str(where), "--out", out)
        assert (code, told[: 6 + len(out)]) == (EXIT_DONE, f"wrote {out}")
        assert f"ringsim replay {tmp_path}" not in Path(out).read_text()
    (tmp_path / "none").mkdir()
    (tmp_path / "text.nc").write_text("no netCDF")
    save(made_campaign(3).isel(sample=0), tmp_path / "run.nc")
    for where, words in (
        (tmp_path / "none", "this folder holds no campaign.nc: there is no campaign in it"),
        (tmp_path / "gone", "there is no such file or folder"),
        (tmp_path / "run.nc", "has no campaign: give the folder"),
        (tmp_path / "text.nc", "cannot be read as a netCDF file"),
    ):
        code, told = run(str(where), "--out", out)
        assert code == EXIT_BAD_INPUT
        assert told.startswith(f"{where}: {words}")
    code, told = run(str(tmp_path), "--out", out, "--analysis", str(tmp_path / "run.nc"))
    assert (code, "has no analysis" in told) == (EXIT_BAD_INPUT, True)
    code, told = run(str(tmp_path), "--out", str(tmp_path / "page.pdf"))
    assert (code, told.endswith("the page is HTML: give a name such as page.html\n")) == (
        EXIT_BAD_INPUT,
        True,
    )


@pytest.mark.usefixtures("_undrawn")
def test_a_stored_analysis_gives_the_page_of_a_new_one(tmp_path: Path) -> None:
    """To the last letter: a file gives back other kinds of numbers than an analysis has."""
    campaign = made_campaign(12, failed=(3,), stalled=(1, 4, 7))
    campaign["status"][{"sample": 11}] = -1  # one is still to run
    locked = np.where(campaign["status"] == 0, 12.0 - campaign["sample"] % 4, np.nan)
    campaign["locked_joints"] = "sample", locked, {"units": "1"}
    save(campaign, tmp_path / "campaign.nc")
    stored, first, second = (str(tmp_path / name) for name in ("a.nc", "1.html", "2.html"))
    assert CliRunner().invoke(cli, ["analyse", str(tmp_path), "--out", stored]).exit_code == 0
    assert run(str(tmp_path), "--out", first)[0] == EXIT_DONE
    assert run(str(tmp_path), "--out", second, "--analysis", stored)[0] == EXIT_DONE
    assert Path(first).read_text() == Path(second).read_text()
    with xr.open_dataset(stored) as found:
        mean = found["locked_joints"].sel(statistic="mean").item()
    ran = campaign["locked_joints"].values[campaign["status"].values == 0]
    assert mean == pytest.approx(ran.mean())
    assert mean != round(mean)  # a count's mean is none


@pytest.mark.usefixtures("_undrawn")
def test_a_stored_analysis_of_another_campaign_is_refused(tmp_path: Path) -> None:
    """By what identifies a campaign, not by its name; one of fewer samples is told."""
    other, stored, out = tmp_path / "other.nc", str(tmp_path / "a.nc"), str(tmp_path / "1.html")
    made = made_campaign(8, not_run=(6, 7))
    for own, file in (("first", tmp_path / "campaign.nc"), ("second", other)):
        save(made.assign_attrs(identity=own), file)
    few = tmp_path / "few.nc"
    save(made.isel(sample=slice(4)).assign_attrs(identity="first"), few)

    def report_of(analysed: Path) -> tuple[int, str]:
        assert CliRunner().invoke(cli, ["analyse", str(analysed), "--out", stored]).exit_code == 0
        return run(str(tmp_path), "--out", out, "--analysis", stored)

    code, told = report_of(other)
    assert code == EXIT_BAD_INPUT
    assert told.startswith(f"--analysis {stored}: it is of another campaign (made)")
    assert not Path(out).exists()
    code, told = report_of(few)
    assert code == EXIT_DONE
    assert "it is of 4 samples that have run of 4, and" in told
    assert "has 6 of 8" in told
    code, told = report_of(tmp_path)
    assert (code, "--analysis" in told) == (EXIT_DONE, False)


@pytest.mark.usefixtures("_undrawn")
def test_verdicts_are_those_of_the_analysis_and_nothing_counts_again() -> None:
    campaign = made_campaign(8, failed=(2, 5), stalled=(4,))
    text, found = page(campaign, "runs/made"), analyse(campaign)
    known = found.sel(requirement="deployment_time")
    used, violating, lost = (int(known[f"samples_{n}"]) for n in ("used", "violating", "lost"))
    assert (used, violating, lost) == (6, 1, 2)
    cells = Page(text).cells
    at = cells.index("deployment_time <= 40 s")
    assert (cells[at + 1], cells[at + 4]) == ("not yet shown", f"{float(known.probability):.4g}")
    assert cells[at + 6 : at + 9] == ["6", "1", "2"]
    assert "(the antenna did not get that far): 1." in text
    # One table tells of a requirement, so that no other count can contradict it.
    assert "Met by" not in text
    assert sum(cell.startswith("deployment_time <=") for cell in cells) == 1
    assert "not met" not in Page(page(campaign, "runs/made", analyse(campaign, {}))).cells


def test_what_matters_is_that_of_the_analysis() -> None:
    names = {"output": ["asynchrony_max"], "factor": ["rods", "force"]}
    analysis = xr.Dataset(coords=names)
    for name, values in (("total_index", [0.25, 0.75]), ("first_order_index", [0.2, 0.6])):
        analysis[name] = ("output", "factor"), [values]
        ends = np.stack([np.array(values) - 0.1, np.array(values) + 0.1], axis=-1)
        analysis[f"{name}_interval"] = ("output", "factor", "bound"), ends[None]
    for name, value in (("index_used", 7), ("index_lost", 1), ("missing", 2), ("missing_lost", 2)):
        analysis[name] = "output", [value]
    analysis["missing_by_inputs"] = "output", [0.4]
    found, gate = sensitivity_tables(analysis)
    assert found.rows == [
        ["asynchrony_max by force", "0.75", "0.65 .. 0.85", "0.6", "0.5 .. 0.7", "7", "1"],
        ["asynchrony_max by rods", "0.25", "0.15 .. 0.35", "0.2", "0.1 .. 0.3", "7", "1"],
    ]  # fmt: skip
    assert "2 samples without a value" in gate.notes[0]
    assert "too few to tell whether that depends on an input" in gate.notes[0]
    analysis["missing"] = "output", [5]
    gate = sensitivity_tables(analysis)[1]
    assert "this does not seem to depend on any input (p = 0.4)" in gate.notes[0]


@pytest.mark.usefixtures("_undrawn")
def test_the_page_has_all_that_the_analysis_tells_of_main_numbers() -> None:
    campaign, random = made_campaign(12, stalled=(3, 6, 9)), np.random.default_rng(0)
    campaign["cables_upper_friction_coefficient"][:] = random.random((12, 3))
    campaign["peak_tension_error"] = campaign["peak_tension"] * 0.0 + 0.5
    campaign.attrs |= {"fidelity": "frame", "source": "ringsim 0.1.0: compiled"}
    text, known = page(campaign, "runs/made"), analyse(campaign)
    cells = Page(text).cells
    low, high = known["peak_tension_interval"].sel(statistic="mean").values
    at = cells.index("peak_tension", cells.index("std. dev."))
    fine = digits_of(*known["peak_tension"].values[-2:])
    assert cells[at + 2] == number_text(known["peak_tension"].values[0], fine)
    assert cells[at + 3] == interval_text(float(low), float(high), fine)
    brief = slim(what_matters(known))
    at = cells.index(brief.head[0]) + len(brief.head)
    assert cells[at : at + len(brief.head)] == list(brief.rows[0])
    at = cells.index("peak_tension with rods.young_modulus", at)
    assert cells[at + 1] == "1"
    assert any(cell.startswith("stalled: ") for cell in cells)
    assert "stalled: these are also the samples of violates deployment_time" in text
    at = cells.index("peak_tension", cells.index("dominates"))
    assert cells[at + 6] == "sampling"
    assert "ngines not measured" in text  # a note begins with a capital
    assert "in the fidelity <b>frame</b>" in text


def test_numerical_truth_tells_error_bars_and_differences_of_engines() -> None:
    campaign = made_campaign(4, failed=(3,))
    campaign["peak_tension_error"] = campaign["peak_tension"] * 0.0 + 0.5
    campaign["peak_tension_error"].attrs = {"long_name": "error bar", "units": "N"}
    campaign["peak_tension_checked"] = campaign["peak_tension"] + [0.3, np.nan, -0.4, 9.0]
    campaign["status_checked"] = "sample", [0, 0, 0, 0]
    found = analyse(campaign)
    errors, balance = error_tables(found)
    row = {r[0]: dict(zip(errors.head, r, strict=True)) for r in errors.rows}["peak_tension"]
    assert row["unit"] == "N"
    assert row["numerical (error bars)"] == "0.5"
    assert row["samples with bars"] == "3"
    assert row["largest bar"] == "0.5 (sample 0)"
    assert row["engines (difference)"] == f"{np.sqrt(0.125):.2g}"
    assert row["samples checked"] == "2"
    assert row["largest difference"] == "0.4 (sample 2)"
    (energy,) = [row[1:] for row in balance.rows if "energy imbalance" in row[0]]
    assert energy == ("2e-05", "3e-05 (sample 2)", "3")
    # The extremes' samples are named with the error that they state themselves.
    campaign["peak_tension_error"][2] = 0.25
    table = every_statistic(analyse(campaign))
    ends = [r[5:7] for r in table.rows if r[0] == "peak_tension" and r[2] in ("minimum", "maximum")]
    assert ends == [("0", "0.5"), ("2", "0.25")]


def test_few_samples_are_told_why_there_is_no_interval() -> None:
    for count, few in ((7, True), (8, False)):
        notes = statistics_table(analyse(made_campaign(count))).notes
        assert (
            any("deviation needs 8, a median 6, the other quantiles 59" in n for n in notes) == few
        )


@pytest.mark.usefixtures("_undrawn")
def test_pages_terminals_and_python_tell_the_same_tables() -> None:
    campaign = made_campaign(12, stalled=(3, 6, 9))
    known = analyse(campaign)
    cells, lines = Page(page(campaign, "runs/made", known)).cells, told(known, "runs/made")
    every = known.ring.tables(), known.ring.tables(full=True)
    assert every[0].keys() == campaign.ring.tables().keys()
    for table in every[0].values():
        for row in table.to_numpy().tolist():
            at = [k for k, cell in enumerate(cells) if cell == row[0]]
            assert any(cells[k : k + len(row)] == row for k in at), row
            assert any(all(cell in line for cell in row) for line in lines) or len(row) == 4, row
    assert not [cell for cell in cells if "degree" in cell]
    assert "mean" in every[1]["output"]
    assert "statistic" in every[1]["every statistic"]


@pytest.mark.parametrize("kind", ["one-at-a-time", "random"])
def test_a_table_without_a_figure_of_its_own_goes_before_the_figures(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = [each for each in of_campaigns.PICTURES if each.name in ("tornado", "distributions")]
    monkeypatch.setattr(of_campaigns, "PICTURES", few)
    campaign = made_campaign(12)
    campaign.attrs["design"] = json.dumps({"kind": kind})
    text = page(campaign, "runs/made")
    alone = 'id="figure-tornado"' not in text
    assert alone == (kind == "one-at-a-time")
    assert text.count('<section id="matters">') == 1
    assert (text.index('<section id="matters">') < text.index('<section id="figures">')) == alone
    assert '<p class="note">.</p>' not in text


def test_what_can_be_broken_stands_behind_what_cannot() -> None:
    """In print it fills what a figure or a listing leaves of a sheet; tables of three rows stay
    whole: of sixteen high ones a sheet was left half empty."""
    text = page(made_campaign(24), "runs/made")
    order = ["figure-tornado", "matters-table", "The campaign's file", "model-table"]
    places = [text.index(f'id="{name}"' if "-" in name else name) for name in order]
    assert places == sorted(places)
    boxes = re.findall(r'<div class="([^"]*)"><table id="([^"]*)">(.*?)</table>', text, re.DOTALL)
    rows = {name: (kind, body.count("<tr") - 1) for kind, name, body in boxes}
    assert any("short" in kind for kind, _ in rows.values())
    for name, (kind, count) in rows.items():
        assert ("short" in kind) == (count <= 3 and name != "model-table"), name


@pytest.mark.quick
def test_figures_stand_where_they_fill_the_sheets_of_a_printed_page() -> None:
    def drawn(**heights: float) -> list[tuple[str, str, Figure]]:
        return [(name, "", Figure(figsize=(8.0, high))) for name, high in heights.items()]

    def names(sheets: list[Sheet]) -> list[str]:
        return ["".join(sheet.names) for sheet in sheets]

    # On paper 5.5, 3.3 and 6.6 inch of 10.6: d fills what c leaves, f what e does.
    every = drawn(a=8.3, b=5.0, c=8.3, d=5.0, e=10.0, g=10.0, f=5.0)
    front, rest = filling(every, 3, ("d", "f"))
    assert (names(front), names(rest)) == (["ab", "cd"], ["g", "ef"])
    front, rest = filling(every, 3)
    assert (names(front), names(rest)) == (["ab", "c"], ["de", "gf"])
    # A small one moves up past a large one; a heading has room on each sheet.
    assert names(filling(drawn(a=8.3, b=10.0, c=5.0), 3)[0]) == ["ac", "b"]
    assert names(filling(drawn(a=8.3, b=8.2), 2)[0]) == ["a", "b"]
    assert names(filling(drawn(a=8.0, b=8.0))[1]) == ["ab"]
    # The emptiest sheet of the others may fill what text leaves.
    assert names(filling(drawn(a=10.0, b=5.0, c=5.0, d=4.0))[1]) == ["cd", "ab"]
    assert filling([], 3, ("d",)) == ([], [])


@pytest.mark.quick
def test_a_sentence_that_begins_with_a_command_keeps_it_as_it_is_typed() -> None:
    told = "ringsim compare --out FILE.nc stores all samples"
    assert shell._sentence(told) == f"{told}."
    assert shell._sentence("nothing differs") == "Nothing differs."


@pytest.mark.quick
def test_figures_are_reduced_by_the_little_that_they_do_not_fit() -> None:
    def sheets(high: float, wide: float, words: str = "") -> list[Sheet]:
        return filling([(name, words, Figure(figsize=(wide, high))) for name in "ab"])[1]

    room, scale, line, gap = 10.17, 0.66, 0.135, 0.15  # inch, as printed pages were measured
    for high, words in ((7.0, ""), (8.0, ""), (7.6, "w" * 250)):
        captions = 2.0 * (gap + line * (len(words) // 125))
        (found,) = sheets(high, 8.0, words)
        assert found.fit == pytest.approx(min(1.0, (room - captions) / (2.0 * scale * high)))
        assert found.fit >= 0.92
    assert [each.names for each in sheets(8.5, 8.0, "w" * 250)] == [["a"], ["b"]]
    # Wider than a sheet it is smaller already.
    assert len(sheets(8.5, 10.9, "w" * 250)) == 2
    assert len(sheets(8.5, 12.5, "w" * 250)) == 1


@pytest.mark.usefixtures("_undrawn")
def test_long_heads_may_be_broken_at_underscores() -> None:
    """Else tables of many outputs are wider than paper, and browsers print all pages smaller."""
    campaign = made_campaign(4)
    campaign.attrs["design"] = json.dumps({"kind": "one-at-a-time"})
    assert '<th scope="col">asynchrony_<wbr>max (deg)</th>' in page(campaign, "runs/made")


@pytest.mark.quick
def test_long_cells_are_broken_though_they_hold_a_range() -> None:
    """A posterior's law ran over the columns beside it in print."""
    law = (
        "median 1.3, 90 % in 1.2 .. 1.4 after a test (before: normal, mean 1, standard deviation 1)"
    )
    macros = shell.templates().get_template("macros.html.j2").module
    told = str(macros.table(["a", "b"], [("1.2 .. 1.4", law)], "t"))  # type: ignore[attr-defined]
    assert '<td class="range">1.2 .. 1.4</td>' in told
    assert '<td class="long">median' in told
