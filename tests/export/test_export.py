"""What other programs read of an export is what the file held."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import meshio
import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import SECTIONS, TIMES, made_campaign, made_scene, with_positions
from scipy.io import loadmat

import ringsim.export
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.shapes import COMPUTED, FROM_ANGLES, shape_of
from ringsim.tables import size_text
from ringsim.variables import Status


def export(*words: object, code: int = 0) -> str:
    done = CliRunner().invoke(cli, ["export", *map(str, words)])
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture(scope="module")
def campaign() -> xr.Dataset:
    found = with_positions(made_campaign(4, failed=(2,), not_run=(3,)))
    codes = found["status"].attrs  # as merging writes them
    codes["flag_values"] = np.append(np.int8(-1), codes["flag_values"])
    codes["flag_meanings"] = f"not_run {codes['flag_meanings']}"
    return found


@pytest.fixture
def file(campaign: xr.Dataset, tmp_path: Path) -> Path:
    save(campaign, tmp_path / "campaign.nc")
    return tmp_path / "campaign.nc"


@pytest.fixture
def run_file(campaign: xr.Dataset, tmp_path: Path) -> Path:
    """The run of sample 1, with a stress of 1000 r + s Pa in row r, section s."""
    run = campaign.isel(sample=1, drop=True)
    rods = [f"{rod}_{half}" for rod in ("diagonal_rising", "diagonal_falling", "bar_upper",
                                        "bar_lower") for half in ("left", "right")]  # fmt: skip
    rows = 1000.0 * np.arange(8)[:, None, None] + np.arange(1, SECTIONS + 1)[:, None]
    stress = rows * np.ones(len(TIMES))
    told = {"units": "Pa", "long_name": "stress"}
    run = run.assign_coords(rod=rods).assign(rod_stress=(("rod", "section", "time"), stress, told))
    save(run, tmp_path / "run.nc")
    return tmp_path / "run.nc"


def test_a_spreadsheet_computes_no_word(file: Path, campaign: xr.Dataset) -> None:
    words = np.array(["=1+1", "-0.5", "@x", "-"], dtype=object)
    says = {"long_name": "=cmd"}
    save(campaign.assign(word=("sample", words, says)), file)
    export(file, "--variables", "word")
    found = pd.read_csv(file.with_name("campaign-sample.csv"), keep_default_na=False)
    assert found["word"].tolist() == ["'=1+1", "-0.5", "'@x", "-"]
    about = pd.read_csv(file.with_name("campaign-variables.csv")).set_index("name")
    assert about.loc["word", "meaning"] == "'=cmd"


@pytest.mark.parametrize("block", [1 << 22, 100])
def test_tables(
    file: Path, campaign: xr.Dataset, block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same whether they are written at once or in blocks of samples."""
    monkeypatch.setattr(ringsim.export, "BLOCK", block)
    printed = export(file.parent, "--out", file.parent / "tables")
    known = {Path(line.removeprefix("wrote ")).name for line in printed.splitlines()}
    assert known == {path.name for path in (file.parent / "tables").iterdir()}
    samples = pd.read_csv(file.parent / "tables" / "campaign-sample.csv", keep_default_na=False)
    assert samples["status"].tolist() == ["ok", "ok", "timeout", "not_run"]
    assert samples["sample"].tolist() == [0, 1, 2, 3]
    assert samples["rods_young_modulus (Pa)"].astype(float).tolist() == [
        1e11 + 1e9 * k for k in range(4)
    ]
    assert samples["cables_lower_winch_stop_time (s)"].tolist() == ["3.0", "none"] * 2
    courses = pd.read_csv(file.parent / "tables" / "campaign-sample-plane-section-time.csv")
    assert list(courses) == ["sample", "plane", "section", "time (s)", "opening_angle (degree)"]
    found = courses.set_index(["sample", "plane", "section", "time (s)"]).iloc[:, 0].to_xarray()
    expected = campaign["opening_angle"].isel(sample=[0, 1, 2]).dropna("time", how="all")
    expected = expected.reindex(plane=found["plane"].to_numpy().astype(str))
    np.testing.assert_array_equal(found.to_numpy(), expected.to_numpy())
    assert courses["opening_angle (degree)"].notna().all()  # nothing after the end of a run
    about = pd.read_csv(file.parent / "tables" / "campaign-variables.csv").set_index("name")
    assert about.loc["rods_young_modulus", "meaning"] == "rods.young_modulus"
    assert about.loc["opening_angle", "dimensions"] == "sample plane section time"


def test_chosen_variables_alone_are_written(file: Path, campaign: xr.Dataset) -> None:
    out = file.parent / "few"
    chosen = ("--variables", "asynchrony_max, status", "--out", out)
    export(file, "--format", "csv,mat", *chosen)
    assert {path.name for path in out.iterdir()} == {
        "campaign-sample.csv", "campaign-variables.csv", "campaign.mat"
    }  # fmt: skip
    table = pd.read_csv(out / "campaign-sample.csv")
    assert list(table) == ["sample", "asynchrony_max (degree)", "status"]
    np.testing.assert_allclose(table.iloc[:, 1], campaign["asynchrony_max"], rtol=1e-12)
    assert "opening_angle" not in loadmat(out / "campaign.mat")
    # Inputs also by the name that analyse and the report have for them.
    export(file, "--variables", "cables.lower_winch_stop_time", "--out", file.parent / "own")
    table = pd.read_csv(file.parent / "own" / "campaign-sample.csv")
    assert list(table) == ["sample", "cables_lower_winch_stop_time (s)"]
    told = export(file, "--variables", "asynchrony_mx", code=2)
    assert "asynchrony_mx: is not a variable of this file (did you mean asynchrony" in told
    assert "has no effect with --format pvd" in export(
        file, "--format", "pvd", "--sample", 0, *chosen, code=2
    )


def test_large_tables_are_told_before_they_are_written(
    file: Path, campaign: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = ringsim.export.size_of_csv(campaign)
    assert "of CSV" not in export(file)
    tables = [*file.parent.glob(f"{file.stem}-*.csv")]
    written = sum(table.stat().st_size for table in tables if "variables" not in table.name)
    assert 0.5 * written < size < 2.0 * written
    monkeypatch.setattr(ringsim.export, "LARGE", size - 1.0)
    assert f"writing about {size_text(size)} of CSV: choose variables" in export(file)


def test_matlab(file: Path, run_file: Path, campaign: xr.Dataset) -> None:
    for where in (file, run_file):
        export(where, "--format", "mat")
    found = loadmat(file.with_suffix(".mat"), simplify_cells=True)
    for name in ("opening_angle", "position", "status", "time", "rods_young_modulus"):
        np.testing.assert_array_equal(found[name], campaign[name].to_numpy())
    assert found["reason"].tolist() == campaign["reason"].to_numpy().tolist()
    assert found["units"]["opening_angle"] == "degree"
    assert found["dimensions"]["position"] == "sample point axis time"
    assert found["codes"]["status"].startswith("-1 not_run, 0 ok, ")
    assert found["meaning"]["rods_young_modulus"] == "rods.young_modulus"
    assert 'name = "ring18-cable"' in found["attributes"]["scene"]
    run = loadmat(run_file.with_suffix(".mat"), simplify_cells=True)
    assert run["peak_tension"] == 21.0
    assert run["dimensions"]["peak_tension"] == "none"


def grids(path: Path) -> dict[float, meshio.Mesh]:
    """What a collection lists, by time, as meshio reads it."""
    sets = ElementTree.parse(path).getroot().findall("./Collection/DataSet")
    return {float(e.attrib["timestep"]): meshio.read(path.parent / e.attrib["file"]) for e in sets}


def test_paraview(run_file: Path) -> None:
    run, scene = xr.load_dataset(run_file), made_scene()
    export(run_file, "--format", "pvd")
    found, shape = grids(run_file.with_suffix(".pvd")), shape_of(run, scene)
    assert [*found] == pytest.approx(TIMES.tolist())
    assert COMPUTED in run_file.with_suffix(".pvd").read_text()
    names = run["point"].to_numpy().tolist()
    for moment in (0, 13):
        mesh = found[float(TIMES[moment])]
        expected = run["position"].isel(time=moment).transpose("point", "axis").to_numpy()
        np.testing.assert_allclose(mesh.points, expected, atol=1e-8)
        (cells,) = mesh.cells
        assert cells.type == "line"
        lengths = np.linalg.norm(np.diff(mesh.points[cells.data], axis=1)[:, 0], axis=1)
        part = [*shape.points.lines].index("bars")
        bars = mesh.cell_data["part"][0] == part
        rods = mesh.cell_data["part"][0] == [*shape.points.lines].index("diagonals")
        np.testing.assert_allclose(lengths[rods], scene.structure.half_diagonal, atol=1e-7)
        angle = run["opening_angle"].isel(time=moment)
        lag = angle - angle.mean()
        for plane in ("upper", "lower"):
            for section in range(1, SECTIONS + 1):
                joint = names.index(f"{plane} V-joint {section}")
                own = float(lag.sel(plane=plane, section=section))
                assert mesh.point_data["lag"][joint] == pytest.approx(own, abs=1e-7)
                ends = bars & (cells.data == joint).any(axis=1)
                assert ends.sum() == 2
                np.testing.assert_allclose(mesh.cell_data["lag"][0][ends], own, atol=1e-7)
                # Rows 4 and 5 are the halves of the upper bar, 6 and 7 those of the lower.
                rows = 1000.0 * (np.array([4, 5]) + 2 * (plane == "lower")) + section
                assert sorted(mesh.cell_data["stress"][0][ends]) == rows.tolist()


def test_paraview_of_a_turned_run_and_of_a_part_of_one(run_file: Path, tmp_path: Path) -> None:
    """Each joint has its own lag, in whatever order a file has them."""
    whole = xr.load_dataset(run_file)
    turned = whole.isel(section=slice(None, None, -1), plane=[1, 0])
    for name, each in (("turned", turned), ("cut", whole.isel(section=[1])),
                       ("instant", whole.isel(time=5))):  # fmt: skip
        save(each, tmp_path / f"{name}.nc")
    export(run_file, "--format", "pvd")
    export(tmp_path / "turned.nc", "--format", "pvd")
    both = grids(run_file.with_suffix(".pvd")), grids(tmp_path / "turned.pvd")
    for time, mesh in both[0].items():
        other = both[1][time]
        np.testing.assert_array_equal(mesh.points, other.points)
        np.testing.assert_array_equal(mesh.point_data["lag"], other.point_data["lag"])
    for name, told in (("cut", "section is only 2 in"), ("instant", "time is only 2.5 in")):
        assert told in export(tmp_path / f"{name}.nc", "--format", "pvd", code=2)
    export(tmp_path / "instant.nc", "--format", "csv")
    numbers = pd.read_csv(tmp_path / "instant-plane-section.csv")
    assert len(numbers) == 2 * SECTIONS


def test_paraview_of_samples(file: Path, campaign: xr.Dataset) -> None:
    """Without positions they follow from the angles, which is told."""
    save(campaign.drop_vars("position").drop_dims(["point", "axis"]), file)
    export(file, "--format", "pvd", "--sample", 0, "--sample", 2)
    assert len(grids(file.with_name("campaign-sample0.pvd"))) == len(TIMES)
    assert max(grids(file.with_name("campaign-sample2.pvd"))) == 4.0
    assert FROM_ANGLES in file.with_name("campaign-sample2.pvd").read_text()


def test_what_cannot_be_exported_is_refused(
    file: Path, run_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    xr.Dataset({"verdict": 1.0}).to_netcdf(file.with_name("analysis.nc"))
    few = file.with_name("few.nc")  # sample 1 failed at once
    part = xr.load_dataset(file).isel(sample=[3, 1])
    part["opening_angle"][1], part["position"][1] = np.nan, np.nan
    part["status"][1] = int(Status.DIVERGED)
    save(part, few)
    refusals = [
        ((file, "--format", "xls"), "--format xls: 'xls' is not an export format (known: csv"),
        ((file, "--format", "pvd"), "is for single runs, and this is a campaign: choose"),
        ((file, "--sample", 9), "--sample 9: "),
        ((run_file, "--sample", 0), "has only one run: leave it out"),
        ((file, "--format", "pvd", "--sample", 3), "--sample 3: it has not run, so that"),
        ((few, "--sample", 0), f"{few} has samples 1, 3: choose one of them"),
        ((few, "--format", "pvd", "--sample", 1), "ended before its first record: there is noth"),
        ((file.with_name("analysis.nc"),), "has neither a run nor a campaign"),
        ((file.with_name("gone.nc"),), "there is no such file"),
    ]  # fmt: skip
    for words, told in refusals:
        assert told in export(*words, code=2)
    for bound, most, told in (
        ("MOST_BYTES", 1000, "of a MATLAB file at most 2.1 GB: choose fewer"),
        ("LONGEST_NAME", 20, "and MATLAB's names at most 20"),
    ):
        with monkeypatch.context() as patched:
            patched.setattr(ringsim.export, bound, most)
            assert told in export(file, "--format=mat", code=2)
    assert not list(file.parent.glob("*.mat"))


def test_counts_are_whole_numbers_and_what_is_none_is_left_as_it_is(
    campaign: xr.Dataset, tmp_path: Path
) -> None:
    """Where some are missing, too, and of checks; a mean or what no count's type holds is kept."""
    counts = np.array([12.0, 11.0, np.nan, np.nan])
    own = {"locked_joints": counts, "locked_joints_checked": counts, "asynchrony_max": 2.0 * counts}
    save(campaign.assign({name: ("sample", each) for name, each in own.items()}),
         tmp_path / "campaign.nc")  # fmt: skip
    export(tmp_path / "campaign.nc", "--format", "csv", "--out", tmp_path)
    head, *rows = (tmp_path / "campaign-sample.csv").read_text().splitlines()
    cells = [dict(zip(head.split(","), row.split(","), strict=True)) for row in rows]
    for name, text in (("locked_joints", ["12", "11", "", ""]),
                       ("locked_joints_checked", ["12", "11", "", ""])):  # fmt: skip
        assert [row[name] for row in cells] == text
    assert next(v for k, v in cells[0].items() if k.startswith("asynchrony_max")) == "24.0"
    for values in ([11.5, 12.0], [3e9, 1.0], [-1.0, 2.0]):
        save(xr.Dataset({"locked_joints": ("sample", np.array(values))}), tmp_path / "some.nc")
        with xr.open_dataset(tmp_path / "some.nc") as found:
            assert found["locked_joints"].values.tolist() == values


def test_a_title_of_hyphens_is_no_end_of_a_comment(run_file: Path) -> None:
    with netCDF4.Dataset(run_file, "a") as file:
        file.title = "Opening --- cold -- case"
    export(run_file, "--format", "pvd")
    text = run_file.with_suffix(".pvd").read_text()
    assert "Opening - - - cold - - case" in text
    ElementTree.fromstring(text)
    for file in run_file.parent.glob("*-vtu/*.vtu"):
        ElementTree.parse(file)


def test_a_variable_called_as_a_table_of_the_file_keeps_its_values(run_file: Path) -> None:
    with netCDF4.Dataset(run_file, "a") as file:
        file.createVariable("units", "f8")[...] = 7.0
    export(run_file, "--format", "mat")
    found = loadmat(run_file.with_suffix(".mat"), simplify_cells=True)
    assert found["units_"] == 7.0
    assert found["units"]["peak_tension"] == "N"
