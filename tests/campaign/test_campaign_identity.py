"""The merged file has the same values, whoever computed it and in whatever order."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from campaign_bench import Bench, comparable, journals
from ringsim.outputs import VARIABLES


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("reference"))
    bench.run("campaign", bench.write(), "--workers", 0, "--out", "out")
    return bench.result("out")


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 4])
def test_local_workers_give_the_serial_file(workers, bench, reference):
    bench.run("campaign", bench.write(), "--workers", workers, "--out", "out")
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(reference))


@pytest.mark.slow
def test_mpi_ranks_give_the_serial_file(bench, reference, mpi):
    """Three; two do the same with checks, see test_campaign_judge.py."""
    bench.run("campaign", bench.write(), "--out", "out", ranks=3)
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(reference))


def test_parts_in_any_order_give_the_serial_file(bench, reference):
    file = bench.write()
    for part in (3, 1, 2):
        assert not (bench.folder / "out" / "campaign.nc").exists()
        bench.run("campaign", file, "--part", f"{part}/3", "--out", "out")
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(reference))


def test_growing_a_design_gives_the_file_of_the_large_one(bench, reference):
    bench.run("campaign", bench.write(samples=8), "--workers", 2, "--out", "out")
    bench.run("campaign", bench.write(samples=20), "--workers", 2, "--out", "out")
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(reference))


@pytest.mark.quick
def test_file_says_what_everything_is(reference):
    assert reference.sample.attrs["standard_name"] == "realization"
    assert reference.sample.attrs["units"] == "1"
    assert reference.rods_young_modulus.dims == ("sample", "section")
    assert reference.rods_young_modulus.attrs["units"] == "Pa"
    assert reference.rods_young_modulus.attrs["path"] == "rods.young_modulus"
    assert reference.opening_angle.dims == ("sample", "plane", "section", "time")
    for name in set(reference.data_vars) & set(VARIABLES):
        assert reference[name].attrs.get("units", "1") == VARIABLES[name].units
        assert reference[name].attrs["long_name"] == VARIABLES[name].long_name
    flags = reference.status.attrs["flag_values"]
    assert len(reference.status.attrs["flag_meanings"].split()) == len(flags)
    assert reference.status.dtype == np.int8
    assert (reference.status == 0).all()
    for name in ("title", "summary", "history", "date_created", "license", "Conventions"):
        assert reference.attrs[name]
    assert int(reference.attrs["seed"]) == 7
    assert "ring6" in reference.attrs["scene"]
    assert "[inputs]" in reference.attrs["campaign"]
    assert reference.attrs["git_commit"]


@pytest.mark.quick
def test_inputs_are_what_was_run(reference):
    modulus = reference.rods_young_modulus.values.mean(axis=1)
    expected = 2.0 / np.sqrt(reference.loads_force.values) * (1.0 + 1e9 / modulus)
    np.testing.assert_allclose(reference.deployment_time.values, expected, rtol=1e-15)


@pytest.mark.quick
def test_missing_counts_are_missing_and_times_are_numbers(reference):
    assert reference.steps.values.tolist() == [100] * 20
    assert np.isnan(reference.newton_iterations).all()
    assert reference.time.dtype == "f8"


def test_second_run_has_nothing_to_do(bench):
    file = bench.write()
    bench.run("campaign", file, "--workers", 2, "--out", "out")
    before = journals(bench)
    printed = bench.run("campaign", file, "--workers", 2, "--out", "out")
    assert "20 of 20 samples done" in printed
    assert journals(bench) == before


@pytest.mark.quick
def test_sample_seeds_depend_on_seed_and_index_alone(reference):
    for sample in (0, 13):
        state = np.random.SeedSequence(7, spawn_key=(sample,)).generate_state(1, np.uint64)[0]
        assert reference.sample_seed.values[sample] == int(state >> np.uint64(1))
