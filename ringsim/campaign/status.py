"""What a campaign's folder says about its progress, also while it is being filled."""

from __future__ import annotations

import json
import time
from collections import Counter

from ringsim.campaign.folder import Folder
from ringsim.storage.locks import in_use
from ringsim.storage.netcdf import NOT_RUN
from ringsim.variables import Status

_TOLD = {"state", "host", "pid", "workers", "elapsed", "updated", "done", "done_before", "running"}
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
    """Where a campaign stands, from its results and its progress files, as text.

    Samples by the word of their status, a line for every process that runs or ran samples, the
    samples that run now with the seconds since they began, and the predicted time until all are
    done.
    """
    found, now = campaign.survey(), time.time()
    left = len(found.missing)
    counts = Counter(found.status.tolist())
    words = {int(status): status.word for status in Status} | {NOT_RUN: "not_run"}
    lines = [
        f"{campaign.attributes['campaign_name']}: {campaign.table.samples - left} of "
        f"{campaign.table.samples} samples done, {left} left",
        *(f"  {words[code]:<14} {counts[code]}" for code in words if counts[code]),
    ]
    running: dict[int, float] = {}
    rate = 0.0
    for path in sorted(campaign.path.glob("progress-*.json")):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        if not isinstance(told, dict) or not told.keys() >= _TOLD:  # of another version
            continue
        state, writer = told["state"], path.stem.removeprefix("progress-")
        if state == "running" and not in_use(campaign.path, writer):
            state = "killed"
        # Clocks jump, and differ between hosts: durations are the writer's own.
        since = max(0.0, now - told["updated"])
        if state == "running":
            running |= {int(sample): lasts + since for sample, lasts in told["running"].items()}
            rate += (told["done"] - told["done_before"]) / max(told["elapsed"] + since, 1e-9)
        lines.append(
            f"  {writer:<14} {state}, {told['workers']} workers, "
            f"process {told['pid']} on {told['host']}, {since:.0f} s ago"
        )
    running = {
        sample: lasts for sample, lasts in running.items() if found.status[sample] == NOT_RUN
    }
    if running:
        longest = sorted(running.items(), key=lambda item: -item[1])[:_MOST_SHOWN]
        listed = ", ".join(f"{sample} ({seconds:.0f} s)" for sample, seconds in longest)
        lines.append(f"  running        {len(running)}: {listed}")
    if rate > 0.0:
        lines.append(f"  rate           {rate:.3g} samples/s")
        lines.append(f"  time left      about {in_words(left / rate)}")
    return lines
