"""Signals, commands at the same time, strange folders: nothing is lost or mixed up."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from campaign_bench import START, Bench, assert_same, finished, journals, lose, opened, ranks_of
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import is_behind, merge
from ringsim.campaign.run import Choices, run_campaign
from ringsim.execution.slot import Serial
from ringsim.execution.work import Allowance
from ringsim.storage.netcdf import locked


def blocked(pid):
    """Whether a process waits for a lock."""
    lines = Path("/proc/locks").read_text().splitlines()
    return any("->" in line and str(pid) in line.split() for line in lines)


OTHERS = [pytest.param(each, marks=pytest.mark.slow) for each in (signal.SIGTERM, signal.SIGUSR1)]
"""One handler takes all of them; see test_campaign_safety.py for these."""


@pytest.mark.parametrize("number", [signal.SIGINT, *OTHERS])
def test_stop_signal_interrupts_a_merge_and_the_next_run_merges(number, copied, whole):
    out = copied.folder / "out"
    (out / "campaign.nc").unlink()
    (out / ".campaign.nc.0123.draft").write_text("left by a merge that was killed")
    with locked(out / "lock-merge", wait=True):
        process = copied.start(*START)
        end = time.monotonic() + 60.0
        while not blocked(process.pid):
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        printed, _ = process.communicate(timeout=60)
    assert process.returncode == 130, printed
    assert f"stopped by {number.name}; the results are not merged yet" in printed
    assert not (out / "campaign.nc").exists()
    copied.run(*START)
    assert_same(copied, whole)
    assert not list(out.glob(".*.draft"))


class SignalledAtTheEnd(Serial):
    """Hears of the end of its time just when everything is done."""

    def run(self, samples, work):
        super().run(samples, work)
        signal.raise_signal(signal.SIGTERM)
        return work.stop()


def test_signal_after_the_last_sample_is_no_failure(copied, whole):
    out = copied.folder / "out"
    lose(copied, range(4))
    assert run_campaign(out, Choices(SignalledAtTheEnd(), Allowance())) == 0
    assert_same(copied, whole)


def test_signal_to_one_rank_stops_all_of_them(bench, mpi):
    start = ("campaign", bench.write(30, shared='"rods.damping" = 0.1'), "--out", "out")
    process = bench.start(*start, ranks=2, solver="fake_solver:slow")
    out = bench.folder / "out"
    end = time.monotonic() + 60.0
    while not finished(out):
        assert time.monotonic() < end
        assert process.poll() is None
        time.sleep(0.1)
    (rank,) = ranks_of(bench, b"1")
    os.kill(rank, signal.SIGUSR1)
    printed, _ = process.communicate(timeout=60)
    assert process.returncode == 130, printed
    assert "stopped by SIGUSR1" in printed
    bench.run(*start, "--workers", 4, solver="fake_solver:slow")
    assert (bench.result("out").status == 0).all()


def test_two_commands_at_once_share_nothing_and_lose_nothing(bench, whole):
    """The same campaign twice, and another one, begin in one new folder at the same moment."""
    mine = bench.write()
    other = bench.write(name="other.toml")
    other.write_text(other.read_text().replace("seed = 7", "seed = 8"))
    processes = {
        bench.start("campaign", file, "--out", "out"): file for file in (mine, mine, other)
    }
    codes = {}
    for process, file in processes.items():
        printed, _ = process.communicate(timeout=60)
        codes.setdefault(file, []).append(process.returncode)
        assert process.returncode in (0, 2), printed
        assert process.returncode == 0 or "another" in printed
    winners = [file for file, found in codes.items() if 0 in found]
    assert len(winners) == 1
    bench.run("campaign", winners[0], "--out", "out")
    if winners == [mine]:
        assert_same(bench, whole)
    assert (bench.result("out").status == 0).all()


def test_growing_a_campaign_that_runs_is_refused(copied):
    with locked(copied.folder / "out" / "lock") as held:
        assert held
        printed = copied.run("campaign", copied.write(30), "--out", "out", code=2)
    assert "another process is running this campaign" in printed
    assert open_folder(copied.folder / "out").table.samples == 20


@pytest.fixture
def read_only(copied):
    """A finished campaign on a file system that nobody can write to."""
    out = copied.folder / "out"
    here = str(out)
    if (
        shutil.which("mount") is None
        or subprocess.run(["mount", "--bind", here, here], capture_output=True).returncode
    ):
        pytest.skip("a folder cannot be mounted here: needs the right to mount")
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", here], check=True)
        yield copied
    finally:
        subprocess.run(["umount", "-l", here], check=True)


def test_read_only_folder_can_be_looked_at_and_refuses_the_rest(read_only):
    told = read_only.run("status", "out")
    assert "20 of 20 samples done" in told
    assert "identical to the stored result" in read_only.run("replay", "out", 3)
    assert "nothing is left to run" in read_only.run(*START, "--dry-run")
    for verb in (START, ("merge", "out"), ("campaign", "small.toml", "--part", "1/2", *START[-2:])):
        printed = read_only.run(*verb, code=2)
        line = printed.splitlines()[-1]
        assert "cannot be written: Read-only file system" in line
        assert "Traceback" not in printed


def test_one_sample_is_a_campaign(bench):
    file = bench.write(1)
    bench.run("campaign", file, "--workers", 4, "--out", "out")
    result = bench.result("out")
    assert result.sizes["sample"] == 1
    assert result.status.values.tolist() == [0]
    assert "1 of 1 sample done, 0 left" in bench.run("status", "out")


@pytest.mark.parametrize(
    "name",
    [
        "a#mode=bytes", "-x\n'\"",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("ü-Ω 100%", "[x]*", "file:name")),
    ],
)  # fmt: skip
def test_folder_may_have_any_name(name, bench):
    out = bench.folder / name
    bench.run("campaign", bench.write(3), f"--out={name}", "--workers", 0)
    assert finished(out) == {0, 1, 2}
    left, failed, _ = merge(open_folder(out), execution="again", partly=False)
    assert (left, failed) == (0, 0)
    # Not every library that only reads takes every name.
    (out / "campaign.nc").rename(bench.folder / "found.nc")
    assert np.isfinite(opened(bench.folder / "found.nc").deployment_time.values).all()


def test_folder_whose_name_is_no_text_is_refused(bench):
    printed = bench.run("campaign", bench.write(1), "--out", os.fsdecode(b"a\xffb"), code=2)
    assert "its name is not UTF-8" in printed


def test_a_rank_that_does_not_see_the_folder_ends_the_job_with_a_word(tmp_path, mpi):
    """As on a machine where the folder is its own: the first rank waited for it for ever."""
    benches = [Bench(tmp_path / name) for name in ("one", "two")]
    words = []
    for bench in benches:
        bench.folder.mkdir()
        bench.write(2)
        command = bench.command(*START[:2], "--out", "out", ranks=1)
        words.append([*command[1:3], "-wdir", str(bench.folder), *command[3:]])
    call = [command[0], *words[0], ":", *words[1]]
    done = subprocess.run(
        call, env=benches[0].environment(), capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert "out" in done.stdout + done.stderr


def test_what_is_written_while_a_file_is_merged_is_no_part_of_it(copied):
    folder = copied.folder / "out"
    copied.run("merge", "out")
    newest = max(journals(copied), key=lambda path: path.stat().st_mtime)
    assert not is_behind(folder)
    assert (folder / "campaign.nc").stat().st_mtime <= newest.stat().st_mtime
    later = newest.stat().st_mtime + 0.01
    os.utime(newest, (later, later))
    assert is_behind(folder)
