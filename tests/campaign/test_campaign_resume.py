"""What was stored counts, whoever stored it, in whatever order, and whatever was deleted since."""

from __future__ import annotations

import pytest

from campaign_bench import START, assert_same, finished, shards
from ringsim.campaign.folder import open_folder
from ringsim.execution.solve import load_solver, solve
from ringsim.execution.work import Task
from ringsim.refusal import InputError
from ringsim.storage.journal import read_journal
from ringsim.storage.locks import reserved
from ringsim.storage.record import Result
from ringsim.storage.shards import write_shards
from ringsim.storage.store import Store, create_folders, survey
from ringsim.variables import Status


def unseal(bench, writer, samples):
    """Leave results of some samples in a journal, as a killed writer does."""
    folder = open_folder(bench.folder / "out")
    store = Store(folder.path, folder.identity, writer, 1000)
    solver = load_solver("fake_solver:run")
    for sample in samples:
        store.keep(solve(solver, folder.scene, Task(sample, folder.table.values_of(sample))))
    (path,) = (folder.path / "journals").glob(f"{writer}-*.journal")
    assert len(list(read_journal(path))) == len(samples)
    return path


@pytest.mark.parametrize("delete", ["the merged file", "half of the shards", "all shards"])
def test_what_is_deleted_is_made_again(delete, copied, whole):
    (copied.folder / "out" / "campaign.nc").unlink()
    gone = {"the merged file": 0, "half of the shards": 3, "all shards": 5}[delete]
    for path in shards(copied)[:gone]:
        path.unlink()
    kept = finished(copied.folder / "out")
    assert len(kept) == 20 - 4 * gone
    assert f"{len(kept)} of 20 samples done" in copied.run(*START)
    assert_same(copied, whole)


@pytest.mark.parametrize("writer", ["all-rank0", "part1of2-rank1", "part3of9-rank0"])
@pytest.mark.parametrize("again", [("--workers", 2), ("--part", "1/1"), ("--part", "1/2")])
def test_journal_of_any_dead_writer_is_taken_up(writer, again, copied, whole):
    """Also by a run that divides the samples in another way."""
    shards(copied)[0].unlink()
    (copied.folder / "out" / "campaign.nc").unlink()
    lost = sorted(set(range(20)) - finished(copied.folder / "out"))
    unseal(copied, writer, lost)
    assert len(finished(copied.folder / "out")) == 20
    copied.run("campaign", "small.toml", "--out", "out", *again)
    assert_same(copied, whole)
    assert not list((copied.folder / "out" / "journals").iterdir())


def test_part_waits_for_what_another_part_has_not_sealed(copied, whole):
    """A sample in the journal of a running part is done, but cannot be merged yet."""
    for path in shards(copied):
        path.unlink()
    (copied.folder / "out" / "campaign.nc").unlink()
    journal = unseal(copied, "part2of2-rank0", range(1, 20, 2))
    with reserved(copied.folder / "out", "part2of2", alone=False):
        printed = copied.run("campaign", "small.toml", "--out", "out", "--part", "1/2")
        assert "this part is done; 10 samples of other parts are left" in printed
        assert "10 not run" in copied.run("merge", "out")
        assert journal.exists()
        assert (copied.result("out").status.values[1::2] == -1).all()
    assert "0 not run" in copied.run("merge", "out")
    assert_same(copied, whole)


def test_records_are_read_back_though_the_file_is_gone(copied):
    """As on a file system without locks, where two processes may take up one journal."""
    folder = open_folder(copied.folder / "out")
    for path in shards(copied):
        path.unlink()
    store = Store(folder.path, folder.identity, "all-rank0", 1000)
    solver = load_solver("fake_solver:run")
    for sample in (3, 1):
        store.keep(solve(solver, folder.scene, Task(sample, folder.table.values_of(sample))))
    (journal,) = (folder.path / "journals").iterdir()
    journal.unlink()
    store.close()
    assert finished(folder.path) == {1, 3}


def test_damaged_record_of_a_journal_costs_only_itself(copied):
    for path in shards(copied):
        path.unlink()
    journal = unseal(copied, "all-rank0", range(10))
    content = bytearray(journal.read_bytes())
    content[len(content) // 2 + 500] ^= 1
    journal.write_bytes(content)
    assert "9 of 20 samples done" in copied.run(*START)


@pytest.mark.parametrize("order", [1, -1])
def test_success_counts_before_failure_whatever_the_clock_said(order, tmp_path):
    create_folders(tmp_path)
    results = [
        Result(0, Status.ERROR, "later by a clock that was wrong", finished=2e9),
        Result(0, Status.OK, "fine", finished=1e9),
        Result(1, Status.OK, "first", seconds=1.0, finished=1.0),
        Result(1, Status.OK, "second", seconds=2.0, finished=2.0),
        Result(2, Status.ERROR, "never", finished=5.0),
    ]
    for result in results[::order]:
        write_shards(tmp_path, [result], "me")
    found = survey(tmp_path, "me", 3, set_aside=False)
    assert found.status.tolist() == [Status.OK, Status.OK, Status.ERROR]
    assert found.seconds[1] == 2.0
    assert found.sealed.all()


def test_results_without_their_design_are_refused(copied):
    (copied.folder / "out" / "design.nc").unlink()
    before = shards(copied)
    (copied.folder / "out" / "campaign.nc").unlink()
    printed = copied.run(*START, code=2)
    assert "design.nc is gone" in printed
    assert shards(copied) == before


def test_design_that_is_none_is_refused_in_one_line(copied):
    out = copied.folder / "out"
    merged = (out / "campaign.nc").read_bytes()
    for content in (b"", b"no netCDF", merged[:5000], (shards(copied)[0]).read_bytes()):
        (out / "design.nc").write_bytes(content)
        with pytest.raises(InputError, match=r"design\.nc: .*choose another folder"):
            open_folder(out)
    printed = copied.run("status", "out", code=2)
    assert len(printed.splitlines()) == 1


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
    assert "this folder holds another campaign (its scene differs)" in printed
