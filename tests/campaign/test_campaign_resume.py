"""What was stored counts, whoever stored it, in whatever order, and whatever was deleted since."""

from __future__ import annotations

import re
from dataclasses import replace

import netCDF4
import pytest
import xarray as xr

from campaign_bench import START, assert_same, finished, journals, lose
from ringsim.campaign.folder import open_folder
from ringsim.execution.work import load_solver, solve
from ringsim.refusal import InputError
from ringsim.storage.journal import FOLDER, Journal, read_journal, survey
from ringsim.storage.netcdf import reserved
from ringsim.storage.result import Result
from ringsim.variables import Status


def write_journal(bench, writer, samples):
    """Leave a journal with results of some samples, as a killed writer does."""
    folder = open_folder(bench.folder / "out")
    journal = Journal(folder.path, writer)
    solver = load_solver("fake_solver:run")
    for sample in samples:
        result = solve(solver, folder.scene, sample, folder.table.values_of(sample))
        journal.append(replace(result, run_with=folder.run_with[sample]))
    assert len(list(read_journal(journal.path))) == len(samples)
    return journal.path


@pytest.mark.parametrize("delete", ["the merged file", "half of the results", "all journals"])
def test_what_is_deleted_is_made_again(delete, copied, whole):
    gone = {"the merged file": 0, "half of the results": 12, "all journals": 20}[delete]
    lose(copied, range(gone))
    kept = finished(copied.folder / "out")
    assert len(kept) == 20 - gone
    assert f"{len(kept)} of 20 samples done" in copied.run(*START)
    assert_same(copied, whole)


WRITERS = ("all-rank0", "part1of2-rank1", "part3of9-rank0")
AGAIN = (("--workers", 2), ("--part", "1/1"), ("--part", "1/2"))


@pytest.mark.parametrize(
    ("writer", "again"),
    [
        pytest.param(writer, again, marks=() if k == n else pytest.mark.slow)
        for k, writer in enumerate(WRITERS)
        for n, again in enumerate(AGAIN)
    ],
)
def test_journal_of_any_dead_writer_counts(writer, again, copied, whole):
    """Also for a run that divides the samples in another way."""
    lose(copied, range(3, 7))
    write_journal(copied, writer, range(3, 7))
    assert len(finished(copied.folder / "out")) == 20
    before = journals(copied)
    copied.run("campaign", "small.toml", "--out", "out", *again)
    assert_same(copied, whole)
    assert journals(copied) == before


def test_part_merges_what_another_part_that_runs_has_done(copied, whole):
    lose(copied, range(20))
    write_journal(copied, "part2of2-rank0", range(1, 11, 2))
    with reserved(copied.folder / "out", "part2of2", alone=False):
        printed = copied.run("campaign", "small.toml", "--out", "out", "--part", "1/2")
        assert "this part is done; 5 samples of other parts left" in printed
        assert "5 not run" in copied.run("merge", "out")
        assert (copied.result("out").status.values[11::2] == -1).all()
        write_journal(copied, "part2of2-rank1", range(11, 20, 2))
        assert "0 not run" in copied.run("merge", "out")
    assert_same(copied, whole)


@pytest.mark.parametrize("place", ["frame", "sizes", "header", "body"])
def test_damaged_record_of_a_journal_costs_only_itself(place, copied):
    (journal,) = journals(copied)
    content = bytearray(journal.read_bytes())
    starts = [found.start() for found in re.finditer(b"ringsim3", content)]
    content[starts[9] + {"frame": 3, "sizes": 19, "header": 60, "body": 1000}[place]] ^= 64
    journal.write_bytes(content)
    assert "19 of 20 samples done" in copied.run(*START)


@pytest.mark.parametrize("order", [1, -1])
def test_success_counts_before_failure_whatever_the_clock_said(order, tmp_path):
    (tmp_path / FOLDER).mkdir()
    results = [
        Result(0, Status.ERROR, "later by a clock that was wrong", finished=2e9),
        Result(0, Status.OK, "fine", finished=1e9),
        Result(1, Status.OK, "first", seconds=1.0, finished=1.0),
        Result(1, Status.OK, "second", seconds=2.0, finished=2.0),
        Result(2, Status.ERROR, "never", finished=5.0),
    ]
    journal = Journal(tmp_path, "all-rank0")
    for result in results[::order]:
        journal.append(result)
    found = survey(tmp_path, [""] * 3)
    assert found.status.tolist() == [Status.OK, Status.OK, Status.ERROR]
    assert found.seconds[1] == 2.0
    assert {result.reason for result in found.results([0, 1, 2])} == {"fine", "second", "never"}


def test_results_without_their_design_are_refused(copied):
    (copied.folder / "out" / "design.nc").unlink()
    before = journals(copied)
    (copied.folder / "out" / "campaign.nc").unlink()
    printed = copied.run(*START, code=2)
    assert "but design.nc, which describes their campaign, is missing" in printed
    assert journals(copied) == before


def test_a_journal_that_is_no_file_is_refused_in_one_line(copied):
    out = copied.folder / "out"
    journal = next((out / FOLDER).glob("*.journal"))
    journal.unlink()
    for target in ("nowhere", journal.name):  # a link to nothing, and to itself
        journal.symlink_to(target)
        for words in (("analyse", "out"), ("status", "out")):
            printed = copied.run(*words, code=2)
            assert "must be a journal of the campaign, and is no file" in printed
            assert "Traceback" not in printed
        journal.unlink()


def test_design_that_is_none_is_refused_in_one_line(copied):
    out = copied.folder / "out"
    merged = (out / "campaign.nc").read_bytes()
    xr.Dataset({"x": 1.0}).to_netcdf(copied.folder / "other.nc")
    other = (copied.folder / "other.nc").read_bytes()
    for content in (b"", b"no netCDF", merged[:5000], other):
        (out / "design.nc").write_bytes(content)
        with pytest.raises(InputError, match=r"design\.nc: .*choose another folder"):
            open_folder(out)
    printed = copied.run("status", "out", code=2)
    assert len(printed.splitlines()) == 1


def test_a_folder_from_before_a_key_came_says_so(bench):
    start = ("campaign", bench.write(4), "--out", "out")
    bench.run(*start)
    with netCDF4.Dataset(bench.folder / "out" / "design.nc", "a") as file:
        scene = file.getncattr("scene")
        assert "restarts = 2\n" in scene
        file.setncattr("scene", scene.replace("restarts = 2\n", ""))
    printed = bench.run(*start, code=2)
    assert "its scene differs: it was written by an older version of ringsim" in printed


def test_changed_scene_file_is_another_campaign(bench):
    file = bench.write(4)
    (bench.folder / "mine.toml").write_text(bench.run("scenes", "ring18"))
    file.write_text(file.read_text().replace('"ring18"', '"mine.toml"'))
    start = ("campaign", file, "--out", "out")
    bench.run(*start)
    bench.run(*start)
    scene = (bench.folder / "mine.toml").read_text()
    assert "half_bar = 0.2889" in scene
    (bench.folder / "mine.toml").write_text(scene.replace("half_bar = 0.2889", "half_bar = 0.28"))
    printed = bench.run(*start, code=2)
    assert "this folder has another campaign (its scene differs" in printed
    assert "differs: structure.half_bar = 0.28 instead of 0.2889)" in printed


def test_status_tells_outcomes_as_the_end_of_the_campaign_does(bench):
    """Also of a part, before anything is merged."""
    file = bench.write_listed([30] * 8)
    half = bench.run("campaign", file, "--out", "out", "--part", "1/2", solver="fake_solver:fated")
    assert "deployed" not in half
    assert not (bench.folder / "out" / "campaign.nc").exists()
    told = bench.run("status", "out")
    assert "deployed: 1 of 4\n" in told  # of those that have run
    assert "stalled: 2 of 4 (samples 2, 4): sample 2: nothing drives it" in told
    assert told.endswith("  next           ringsim campaign FILE --out out continues it\n")
    whole = bench.run("campaign", file, "--out", "out", solver="fake_solver:fated")
    for line in (
        "deployed: 2 of 8\n",
        "stalled: 3 of 8 (samples 2, 3, 4): sample 2: nothing drives it\n",
        "solver failed: 3 of 8, first sample 5: Newton does not converge: try a smaller step\n",
    ):
        assert line in whole
        assert line in bench.run("status", "out")
    assert bench.run("status", "out").endswith("  next           ringsim analyse out\n")
    (bench.folder / "out" / "campaign.nc").unlink()
    assert bench.run("status", "out").endswith("  next           ringsim merge out\n")
