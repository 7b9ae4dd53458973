"""Journals are read once: what was verified is remembered for as long as it holds."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from campaign_bench import START, assert_same, finished, journals
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import merge
from ringsim.storage import journal as journal_file
from ringsim.storage.journal import FOLDER, NAME, Journal, read_journal, survey
from ringsim.storage.result import Result, pack, stacked
from ringsim.variables import Status


@pytest.fixture
def checksums(monkeypatch):
    """Counts the checksums that are computed."""
    real, counted = journal_file.checksum, []

    def counting(*parts):
        counted.append(1)
        return real(*parts)

    monkeypatch.setattr(journal_file, "checksum", counting)
    return counted


def filled(folder, samples, writer="all-rank0"):
    (folder / FOLDER).mkdir(exist_ok=True)
    journal = Journal(folder, writer)
    for sample in samples:
        journal.append(Result(sample, Status.OK, "fine", seconds=1.0 + sample, finished=sample))
    return journal


def alike(one, other):
    for name in ("status", "seconds", "form", "owner", "place", "attempts"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_second_look_computes_no_checksum(tmp_path, checksums):
    filled(tmp_path, range(5)).close()
    filled(tmp_path, range(3, 8), "part2of2-rank0").close()
    checksums.clear()
    first = survey(tmp_path, [""] * 9)
    assert len(checksums) == 10
    again = survey(tmp_path, [""] * 9)
    assert len(checksums) == 10
    alike(again, first)
    assert first.attempts.tolist() == [1, 1, 1, 2, 2, 1, 1, 1, 0]
    (tmp_path / NAME).unlink()
    alike(survey(tmp_path, [""] * 9), first)


def test_of_a_growing_journal_only_the_rest_is_read(tmp_path, checksums):
    journal = filled(tmp_path, range(5))
    survey(tmp_path, [""] * 9)
    checksums.clear()
    journal.append(Result(7, Status.OK, "late"))
    checksums.clear()
    assert survey(tmp_path, [""] * 9).missing.tolist() == [5, 6, 8]
    assert len(checksums) == 1
    journal.close()


def test_a_record_that_is_being_written_is_read_when_it_is_whole(tmp_path):
    journal = filled(tmp_path, range(3))
    journal.close()
    content = journal.path.read_bytes()
    journal.path.write_bytes(content[:-9])
    assert survey(tmp_path, [""] * 3).missing.tolist() == [2]
    journal.path.write_bytes(content)
    assert len(survey(tmp_path, [""] * 3).missing) == 0


def test_what_is_written_while_a_journal_is_read_is_no_damage(tmp_path):
    journal = filled(tmp_path, range(4))
    journal.close()
    content = journal.path.read_bytes()
    journal.path.write_bytes(content[: len(content) * 5 // 8])  # within the third record
    found = read_journal(journal.path)
    assert next(found)[2].sample == 0
    journal.path.write_bytes(content)
    assert [result.sample for *_, result in found] == [1]


def test_what_is_remembered_does_not_depend_on_how_many_records_are_held(tmp_path, monkeypatch):
    filled(tmp_path, range(7)).close()
    expected = survey(tmp_path, [""] * 7)
    journal_file.forget(tmp_path)
    monkeypatch.setattr(journal_file, "_AT_ONCE", 3)
    alike(survey(tmp_path, [""] * 7), expected)


@pytest.mark.parametrize("how", ["cut", "no zip", "gone"])
def test_a_memory_that_is_wrong_costs_nothing_but_time(how, tmp_path):
    filled(tmp_path, range(5)).close()
    expected = survey(tmp_path, [""] * 5)
    memory = tmp_path / NAME
    if how == "cut":
        memory.write_bytes(memory.read_bytes()[:300])
    elif how == "no zip":
        memory.write_bytes(b"no zip")
    else:
        memory.unlink()
    alike(survey(tmp_path, [""] * 5), expected)


def test_damage_that_left_size_and_time_is_found_when_the_record_is_read(copied, whole):
    """The merging computes its checksum once more; the sample counts as not run then."""
    folder = open_folder(copied.folder / "out")
    assert len(folder.survey().missing) == 0
    (path,) = journals(copied)
    before, content = path.stat(), bytearray(path.read_bytes())
    content[len(content) // 2] ^= 64
    path.write_bytes(content)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    left, _, file = merge(folder, execution="", partly=True)
    assert left == 1
    assert file is not None
    copied.run(*START)
    assert_same(copied, whole)


def test_a_folder_that_is_read_only_is_looked_at_all_the_same(tmp_path, monkeypatch):
    filled(tmp_path, range(5)).close()

    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr("ringsim.files.os.replace", refuse)
    assert len(survey(tmp_path, [""] * 5).missing) == 0
    assert not (tmp_path / NAME).exists()


def test_merge_and_status_agree_while_a_campaign_runs(bench):
    """It cannot end, and merge by itself, between a command and the look at what that wrote."""
    gate = bench.folder / "gate"
    bench.extra |= {"TRACE": str(bench.folder / "trace"), "GATE": str(gate)}
    bench.write(12)
    running = bench.start("campaign", "small.toml", "--out", "out", solver="fake_solver:gated")
    while done(bench) < 3:
        assert running.poll() is None
        time.sleep(0.05)
    merged = bench.run("merge", "out")
    count = int((bench.result("out").status.values == 0).sum())
    assert count >= 3
    assert f"12 samples, {count} done, {12 - count} not run, 0 failed" in merged
    told = int(bench.run("status", "out").split(": ")[1].split()[0])
    assert count <= told < 12
    gate.touch()
    running.communicate(timeout=60)
    assert "12 samples, 12 done, 0 not run" in bench.run("merge", "out")


def done(bench):
    return len(finished(bench.folder / "out"))


def test_bodies_that_are_unpacked_together_are_those_unpacked_one_by_one():
    time = np.linspace(0.0, 1.0, 3)
    runs = [{"time": time, "asynchrony": time * k, "steps": np.array(k)} for k in (1, 1, 2)]
    bodies = [pack(run)[1] for run in runs]
    bodies.insert(1, b"")
    bodies.append(pack({"time": time})[1])
    places = []
    for own, arrays in stacked(bodies):
        places += own
        for row, place in enumerate(own):
            alone = Result(0, Status.OK, "", body=bodies[place]).arrays()
            assert alone.keys() == arrays.keys()
            for name, values in alone.items():
                np.testing.assert_array_equal(arrays[name][row], values)
                assert arrays[name].dtype == values.dtype
    assert sorted(places) == [0, 2, 3, 4]
    assert Result(0, Status.OK, "", body=bodies[3]).arrays()["steps"].shape == ()
