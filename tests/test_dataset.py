"""A run survives the way into its file and back, whole or not at all."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from loops import for_each
from ring_rods import RODS

from ringsim.build import sources
from ringsim.dataset import open_lazily, require_declared, save, to_dataset
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.refusal import InputError
from ringsim.scene import Scene, scene_from_table, scene_from_toml
from ringsim.variables import Cause, Fidelity, Outcome, Status

pytestmark = pytest.mark.quick

TIMES = np.array([0.0, 0.1, 0.25])


def scene_of(sections: int = 4, *, stress: bool = False) -> Scene:
    table = {
        "name": "bench",
        "title": 'quotes "and" umlauts ä, °',
        "structure": {"kind": "pantograph-ring", "sections": sections},
        "record": {"stress": stress},
        "loads": {"force": 0.1 + 0.2},
    }
    return scene_from_table(table, source="test")


def full_outcome(sections: int = 4) -> Outcome:
    """Every variable, filled with random bits of full precision and some NaN."""
    random = np.random.default_rng(7)
    sizes = {"plane": 2, "section": sections, "time": len(TIMES), "rod": len(RODS), "span": 6}
    sizes |= {"station": 5, "point": 4, "axis": 3, "winch": 2, "resistance": 3, "corner": 4}
    sizes |= {"pulley": 5}
    values = {}
    for name, variable in VARIABLES.items():
        shape = tuple(sizes[dim] for dim in variable.dims)
        if variable.dtype == "str":
            values[name] = np.full(shape, "upper")
        elif np.dtype(variable.dtype).kind == "i":
            values[name] = random.integers(0, 100, shape)  # codes have 8 bits
        else:
            values[name] = random.normal(size=shape).astype(variable.dtype)
            if variable.dims:
                values[name][..., -1] = np.nan
    del values["status"], values["cause"]
    values["fidelity"] = np.array(int(Fidelity.FRAME))
    coordinates = {
        "plane": np.array(["upper", "lower"]),
        "section": np.arange(1, sections + 1),
        "time": TIMES,
        "rod": np.array(RODS),
        "span": np.arange(1, 7),
        "pulley": np.arange(1, 6),
        "station": np.linspace(0.05, 0.6, 5),
        "winch": np.array([1, 2]),
        "resistance": np.array(["pulley friction", "joint friction", "net"]),
        "axis": np.array(["x", "y", "z"]),
        "corner": np.arange(1, 5),
        "point": np.array(["upper corner 1", "hub", "boom tip", "upper V-joint 1"]),
    }
    return Outcome(Status.OK, "all V-joints have locked", coordinates, values)


def failed_outcome() -> Outcome:
    return Outcome(Status.CRASHED, "the solver process died: try a smaller step")


def reopened(dataset: xr.Dataset, path) -> xr.Dataset:
    save(dataset, path)
    with xr.open_dataset(path, engine="netcdf4") as found:
        return found.load()


def test_file_gives_back_every_bit(tmp_path):
    outcome = full_outcome()
    written = to_dataset(outcome, scene_of(stress=True))
    read = reopened(written, tmp_path / "run.nc")
    xr.testing.assert_identical(read, written)
    assert set(read.data_vars) == set(VARIABLES)
    for name, values in outcome.values.items():
        if VARIABLES[name].dtype != "str":
            assert read[name].dtype == VARIABLES[name].dtype
        np.testing.assert_array_equal(read[name].values, values)


def test_every_variable_carries_dimensions_units_and_meaning():
    dataset = to_dataset(full_outcome(), scene_of(stress=True))
    for name, variable in VARIABLES.items():
        assert dataset[name].dims == variable.dims
        assert dataset[name].attrs.get("units", "1") == variable.units
        assert dataset[name].attrs["long_name"] == variable.long_name
    for name, coordinate in COORDINATES.items():
        assert dataset[name].attrs["long_name"] == coordinate.long_name
    assert dataset.time.attrs["units"] == "s"
    assert dataset.plane.values.tolist() == ["upper", "lower"]
    assert dataset.section.values.tolist() == [1, 2, 3, 4]


def test_time_stays_a_number_of_seconds(tmp_path):
    read = reopened(to_dataset(full_outcome(), scene_of()), tmp_path / "run.nc")
    assert read.time.dtype == "f8"
    np.testing.assert_array_equal(read.time.values, TIMES)


@for_each("status", list(Status))
def test_status_is_a_flag_with_a_reason(status, tmp_path):
    dataset = to_dataset(Outcome(status, "because", cause=Cause.NEWTON), scene_of())
    read = reopened(dataset, tmp_path / "run.nc")
    flags = read.status.attrs["flag_values"]
    words = read.status.attrs["flag_meanings"].split()
    assert read.status.dtype == np.int8
    assert flags.dtype == np.int8
    assert words[flags.tolist().index(int(read.status))] == status.word
    assert read.attrs["reason"] == "because"
    words = dict(zip(read.cause.flag_values, read.cause.flag_meanings.split(), strict=True))
    assert words[read.cause.item()] == "newton"


def test_scene_comes_back_equal_from_the_file(tmp_path):
    scene = scene_of(7)
    read = reopened(to_dataset(full_outcome(7), scene), tmp_path / "run.nc")
    assert scene_from_toml(read.attrs["scene"], source="file") == scene


def test_origin_is_in_the_file():
    attributes = to_dataset(full_outcome(), scene_of()).attrs
    assert attributes["Conventions"].startswith("CF-1.11")
    assert attributes["title"] == scene_of().title
    assert attributes["numpy_version"] == np.__version__
    assert attributes["python_version"] == sys.version.split()[0]
    assert attributes["exudyn_version"].startswith("1.13")
    assert attributes["ringsim_version"] in attributes["source"]
    assert attributes["sources"] == sources()
    assert attributes["date_created"].endswith("Z")
    assert attributes["date_created"] in attributes["history"]
    assert "bench" in attributes["summary"]


def test_crashed_run_has_the_same_scalars_all_missing(tmp_path):
    read = reopened(to_dataset(failed_outcome(), scene_of()), tmp_path / "run.nc")
    timeless = {n for n, v in VARIABLES.items() if "time" not in v.dims and not v.needs}
    assert set(read.data_vars) == timeless
    assert read.lock_time.shape == (2, 4)
    for name in timeless - {"status", "cause"}:
        missing = read[name] == "" if VARIABLES[name].dtype == "str" else np.isnan(read[name])
        assert missing.all(), name
    assert np.isnan(read.steps)


def test_missing_counts_stay_whole_numbers_on_disk(tmp_path):
    path = tmp_path / "run.nc"
    save(to_dataset(failed_outcome(), scene_of()), path)
    with xr.open_dataset(path, mask_and_scale=False) as raw:
        assert raw.steps.dtype == np.int32
        assert raw.steps.item() == raw.steps.attrs["_FillValue"] == -1


def test_stress_is_only_promised_if_recorded():
    assert "peak_rod_stress" not in to_dataset(failed_outcome(), scene_of())
    assert "peak_rod_stress" in to_dataset(failed_outcome(), scene_of(stress=True))
    assert "rod" not in to_dataset(failed_outcome(), scene_of(stress=True)).coords


def test_numeric_arrays_are_compressed_and_no_dimension_is_unlimited(tmp_path):
    save(to_dataset(full_outcome(), scene_of()), tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as read:
        for name in ("opening_angle", "lock_time", "asynchrony"):
            assert read[name].encoding["zlib"]
            assert read[name].encoding["shuffle"]
            assert read[name].encoding["complevel"] == 4
        assert not read.encoding["unlimited_dims"]


def test_saving_again_forgets_the_encoding_of_an_older_file(tmp_path):
    dataset = to_dataset(full_outcome(), scene_of())
    dataset.asynchrony.encoding = {"dtype": "i2", "scale_factor": 0.1}
    read = reopened(dataset, tmp_path / "run.nc")
    np.testing.assert_array_equal(read.asynchrony.values, dataset.asynchrony.values)


@for_each(
    ("values", "message"),
    [
        ({"oppening_angle": np.zeros(3)}, "oppening_angle"),
        ({"asynchrony": np.zeros((2, 3))}, "asynchrony"),
        ({"asynchrony": np.zeros(5)}, "time"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(values, message):
    outcome = Outcome(Status.OK, "", {"time": TIMES}, values)
    with pytest.raises(ValueError, match=message):
        to_dataset(outcome, scene_of())


def sound_run() -> xr.Dataset:
    """A run whose places are among those of its coordinates."""
    return to_dataset(failed_outcome(), scene_of()).assign_coords(section=[1, 2, 3, 4])


@for_each(
    ("change", "message"),
    [
        (lambda run: run, ""),
        (lambda run: run.assign(lock_time=("other", np.zeros(8))), r"lock_time has the dim.*other"),
        (lambda run: run.assign(lock_time=run.lock_time.T), ""),  # people turn them round
        (lambda run: run.assign(steps="many"), "steps must hold numbers"),
        (lambda run: run.assign(asynchrony_leader_plane=3), "asynchrony_leader_plane must hold te"),
        (lambda run: run.assign(asynchrony_leader_section=9), "holds 9, which is not a section"),
        (lambda run: run.assign_coords(section=[1, 1, 2, 3]), "section holds a value twice"),
        (lambda run: run.assign_attrs(title=3), "its attribute title must be a text"),
        (lambda run: run.assign_attrs(requirements="{"), "its attribute requirements is no JSON"),
        (lambda run: run.assign_attrs(scene="%s {0}"), "its attribute scene is no TOML"),
        (
            lambda run: run.drop_vars("section").assign(section=("other", [1, 2])),
            "section must have the dimension section alone",
        ),
    ],
)
def test_a_run_that_is_not_as_declared_is_refused_with_what_is_wrong(change, message):
    run = change(sound_run())
    if not message:
        require_declared(run, Path("run.nc"))
        return
    with pytest.raises(
        InputError, match=rf"run\.nc: .*{message}.*: it is damaged, changed, or a part"
    ):
        require_declared(run, Path("run.nc"))


def test_drafts_of_killed_writers_are_removed_and_those_of_living_ones_kept(tmp_path):
    old, young, other = (tmp_path / f".{n}.draft" for n in ("run.nc.1", "run.nc.2", "ran.nc.1"))
    for draft in (old, young, other):
        draft.touch()
    for draft in (old, other):
        os.utime(draft, (1e9, 1e9))
    save(to_dataset(failed_outcome(), scene_of()), tmp_path / "run.nc")
    assert sorted(tmp_path.iterdir()) == sorted([tmp_path / "run.nc", young, other])


def test_missing_folder_is_refused_with_its_name(tmp_path):
    with pytest.raises(InputError, match=r"no folder .*absent"):
        save(to_dataset(failed_outcome(), scene_of()), tmp_path / "absent" / "run.nc")


def test_folder_instead_of_a_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        save(to_dataset(failed_outcome(), scene_of()), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("broken", ["write", "replace"])
def test_interrupted_write_leaves_the_old_file_and_no_draft(broken, tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    old = to_dataset(full_outcome(), scene_of())
    save(old, path)

    def full_disk(*arguments, **keywords):
        raise OSError(28, "No space left on device")

    owner, name = (xr.Dataset, "to_netcdf") if broken == "write" else (os, "replace")
    monkeypatch.setattr(owner, name, full_disk)
    with pytest.raises(InputError, match=r"run\.nc: cannot be written: No space left"):
        save(to_dataset(failed_outcome(), scene_of()), path)
    monkeypatch.undo()
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]
    with xr.open_dataset(path) as read:
        xr.testing.assert_identical(read.load(), old)


def test_long_sentences_of_samples_take_no_room_in_the_others(tmp_path: Path) -> None:
    log = np.full(50, "", dtype=object)
    log[7] = "x" * 4000
    reason = np.full(50, "all V-joints have locked", dtype=object)
    columns = {"final_time": np.linspace(0.0, 1.0, 50), "log": log, "reason": reason}
    columns["status"] = np.zeros(50, dtype="i1")
    made = xr.Dataset({name: ("sample", values) for name, values in columns.items()})
    made["log"].attrs["long_name"] = "last lines"
    made.attrs["title"] = "made"
    made.to_netcdf(tmp_path / "made.nc")
    before = netCDF4.get_chunk_cache()
    with open_lazily(tmp_path / "made.nc") as found, xr.open_dataset(tmp_path / "made.nc") as plain:
        assert netCDF4.get_chunk_cache() == before
        assert list(found.data_vars) == list(plain.data_vars)
        assert found.attrs == plain.attrs
        assert found["log"].attrs == plain["log"].attrs
        assert found["log"].nbytes + found["reason"].nbytes < 2000
        assert len({id(text) for text in found["reason"].values}) == 1
        for name in columns:
            assert found[name].values.tolist() == plain[name].values.tolist()


def test_a_sentence_of_a_part_of_a_campaign_is_kept(tmp_path):
    """Of one sample of a campaign it is no sentence over samples, and stays as xarray reads it."""
    run = to_dataset(failed_outcome(), scene_of())
    part = run.assign(reason=((), "it ended so"))
    part.to_netcdf(tmp_path / "part.nc")
    with open_lazily(tmp_path / "part.nc") as found:
        assert found["reason"].item() == "it ended so"
        # And once more while it is open, as a comparison with itself does.
        with open_lazily(tmp_path / "part.nc") as again:
            assert again["reason"].item() == "it ended so"
