"""Scratch folders of killed processes are removed by the next one, those of living ones never."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ringsim.execution import child
from ringsim.execution.child import scratch_folder

OWNER = """
import sys
from ringsim.execution.child import scratch_folder
print(scratch_folder(), flush=True)
sys.stdin.read()
"""


@pytest.fixture
def owners(tmp_path):
    """Starts processes that own a scratch folder, and tells which."""
    made = []

    def make() -> tuple[subprocess.Popen[str], Path]:
        made.append(
            subprocess.Popen(
                [sys.executable, "-c", OWNER], text=True, stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, env=os.environ | {"TMPDIR": str(tmp_path)},
            )
        )  # fmt: skip
        return made[-1], Path(made[-1].stdout.readline().strip())

    yield make
    for process in made:
        process.kill()
        process.communicate()


def test_folders_of_killed_owners_go_and_all_others_stay(owners, tmp_path):
    living, kept = owners()
    dead, lost = owners()
    (lost / "log").write_text("the end")
    assert kept.parent == lost.parent == tmp_path
    dead.send_signal(signal.SIGKILL)
    dead.wait()
    # Strangers' names, an older version's, another machine's, a number that is used again.
    _, world, number, start, _ = kept.name.split("-")
    others = [
        tmp_path / name
        for name in ("ringsim-abcdefgh", "ringsim", f"ringsim-0123456789ab-{number}-{start}-x")
    ]
    reused = tmp_path / f"ringsim-{world}-{number}-{int(start) + 1}-x"
    for folder in (*others, reused):
        folder.mkdir()
    _, own = owners()
    assert kept.exists()
    assert own.exists()
    assert all(folder.exists() for folder in others)
    assert not lost.exists()
    assert not reused.exists()
    assert living.poll() is None


def test_a_zombie_owns_nothing(owners):
    dead, lost = owners()
    os.kill(dead.pid, signal.SIGKILL)
    os.waitid(os.P_PID, dead.pid, os.WEXITED | os.WNOWAIT)  # it stays a zombie
    assert Path(f"/proc/{dead.pid}").exists()
    owners()
    assert not lost.exists()


def test_nothing_is_removed_where_processes_cannot_be_looked_at(owners, tmp_path, monkeypatch):
    dead, lost = owners()
    dead.kill()
    dead.wait()
    monkeypatch.setattr(child, "_world", lambda: "")
    monkeypatch.setattr(child.tempfile, "tempdir", str(tmp_path))
    shutil.rmtree(scratch_folder())
    assert lost.exists()
