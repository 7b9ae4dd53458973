"""Watching a campaign: whether its samples are enough, at the same sample whoever has run them; the
stop signals; the progress bar, and the progress file for others.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import platform
import signal
import sys
import threading
import time
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.analysis import derived
from ringsim.analysis.design import placement
from ringsim.analysis.requirements import OUTCOME, Rule, required_by, rule_of
from ringsim.analysis.verdicts import holds
from ringsim.campaign.folder import Folder
from ringsim.files import whole
from ringsim.refusal import InputError
from ringsim.storage.result import Result, sample_of
from ringsim.tables import counted

# When samples are enough.
#
# Samples end in any order, and beyond the last look some have run already.  The rule asks only the
# first samples of a look, all of them and no others, and only once they have all run: its answer is
# a function of the campaign alone.


_PAUSE = 2.0
"""Seconds between two looks for samples of others, at least."""


@dataclass(frozen=True)
class End:
    """Where a campaign ended before its last sample, and why."""

    samples: int
    told: str


def decided(campaign: Folder) -> End | None:
    """The first look whose samples have all run and are enough; None if there is none (yet)."""
    rule = rule_of(campaign.attributes)
    if rule is None:
        return None
    judged = _Judge(campaign, rule)
    for count in judged.numbers:
        told = judged.at(count)
        if told is None:
            return None
        if told:
            return End(count, told)
    return None


def looks_of(campaign: Folder) -> list[int]:
    """Samples at all looks of a campaign's rule; none without one."""
    rule = rule_of(campaign.attributes)
    return [] if rule is None else _Judge(campaign, rule).numbers


def as_decided(campaign: Folder) -> Folder:
    """A campaign up to where its rule has ended it, else as it is."""
    return campaign if (end := decided(campaign)) is None else campaign.first(end.samples)


class _Judge:
    """What becomes of a rule at each look; reads every result once."""

    def __init__(self, campaign: Folder, rule: Rule) -> None:
        self._campaign, self._rule = campaign, rule
        # Here: it takes half a second, and status looks at no rule.
        import xarray as xr

        self._empty = xr.Dataset(attrs=campaign.attributes)
        self._placed = placement(self._empty)
        self.numbers = rule.numbers(campaign.table.samples, self._placed.replicates)
        self._requirements = required_by(campaign.attributes)
        self._derived = derived.known_from(campaign.attributes)
        named = [each.requirement or each.of for each in rule.conditions]
        outputs = {str(name) for name in named} - {OUTCOME}
        self._names = sorted(outputs | {f"{name}_error" for name in outputs})
        self._known = {name: np.empty(0) for name in self._names}
        self._reasons = np.empty(0, dtype=object)
        self._present: set[str] = set()

    def at(self, count: int) -> str | None:
        """What shows that the samples of a look are enough, "" if they are not; None if some of
        them, or of their checks, have not run.
        """
        first = self._campaign.first(count)
        found = first.survey()
        if len(found.missing) or len(first.unchecked()):
            return None
        before = len(self._reasons)
        reasons = np.full(count - before, "", dtype=object)
        more = {name: np.full(count - before, np.nan) for name in self._names}
        for result in found.results(np.arange(before, count)):
            reasons[result.sample - before] = result.reason
            arrays = derived.of_run(self._derived, result.arrays())
            for name in self._names:
                if name in arrays:
                    more[name][result.sample - before] = arrays[name]
                    self._present.add(name)
        self._reasons = np.append(self._reasons, reasons)
        self._known = {n: np.append(self._known[n], more[n]) for n in self._names}
        columns: dict[str, Any] = {"status": found.status, OUTCOME: found.fate}
        columns["reason"] = self._reasons
        columns |= {name: self._known[name] for name in self._present}
        dataset = self._empty.assign({n: ("sample", v) for n, v in columns.items()})
        dataset = dataset.assign_coords(sample=np.arange(count))
        try:
            return holds(self._rule, dataset, self._requirements, self._placed)
        except InputError:  # a requirement that these samples do not tell of ends nothing
            return ""


class Watch:
    """Follows a running campaign from look to look."""

    def __init__(self, campaign: Folder, again: Iterable[int] = ()) -> None:
        """Watch a campaign of which the samples ``again`` run first, before any look."""
        rule = rule_of(campaign.attributes)
        self._judge = None if rule is None else _Judge(campaign, rule)
        self._numbers = self._judge.numbers if self._judge is not None else []
        self._most, self._again = campaign.table.samples, set(again)
        self._left = Counter[int]()
        self._next, self._asked, self._end = 0, -_PAUSE, ""

    def in_order(self, numbers: Sequence[int]) -> list[int]:
        """Samples and checks to be run, those first that the next look waits for."""
        self._left = Counter(map(self._look_of, numbers))
        return sorted(numbers, key=self._look_of)  # stable

    def _look_of(self, number: int) -> int:
        """The first look that waits for a sample, or for its check."""
        sample = sample_of(number)
        return 0 if sample in self._again else bisect_right(self._numbers, sample)

    def finished(self, number: int) -> None:
        """Note that a sample or check has run."""
        self._left[self._look_of(number)] -= 1

    def ended(self) -> str:
        """Why the samples are enough, or an empty string; asked often.  What asks for numbers that
        the samples do not tell is not enough.
        """
        while self._judge is not None and not self._end and self._next < len(self._numbers):
            waits = any(self._left[look] for look in range(self._next + 1))
            # Those of other parts of the campaign end when they end.
            if waits or time.monotonic() - self._asked < _PAUSE:
                break
            count = self._numbers[self._next]
            if (told := self._judge.at(count)) is None:
                self._asked = time.monotonic()
                break
            if told:
                self._end = f"{count} of at most {self._most} samples are enough: {told}"
            self._next += 1
        return self._end


# Signals and progress.


def named(number: int) -> str:
    """A sample, or a check of one, in words."""
    return f"sample {number}" if number >= 0 else f"check of {sample_of(number)}"


_STOPPERS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)
_PLAIN_SECONDS = 30.0
"""Between two lines where there is no bar; those without news come after twice the time each."""
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
        self._pause, self._drawn = _PLAIN_SECONDS, self._begin
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
        self._pause = _PLAIN_SECONDS
        if time.monotonic() - self._told > _PLAIN_SECONDS:
            self._tell_counts()

    def _tell_counts(self, more: str = "") -> None:
        self._told = time.monotonic()
        if self._bar.disable:
            checks = f", {self._checked} of {self.checks} checks" if self.checks else ""
            self._tell(f"{self.done} of {self.total} done, {self.failed} failed{checks}{more}")

    def refresh(self) -> None:
        """Tell what runs where nothing has ended for long, and write the progress file if there are
        news, not more often than each second.
        """
        now = time.monotonic()
        if self.running and now - self._told > self._pause:
            number, begin = min(self.running.items(), key=lambda item: item[1])
            self._pause *= 2.0
            self._tell_counts(f"; running: {named(number)}, for {now - begin:.0f} s")
        if not self._bar.disable and now - self._drawn >= _FILE_SECONDS:
            self._drawn = now
            self._bar.refresh()  # its clock
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
