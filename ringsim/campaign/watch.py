"""Watching a campaign: the progress bar, the progress file for others, the stop signals."""

import contextlib
import importlib.util
import json
import os
import platform
import signal
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ringsim.files import whole
from ringsim.storage.result import Result, sample_of
from ringsim.tables import counted

_STOPPERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)
_PLAIN_SECONDS = 30.0
_FILE_SECONDS = 1.0


@dataclass
class StopRequest:
    """Whether the campaign is to stop, and why; falsy text means go on."""

    reason: str = ""
    signalled: bool = False
    """Whether a signal asked for it."""
    enough: bool = False
    """Whether the samples are enough, by the campaign's rule."""
    at_once: bool = False
    """Whether a signal interrupts what is being done, instead of waiting to be asked for."""

    def note(self, reason: str, *, signalled: bool) -> None:
        """Ask for a stop; the first reason counts."""
        if not self.reason:
            self.reason, self.signalled = reason, signalled


@contextlib.contextmanager
def stopping_on_signals() -> Iterator[StopRequest]:
    """Turn the first stop signal into a request; a second one ends the process as usual.

    Only a main thread can: in another one, signals do what they always do.
    """
    stop = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def note(number: int, _frame: Any) -> None:
        stop.note(f"stopped by {signal.Signals(number).name}", signalled=True)
        for each, handler in before.items():
            signal.signal(each, handler)
        if stop.at_once:
            raise KeyboardInterrupt

    # nohup has a campaign go on when its terminal is closed.
    kept = [signal.SIGHUP] if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN else []
    before = {each: signal.signal(each, note) for each in _STOPPERS if each not in kept}
    try:
        yield stop
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@dataclass
class Progress:
    """Counts samples, and tells the terminal and the progress file."""

    path: Path
    name: str
    total: int
    done: int
    failed: int
    """Samples of this process's share: all, finished, failed among the finished."""
    workers: int
    checks: int = 0
    """Repetitions of samples by the full engine that are to run; they do not count as samples."""
    running: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._before, self._news, self._written = self.done, False, -_FILE_SECONDS
        self._checked = 0
        self._spent, self._ended = [0.0, 0.0], [0, 0]
        self._begin = self._told = time.monotonic()
        notebook = "ipykernel" in sys.modules
        # Without its widgets tqdm warns, and shows less than its bar of letters does.
        if notebook and importlib.util.find_spec("ipywidgets"):
            from tqdm.notebook import tqdm
        else:
            from tqdm import tqdm
        self._bar = tqdm(
            total=self.total, initial=self.done, desc=self.name, unit="sample", smoothing=0.1,
            postfix=self._counts(), disable=not (notebook or sys.stderr.isatty()),
        )  # fmt: skip
        if self._bar.disable:
            checks = f", {counted(self.checks, 'check')} to run" if self.checks else ""
            workers = counted(self.workers, "worker")
            self._tell(f"{self.done} of {self.total} samples done, {workers}{checks}")

    def _counts(self) -> dict[str, Any]:
        checks = {"checks": f"{self._checked}/{self.checks}"} if self.checks else {}
        return {"failed": self.failed} | checks

    def _tell(self, text: str) -> None:
        print(f"{self.name}: {text}", file=sys.stderr, flush=True)

    def started(self, sample: int) -> None:
        """Note that a sample, or one's check, runs."""
        self.running[sample], self._news = time.monotonic(), True
        self.refresh()

    def finished(self, result: Result) -> None:
        """Note that it has ended."""
        now = time.monotonic()
        is_check = sample_of(result.sample) != result.sample
        self._spent[is_check] += now - self.running.pop(result.sample, now)
        self._ended[is_check] += 1
        self._news = True
        if is_check:
            self._checked += 1
            self._bar.set_postfix(self._counts())
        else:
            self.done += 1
            self.failed += result.status.failed
            self._bar.set_postfix(self._counts(), refresh=False)
            self._bar.update()
        if self._bar.disable and time.monotonic() - self._told > _PLAIN_SECONDS:
            self._told = time.monotonic()
            checks = f", {self._checked} of {self.checks} checks" if self.checks else ""
            self._tell(f"{self.done} of {self.total} done, {self.failed} failed{checks}")

    def refresh(self) -> None:
        """Write the progress file if there are news, not more often than each second."""
        if self._news and time.monotonic() - self._written >= _FILE_SECONDS:
            self._save("running")

    def close(self, state: str) -> None:
        """Say how it ended."""
        self._bar.close()
        self.running.clear()
        self._save(state)

    def _save(self, state: str) -> None:
        """Write the progress file; never fail because of it."""
        now = self._written = time.monotonic()
        self._news = False
        content = {
            "state": state, "host": platform.node(), "pid": os.getpid(), "workers": self.workers,
            "elapsed": now - self._begin, "updated": time.time(), "total": self.total,
            "done": self.done, "done_before": self._before, "failed": self.failed,
            # Seconds of workers that samples and checks took, and how many of either have ended.
            "spent": self._spent, "ended": self._ended,
            "running": {sample: now - begin for sample, begin in self.running.items()},
        }  # fmt: skip
        with contextlib.suppress(OSError), whole(self.path, lasting=False) as draft:
            draft.write_text(json.dumps(content), encoding="utf-8")
