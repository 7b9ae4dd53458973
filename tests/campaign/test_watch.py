"""Signals and locks of a campaign."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest

from ringsim.campaign import watch
from ringsim.campaign.watch import Progress, stopping_on_signals
from ringsim.refusal import InputError
from ringsim.storage.netcdf import locked
from ringsim.storage.result import check_of
from ringsim.variables import Status

pytestmark = pytest.mark.quick


@pytest.fixture
def hang_up():
    """The signal of a terminal that is closed, handled as before at the end."""
    before = signal.getsignal(signal.SIGHUP)
    yield signal.SIGHUP
    signal.signal(signal.SIGHUP, before)


def test_a_terminal_that_closes_stops_a_campaign_as_other_signals_do(hang_up) -> None:
    signal.signal(hang_up, signal.SIG_DFL)
    with stopping_on_signals() as stop:
        signal.raise_signal(hang_up)
        assert stop.reason == "stopped by SIGHUP"
        assert signal.getsignal(hang_up) == signal.SIG_DFL
    assert stop.signalled


def test_under_nohup_it_goes_on(hang_up) -> None:
    signal.signal(hang_up, signal.SIG_IGN)
    with stopping_on_signals() as stop:
        signal.raise_signal(hang_up)
        assert not stop.reason
    assert signal.getsignal(hang_up) == signal.SIG_IGN


def test_a_lock_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="lock: is a link"), locked(tmp_path / "lock"):
        pass
    assert not (tmp_path / "elsewhere").exists()
    (tmp_path / "elsewhere").touch()
    with pytest.raises(InputError, match="lock: is a link"), locked(tmp_path / "lock"):
        pass


def test_a_lock_is_a_file(tmp_path: Path) -> None:
    """Whoever opens a pipe would wait for its other end."""
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name, what in ("folder", "a folder"), ("pipe", "no file"):
        with pytest.raises(InputError, match=f"{name}: is {what}"), locked(tmp_path / name):
            pass


def test_progress_tells_what_samples_and_checks_took(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(watch.time, "monotonic", lambda: 0.0)
        progress = Progress(tmp_path / "progress.json", "x", 3, 0, 0, 1, checks=1)
        for number, begin, end in ((0, 10.0, 14.0), (check_of(0), 14.0, 44.0), (1, 44.0, 50.0)):
            patched.setattr(watch.time, "monotonic", lambda begin=begin: begin)
            progress.started(number)
            patched.setattr(watch.time, "monotonic", lambda end=end: end)
            progress.finished(SimpleNamespace(sample=number, status=Status.OK))
        progress.close("done")
    told = json.loads((tmp_path / "progress.json").read_text())
    assert told["spent"] == [10.0, 30.0]
    assert told["ended"] == [2, 1]
    assert told["done"] == 2


def test_what_runs_is_told_where_nothing_ends_for_long(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Lines come after 30 s, then after twice that each, and again soon after something ended."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(watch.time, "monotonic", lambda: 0.0)
        progress = Progress(tmp_path / "progress.json", "x", 2, 1, 0, 1, checks=1)
        progress.started(check_of(4))
        for now in range(1, 200):
            patched.setattr(watch.time, "monotonic", lambda now=now: float(now))
            progress.refresh()
        progress.finished(SimpleNamespace(sample=check_of(4), status=Status.OK))
        # Also where it ended soon after a line, and said nothing itself.
        for number, begin in ((0, 200), (1, 240)):
            patched.setattr(watch.time, "monotonic", lambda begin=begin: float(begin))
            progress.started(number)
            for now in range(begin, begin + 35):
                patched.setattr(watch.time, "monotonic", lambda now=now: float(now))
                progress.refresh()
            progress.finished(SimpleNamespace(sample=number, status=Status.OK))
        progress.close("done")
    assert capsys.readouterr().err.splitlines() == [
        "x: 1 of 2 samples done, 1 worker, 1 check to run",
        "x: 1 of 2 done, 0 failed, 0 of 1 checks; running: check of 4, for 31 s",
        "x: 1 of 2 done, 0 failed, 0 of 1 checks; running: check of 4, for 92 s",
        "x: 1 of 2 done, 0 failed, 1 of 1 checks",
        "x: 1 of 2 done, 0 failed, 1 of 1 checks; running: sample 0, for 30 s",
        "x: 2 of 2 done, 0 failed, 1 of 1 checks; running: sample 1, for 21 s",
    ]
