"""How far a campaign is, also while its folder is being filled."""

import contextlib
import json
import time
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.campaign_notes import ending_lines
from ringsim.campaign.folder import Folder
from ringsim.campaign.run import growth_told
from ringsim.campaign.stopping import End, decided, looks_of
from ringsim.storage.netcdf import NOT_RUN, in_use
from ringsim.storage.result import sample_of
from ringsim.tables import counted
from ringsim.variables import Status

_TOLD = {"state", "host", "pid", "workers", "updated", "running", "spent", "ended"}
_MOST_SHOWN = 10


def in_words(seconds: float) -> str:
    """A duration with a fitting unit.

    >>> in_words(90.0), in_words(150.0), in_words(8000.0)
    ('90 s', '2.5 min', '2.2 h')
    """
    for size, word in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {word}"
    return f"{seconds:.0f} s"


def status_lines(campaign: Folder) -> list[str]:
    """Where a campaign stands, from its results and its progress files, as text."""
    planned, end = campaign.table.samples, decided(campaign)
    if end is not None:
        campaign = campaign.first(end.samples)
    found, now, growth = campaign.survey(), time.time(), growth_told(campaign)
    left = len(found.missing)
    counts = Counter(found.status.tolist())
    words = {int(Status.OK): Status.OK.word, NOT_RUN: "not_run"}
    lines = [
        f"{campaign.attributes['campaign_name']}: {campaign.table.samples - left} of "
        f"{campaign.table.samples} samples done, {left} left",
        *_stopping(campaign, planned, end),
        *([f"  runs           {growth}"] if growth else []),
        *(f"  {words[code]:<14} {counts[code]}" for code in words if counts[code]),
    ]
    endings = ending_lines(found.fate, found.status, lambda k: next(found.results([k])).reason)
    lines += [f"  {line}" for line in endings]
    if every := len(campaign.checked):
        lines.append(f"  checked        {every - len(campaign.unchecked())} of {every}")
    running, workers = dict[int, float](), 0
    spent, ended = np.zeros(2), np.zeros(2)
    for path in sorted(campaign.path.glob("progress-*.json")):
        told = None
        with contextlib.suppress(OSError, ValueError):
            told = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(told, dict) or not told.keys() >= _TOLD:  # of another version
            continue
        state, writer = told["state"], path.stem.removeprefix("progress-")
        if state == "running" and not in_use(campaign.path, writer):
            state = "killed"
        # Clocks jump, and differ between hosts: durations are the writer's own.
        since = max(0.0, now - told["updated"])
        if state == "running":
            running |= {int(number): lasts + since for number, lasts in told["running"].items()}
            workers += told["workers"]
            spent, ended = spent + told["spent"], ended + told["ended"]
        called = "workers" if writer == "all" else writer
        lines.append(
            f"  {called:<14} {state}, {counted(told['workers'], 'worker')}, "
            f"process {told['pid']} on {told['host']}, heard of {since:.0f} s ago"
        )
    checks = campaign.survey(checks=True)
    unfinished = [
        item for item in running.items()
        if (found if item[0] >= 0 else checks).status[sample_of(item[0])] == NOT_RUN
    ]  # fmt: skip
    if unfinished:
        longest = sorted(unfinished, key=lambda item: -item[1])[:_MOST_SHOWN]
        listed = ", ".join(f"{_named(number)} ({seconds:.0f} s)" for number, seconds in longest)
        lines.append(f"  running        {len(unfinished)}: {listed}")
    if workers and ended.any():
        if ended[0]:
            rate = workers * ended[0] / max(spent[0], 1e-9)
            beside = ", while no check runs" * bool(ended[1])
            lines.append(f"  rate           {rate:.3g} samples/s{beside}")
        about = _left(campaign, left, spent / np.maximum(ended, 1), workers)
        lines.append(f"  time left      {about}{' for these' * bool(growth)}")
    return lines


def _left(campaign: Folder, samples: int, each: NDArray[np.float64], workers: int) -> str:
    """About how long samples, and checks by the other engine, take that are left; ``each`` are the
    seconds of one of either, 0 where none has ended.
    """
    checks = len(campaign.unchecked())
    rest = [(n, seconds) for n, seconds in ((samples, each[0]), (checks, each[1])) if n]
    known = [(n, seconds) for n, seconds in rest if seconds]
    if not known:
        return "not known yet" if rest else "none"
    # No less than one of the longest: the last ones leave workers idle.
    shared = sum(n * seconds for n, seconds in known) / workers
    told = f"about {in_words(max(shared, *(seconds for _, seconds in known)))}"
    if len(known) < len(rest):
        rest_of = counted(samples, "sample") if each[1] else counted(checks, "check")
        told += f", and {rest_of}, of which none has ended yet"
    return told


def _stopping(campaign: Folder, planned: int, end: End | None) -> list[str]:
    """Whether the campaign's rule has ended it, or when it looks again; nothing without a rule."""
    if end is not None:
        return [f"  ended          {end.samples} of at most {planned} samples: {end.told}"]
    missing = campaign.survey().missing
    first = int(missing[0]) if len(missing) else planned
    coming = [count for count in looks_of(campaign) if count > first]
    return [f"  next look      after {coming[0]} samples (stop_when)"] if coming else []


def _named(number: int) -> str:
    return str(number) if number >= 0 else f"check of {sample_of(number)}"
