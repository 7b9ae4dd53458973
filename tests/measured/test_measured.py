"""Measured data beside a run: readings made from a known run, and what a table may have wrong."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import xarray as xr
from click.testing import CliRunner
from loops import for_each

from ringsim.analysis.residuals import (
    predictions,
    residual_statistics,
    residual_table,
    residuals,
)
from ringsim.campaign.python import Campaign
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.measured import by_clock, load_measured
from ringsim.plots import figures
from ringsim.refusal import InputError
from ringsim.sampling.distributions import Uniform
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.variables import Fate

pytestmark = pytest.mark.quick

HEAD = """
name = "stand-1"
file = "stand.csv"
clock = { column = "t", unit = "ms", offset = 0.5, drift = 0.001 }
"""
ENCODER = """
[[sensors]]
column = "enc"
variable = "opening_angle"
place = { plane = "upper", section = 2 }
unit = "rad"
standard_deviation = 0.002
bias = 0.01
"""
CELL = """
[[sensors]]
column = "cell"
variable = "cable_tension"
place = { plane = "lower", span = 1 }
unit = "kgf"
standard_deviation = 0.02
"""
LOCK = """
[[sensors]]
variable = "lock_time"
place = { plane = "upper", section = 1 }
value = 34.0
unit = "s"
standard_deviation = 0.1
"""


OPENING = load_scene("truss2").with_values({
    "structure.opening_angle": 120.0, "record.interval": 0.05,
    "cables.upper.winch.winding.speed": 0.1, "cables.lower.winch.winding.speed": 0.1,
})  # fmt: skip
"""Two sections that open within 4 s."""


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return simulate(OPENING, "frame")


def table(run: xr.Dataset, *, noise: bool = True) -> list[list[str]]:
    """Readings of both sensors at 50 Hz, as their clock, units, bias and scatter make them."""
    rng = np.random.default_rng(8)
    at = np.arange(0.6, float(run["deployment_time"]) - 0.1, 0.02)
    clock = 1e3 * (at - 0.5) / 1.001
    angle = run["opening_angle"].sel(plane="upper", section=2).interp(time=at).values
    pull = run["cable_tension"].sel(plane="lower", span=1).interp(time=at).values
    scatter = rng.normal(size=(2, len(at))) * float(noise)
    enc = np.radians(angle) + 0.01 + 0.002 * scatter[0]
    cell = pull / 9.80665 + 0.02 * scatter[1]
    rows = zip(clock, enc, cell, strict=True)
    return [["t", "enc", "cell"], *([f"{x:.9g}" for x in row] for row in rows)]


def written(folder: Path, toml: str, rows: list[list[str]], separator: str = ",") -> Path:
    (folder / "stand.csv").write_text("\n".join(separator.join(row) for row in rows) + "\n")
    (folder / "stand.toml").write_text(toml)
    return folder / "stand.toml"


def test_readings_of_the_run_itself_differ_from_it_by_nothing(
    run: xr.Dataset, tmp_path: Path
) -> None:
    """Clock, units and bias undone: what is left is what nine digits of a table lose."""
    file = written(tmp_path, HEAD + ENCODER + CELL, table(run, noise=False))
    for each in residuals(run, load_measured(file)):
        assert len(each.times) > 50
        scale = np.abs(each.computed).max()
        assert np.abs(each.apart).max() < 1e-6 * scale


def test_by_another_clock_readings_and_instants_move_and_durations_stretch(tmp_path):
    rows = {"lock_time": 2.0, "longest_slack": 3.0}
    sensors = [{"variable": "opening_angle", "place": {"plane": "upper", "section": 1},
                "column": "a", "unit": "deg", "standard_deviation": 0.1}]  # fmt: skip
    sensors += [{"variable": name, "value": value, "unit": "s", "standard_deviation": 0.1}
                | ({"place": {"plane": "upper", "section": 1}} if name == "lock_time" else {})
                for name, value in rows.items()]  # fmt: skip
    clock = {"column": "t", "offset": 0.5, "drift": 0.01}
    (tmp_path / "a.csv").write_text("t,a\n1.0,20.0\n2.0,30.0\n")
    told = {"name": "a", "file": "a.csv", "clock": clock, "sensors": sensors}
    (tmp_path / "a.toml").write_text(tomli_w.dumps(told))
    old = load_measured(tmp_path / "a.toml")
    (tmp_path / "a.toml").write_text(
        tomli_w.dumps(told | {"clock": clock | {"offset": -0.2, "drift": -0.03}})
    )
    new, moved = load_measured(tmp_path / "a.toml"), by_clock(old, -0.2, -0.03)
    for one, other in zip(new.readings, moved.readings, strict=True):
        np.testing.assert_allclose(one.times, other.times, rtol=1e-12)
        np.testing.assert_allclose(one.values, other.values, rtol=1e-12)
    assert new.file == moved.file


def test_scatter_alone_gives_one_standard_deviation(run: xr.Dataset, tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + ENCODER + CELL, table(run))
    found = residual_statistics(residuals(run, load_measured(file)))
    count = int(found["compared"][0])
    # The root mean square of n normal numbers scatters by 1 / sqrt(2 n).
    np.testing.assert_allclose(found["rms_in_deviations"], 1.0, atol=4.0 / np.sqrt(2 * count))
    assert found.attrs["compared"] == 2 * count
    np.testing.assert_allclose(
        found["rms_difference"], [np.degrees(0.002), 0.02 * 9.80665], rtol=4.0 / np.sqrt(2 * count)
    )


def test_each_number_of_the_table_follows_from_the_readings(
    run: xr.Dataset, tmp_path: Path
) -> None:
    rows = table(run)
    rows[10][1] = f"{float(rows[10][1]) + 0.5:.9g}"
    late = [f"{1e3 * (float(run['final_time']) + 1.0):.9g}", rows[-1][1], ""]
    file = written(tmp_path, HEAD + ENCODER + CELL + LOCK, [*rows, late], separator="\t")
    found = residual_table(residuals(run, load_measured(file)))
    told = {row[0]: dict(zip(found.head, row, strict=True)) for row in found.rows}
    encoder, cell = told["opening_angle upper 2"], told["cable_tension lower 1"]
    # Of a ring that has opened a joint stays at 180 deg, and no other number is known.
    assert (encoder["readings"], encoder["outside the run"]) == (str(len(rows)), "-")
    assert (cell["empty cells"], cell["gaps"]) == ("1", "-")
    at = 0.5 + 1.001e-3 * float(rows[10][0])
    assert float(encoder["at (s)"]) == pytest.approx(at, rel=1e-3)
    assert float(encoder["largest difference"]) == pytest.approx(np.degrees(0.5), abs=1.0)
    assert float(encoder["sigma"]) == pytest.approx(np.degrees(0.002), rel=0.05)
    # A lock time is read by the same clock.
    lock = 0.5 + 1.001 * 34.0 - float(run["lock_time"].sel(plane="upper", section=1))
    row = told["lock_time upper 1"]
    assert float(row["mean difference"]) == pytest.approx(lock, rel=5e-3)
    assert float(row["rms / sigma"]) == pytest.approx(lock / 0.1, rel=5e-3)
    assert found.rows[0][0] == "lock_time upper 1"  # the worst first


def test_a_duration_is_not_shifted_by_the_offset_of_the_clock(
    run: xr.Dataset, tmp_path: Path
) -> None:
    slack = LOCK.replace("lock_time", "longest_slack").replace("value = 34.0", "value = 2.0")
    slack = slack.replace('place = { plane = "upper", section = 1 }', "")
    (one,) = load_measured(written(tmp_path, HEAD + slack, table(run)[:3])).readings
    assert one.values == pytest.approx([1.001 * 2.0])
    # Without a table, too; the clock need not be there.
    alone = 'name = "x"\nfile = "none.csv"\n' + slack
    (one,) = load_measured(written(tmp_path, alone, [])).readings
    assert one.values == pytest.approx([2.0])


def test_a_reading_at_the_last_record_is_compared_whatever_digits_the_clock_leaves(
    run: xr.Dataset, tmp_path: Path
) -> None:
    """0.5 s + 1.001 of the file's time: some digits beyond the last record, and a thousandth."""
    end = float(run["time"].values[np.isfinite(run["cable_tension"].sel(plane="lower")[0])][-1])
    rows = table(run)
    for late, outside in ((1e-15, 0), (1e-3, 1)):
        last = [repr(1e3 * (end * (1.0 + late) - 0.5) / 1.001), *rows[1][1:]]
        file = load_measured(written(tmp_path, HEAD + CELL, [*rows[:5], last]))
        (cell,) = residuals(run, file)
        assert cell.outside == outside


def test_what_a_run_never_came_to_is_not_compared(run: xr.Dataset, tmp_path: Path) -> None:
    file = load_measured(written(tmp_path, HEAD + LOCK + ENCODER, table(run)))
    lock, encoder = residuals(run.assign(lock_time=run["lock_time"] * np.nan), file)
    assert (len(lock.apart), lock.outside) == (0, 1)
    found = residual_statistics([lock, encoder])
    assert np.isfinite(found.attrs["rms_in_deviations"])
    assert residual_table([lock, encoder]).rows[-1][0] == "lock_time upper 1"


def test_gaps_between_readings_are_counted(run: xr.Dataset, tmp_path: Path) -> None:
    rows = table(run)
    file = written(tmp_path, HEAD + ENCODER, rows[:20] + rows[40:])
    (one,) = load_measured(file).readings
    assert (one.gaps, one.missing) == (1, 0)
    (shorter,) = load_measured(
        written(tmp_path, HEAD + "longest_gap = 1.0\n" + ENCODER, rows[:20] + rows[40:])
    ).readings
    assert shorter.gaps == 0


WRONG_FILES = {
    "unknown variable": (ENCODER.replace("opening_angle", "opening_angel"),
                         "did you mean opening_angle"),
    "words": (ENCODER.replace("opening_angle", "peak_tension_plane"), "no number of a run"),
    "unit of another kind": (ENCODER.replace('"rad"', '"N"'), 'unit = "N" is none for'),
    "no place": (ENCODER.replace('place = { plane = "upper", section = 2 }', ""),
                 "place = { plane = ..., section = ... }"),
    "a value over time": (ENCODER.replace('column = "enc"', "value = 3.0"), "give column"),
    "neither": (ENCODER.replace('column = "enc"', ""), "has neither column nor value"),
    "no scatter": (ENCODER.replace("standard_deviation = 0.002", "standard_deviation = 0.0"),
                   "standard_deviation = 0.0 must be above 0"),
    "twice": (ENCODER + ENCODER, "two of them measure opening_angle upper 2"),
    "unknown column": (ENCODER.replace('"enc"', '"encoder"'), "did you mean enc?"),
    "unknown key": (ENCODER + "sigma = 1.0\n", "sensors[1].sigma is not a known key"),
}  # fmt: skip
WRONG_ROWS = {
    "text": (["3.0", "broken", "1"], 'column "enc": "broken" is no finite number'),
    "infinite": (["3.0", "inf", "1"], 'column "enc": "inf" is no finite number'),
    "comma": (["3.0", "1", "5", "1"], "has 4 cells, but there are 3 heads"),
    "no time": (["", "1.0", "1"], "row 2: has no time"),
    "back": (["1.0", "1.0", "1"], "row 2: its time 1 ms is not after 2 ms of the row before"),
}


GOOD = [["t", "enc", "cell"], ["2.0", "1.0", "1.0"]]
WRONG = {name: (HEAD + toml, GOOD, words) for name, (toml, words) in WRONG_FILES.items()}
WRONG |= {
    name: (HEAD + ENCODER, [*GOOD, row, ["9.0", "1", "1"]], words)
    for name, (row, words) in WRONG_ROWS.items()
}
WRONG |= {
    "no readings": (HEAD + ENCODER, GOOD[:1], "has no readings"),
    "no table": ('name = "x"\n' + ENCODER, GOOD, "needs the table"),
    "no unit of time": (HEAD.replace('"ms"', '"h"') + ENCODER, GOOD, "is no unit of time"),
}


@for_each("toml, rows, words", WRONG.values(), ids=[*WRONG])
def test_what_is_wrong_is_told_in_one_line(
    toml: str, rows: list[list[str]], words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as caught:
        load_measured(written(tmp_path, toml, rows))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_sensors_that_the_run_lacks_are_told(run: xr.Dataset, tmp_path: Path) -> None:
    rows = table(run)
    for toml, words in (
        (ENCODER.replace("section = 2", "section = 9"), "the run has no section 9"),
        (ENCODER.replace('"upper"', '"uper"'), "did you mean upper?"),
        (CELL.replace("cable_tension", "motor_current").replace("span = 1", "winch = 1")
         .replace("kgf", "A"), "the run has no motor_current"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words.replace("?", r"\?")):
            residuals(run, load_measured(written(tmp_path, HEAD + toml, rows)))
    none = even_campaign().isel(sample=[0])  # the one that failed
    with pytest.raises(InputError, match="no sample of the campaign has ended well"):
        residuals(none, load_measured(written(tmp_path, HEAD + ENCODER, rows)))


def test_commands_compare_and_draw(run: xr.Dataset, tmp_path: Path) -> None:
    file = written(tmp_path, HEAD + ENCODER + CELL + LOCK, table(run))
    save(run, tmp_path / "run.nc")
    told = CliRunner().invoke(
        cli, ["compare", str(tmp_path / "run.nc"), str(file), "--out", str(tmp_path / "fit.nc")]
    )
    assert told.exit_code == 0, told.output
    assert "all sensors: rms / sigma" in told.output
    with xr.open_dataset(tmp_path / "fit.nc") as stored:
        assert stored.sizes["sensor"] == 3
        xr.testing.assert_allclose(stored.load(), run.ring.residuals(file))
    drawn = CliRunner().invoke(
        cli, ["plot", str(tmp_path / "run.nc"), "--measured", str(file), "--plot-format", "png"]
    )
    assert drawn.exit_code == 0, drawn.output
    assert (tmp_path / "run-fig-measured.png").stat().st_size > 10_000
    refused = CliRunner().invoke(
        cli, ["compare", str(tmp_path / "run.nc"), str(file), "--report", str(tmp_path / "a.html")]
    )
    assert refused.exit_code == 2
    assert "--measured" in refused.output


def test_netcdf_holds_the_same_readings(tmp_path: Path) -> None:
    rows = [["t", "enc", "cell"], ["100", "1.0", "2.0"], ["200", "", "3.0"], ["300", "1.5", "nan"]]
    from_csv = load_measured(written(tmp_path, HEAD + ENCODER + CELL, rows))
    values = {name: np.array([float(row[k] or "nan") for row in rows[1:]])
              for k, name in enumerate(rows[0])}  # fmt: skip
    xr.Dataset({name: ("record", each) for name, each in values.items()}).to_netcdf(
        tmp_path / "stand.nc"
    )
    toml = (tmp_path / "stand.toml").read_text().replace("stand.csv", "stand.nc")
    (tmp_path / "other.toml").write_text(toml)
    from_netcdf = load_measured(tmp_path / "other.toml")
    for one, other in zip(from_csv.readings, from_netcdf.readings, strict=True):
        np.testing.assert_array_equal(one.times, other.times)
        np.testing.assert_array_equal(one.values, other.values)
        assert (one.missing, one.gaps) == (other.missing, other.gaps)
    xr.Dataset({"t": ("record", values["t"]), "enc": (("a", "b"), np.ones((2, 2)))}).to_netcdf(
        tmp_path / "square.nc"
    )
    for name, words in {
        "square.nc": "numbers along one dimension", "none.nc": "none.nc: cannot be read",
    }.items():  # fmt: skip
        (tmp_path / "other.toml").write_text(toml.replace("stand.nc", name))
        with pytest.raises(InputError, match=words):
            load_measured(tmp_path / "other.toml")


def test_joints_come_to_180_deg_at_their_lock_and_stay_there(tmp_path: Path) -> None:
    coarse, fine = (
        simulate(OPENING.with_values({"record.interval": interval}), "frame")
        for interval in (0.09, 0.005)
    )
    at_joint = {"plane": "upper", "section": 1}
    lock = float(coarse["lock_time"].sel(at_joint))
    last = float(coarse["opening_angle"].sel(at_joint).dropna("time")["time"][-1])
    assert last < lock < last + 0.09
    # Before the lock, angles of the finer records are the truth.
    known = fine["opening_angle"].sel(at_joint).dropna("time")
    before, after = np.linspace(last, lock - 0.005, 5), [lock, lock + 0.01, lock + 3.0]
    rows = [["t", "enc"], *([f"{1e3 * (t - 0.5) / 1.001:.12g}", "3"] for t in [*before, *after])]
    encoder = ENCODER.replace("section = 2", "section = 1")
    measurement = load_measured(written(tmp_path, HEAD + encoder, rows))
    [angles] = predictions(coarse.expand_dims("sample"), measurement)
    np.testing.assert_allclose(angles[0, :5], known.interp(time=before), atol=0.02)
    np.testing.assert_allclose(angles[0, 5:], 180.0, atol=1e-9)


SLOPES = np.linspace(9.0, 11.0, 201)
"""deg/s, of samples whose joints open evenly from 90 deg."""


def even_campaign() -> xr.Dataset:
    times = np.linspace(0.0, 2.0, 201)
    angles = (90.0 + SLOPES[:, None] * times)[:, None, None, :]
    failed = np.full_like(angles[:1], 33.0)
    dims = ("sample", "plane", "section", "time")
    samples = len(SLOPES) + 1
    return xr.Dataset(
        {
            "opening_angle": (dims, np.concatenate([failed, angles])),
            "status": ("sample", np.arange(samples) == 0),
            "outcome": ("sample", np.full(samples, int(Fate.NONE))),
        },
        {"time": times, "plane": ["upper"], "section": [2], "sample": np.arange(samples)},
    )


@pytest.mark.parametrize("fate", [*Fate])
def test_angles_stay_after_the_end_of_what_is_deployed_or_folded_alone(
    fate: Fate, tmp_path: Path
) -> None:
    """That of the second sample, of 9.01 deg/s, ends at 108.02 deg after 2 s."""
    stand = load_measured(even_readings(tmp_path, np.array([98.0, 100.0]), np.array([1.0, 3.0])))
    made = even_campaign().isel(sample=[2])
    made = made.assign(outcome=("sample", [int(fate)]))
    stays = 108.02 if fate in (Fate.DEPLOYED, Fate.FOLDED) else np.nan
    [angles] = predictions(made, stand)
    np.testing.assert_allclose(angles, [[99.01, stays]])
    [one] = residuals(made.isel(sample=0), stand)
    np.testing.assert_allclose(one.computed, [each for each in angles[0] if np.isfinite(each)])
    assert one.outside == int(np.isnan(stays))


def even_readings(folder: Path, angles: np.ndarray, at: np.ndarray) -> Path:
    rows = [f"{t:.6f},{a:.9f}" for t, a in zip(at, angles, strict=True)]
    text = ENCODER.replace('"rad"', '"deg"').replace("0.002", "0.05").replace("0.01", "0.0")
    head = 'name = "stand-1"\nfile = "stand.csv"\nclock = { column = "t" }\n'
    return written(folder, head + text, [["t", "enc"], *([row] for row in rows)])


def test_samples_of_a_campaign_lie_beside_readings(tmp_path: Path) -> None:
    at = np.linspace(0.1, 1.9, 19)
    file = even_readings(tmp_path, 90.0 + 10.6 * at, at)
    [found] = residuals(even_campaign(), load_measured(file))
    assert found.band is not None
    np.testing.assert_allclose(found.computed, 90.0 + 10.0 * at)
    # Slopes are even: 90 % of them within 0.9 deg/s of 10, beside the scatter of a reading.
    half = np.hypot(0.9 * at, 1.6449 * 0.05)
    np.testing.assert_allclose(found.band, found.computed + np.array([-half, half]), atol=1e-9)
    assert found.within.all()
    assert found.beyond == 0
    far = even_readings(tmp_path, 90.0 + 11.5 * at, at)
    [found] = residuals(even_campaign(), load_measured(far))
    assert found.beyond == int((0.5 * at > 3.5 * 0.05).sum())
    assert found.within.sum() == int((1.5 * at < half).sum())
    told = residual_statistics([found])
    assert told["within_band"].item() == pytest.approx(found.within.mean())
    notes = " ".join(residual_table([found]).notes)
    assert f"by more than 3.5 sigma: {found.beyond} readings" in notes
    share = found.within.mean()
    assert f"{round(19 * share)} of 19 readings ({share:.2g}) lie in it" in notes


def test_band_holds_nine_tenths_of_tests_that_the_inputs_foretell(tmp_path: Path) -> None:
    rng, at, held = np.random.default_rng(3), np.linspace(0.05, 1.95, 20), []
    for _ in range(25):
        truth = 90.0 + rng.uniform(9.0, 11.0) * at
        file = even_readings(tmp_path, truth + 0.05 * rng.normal(size=len(at)), at)
        [found] = residuals(even_campaign(), load_measured(file))
        held.append(found.within.mean())
    # Readings of a test go together: the scatter is that between tests.
    assert abs(np.mean(held) - 0.9) < 3.0 * np.std(held) / np.sqrt(len(held)) + 0.02


def test_page_of_a_campaign_shows_the_test_beside_its_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = [each for each in figures.PICTURES if each.name == "distributions"]
    monkeypatch.setattr(figures, "PICTURES", few)
    folder = tmp_path / "six"
    campaign = Campaign(
        OPENING.with_values({"solver.tolerance": 3e-3, "solver.settling_time": 0.0}),
        {"cables.upper.winch.winding.speed": Uniform(low=0.08, high=0.12)},
        {"kind": "random", "samples": 6}, 1, fidelity="frame",
    ).run(workers=0, out=folder)  # fmt: skip
    at = np.array([0.3, 0.6, 0.9])
    curves = campaign["opening_angle"].sel(plane="upper", section=2)
    file = even_readings(tmp_path, curves.median("sample").interp(time=at).values, at)
    shell = CliRunner()
    page = tmp_path / "six.html"
    done = shell.invoke(cli, ["report", str(folder), "--measured", str(file), "--out", str(page)])
    assert done.exit_code == 0, done.output
    text = page.read_text()
    assert 'id="figure-measured"' in text
    assert "All sensors: 3 of 3 readings (1) lie in it" in text
    shown = json.loads(re.search(r'id="player-data">(.*?)</script>', text, re.S)[1])
    (encoder,) = shown["measured"]
    joints = [(plane, section) for plane in shown["planes"] for section in shown["sections"]]
    assert joints[encoder["joint"]] == ("upper", 2)
    assert encoder["times"] == at.tolist()
    (one,) = load_measured(file).readings
    np.testing.assert_allclose(encoder["angles"], one.values, atol=5e-4)
    assert "encoders against that mean" in text
    told = shell.invoke(cli, ["compare", str(folder), str(file)])
    assert "all sensors: 3 of 3 readings (1) lie in it" in told.output
    page = tmp_path / "dossier.html"
    done = shell.invoke(cli, ["dossier", str(folder), "--measured", str(file), "--out", str(page)])
    assert done.exit_code == 0, done.output
    inside = residual_statistics(residuals(campaign, load_measured(file)))
    (share,), (most,) = inside["within_band"].values, inside["largest_difference"].values
    said = " ".join(done.output.split())
    told = re.findall(r"(\d) of 3 readings in the band of 90 % .*?difference (\S+) deg", said)
    assert len(told) == 2  # of either standard
    assert [float(each) for each in told[0]] == pytest.approx([3 * share, most], rel=5e-3)
    beyond = int(inside["beyond_samples"].sum())
    assert ("lie beyond all samples (people)" in said) == (beyond > 0)
    drawn = shell.invoke(cli, ["plot", str(folder), "--measured", str(file), "--out", str(folder)])
    assert drawn.exit_code == 0, drawn.output
    assert (folder / "campaign-fig-measured.png").stat().st_size > 10_000
