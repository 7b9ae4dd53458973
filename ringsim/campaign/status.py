"""What a campaign's folder says about its progress, also while it is being filled."""

from __future__ import annotations

import json
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.campaign.folder import Folder
from ringsim.storage.layout import NOT_RUN
from ringsim.storage.locks import in_use
from ringsim.storage.store import Survey, survey
from ringsim.variables import Status

_TOLD = {"state", "host", "pid", "workers", "elapsed", "updated", "done", "done_before", "running"}


@dataclass(frozen=True)
class Standing:
    """Where a campaign stands.

    Attributes
    ----------
    name
        Of the campaign.
    total
        Samples in the design.
    by_status
        Samples by the word of their status.
    running
        Samples that run now, with the seconds since they began.
    rate
        Samples per second of the processes that run now; 0 if none does.
    seconds_left
        Predicted time until all are done; NaN if nothing runs or nothing is known.
    processes
        One line for every process that runs or ran samples.
    """

    name: str
    total: int
    by_status: dict[str, int]
    running: dict[int, float]
    rate: float
    seconds_left: float
    processes: list[str]

    @property
    def left(self) -> int:
        """Samples without a result."""
        return self.by_status.get("not_run", 0)

    def lines(self) -> list[str]:
        """The standing as text."""
        done = self.total - self.left
        found = [f"{self.name}: {done} of {self.total} samples done, {self.left} left"]
        found += [f"  {word:<14} {count}" for word, count in self.by_status.items()]
        found += [f"  {line}" for line in self.processes]
        if self.running:
            shown = sorted(self.running.items(), key=lambda item: -item[1])[:10]
            listed = ", ".join(f"{sample} ({seconds:.0f} s)" for sample, seconds in shown)
            found.append(f"  running        {len(self.running)}: {listed}")
        if self.rate > 0.0:
            found.append(f"  rate           {self.rate:.3g} samples/s")
        if np.isfinite(self.seconds_left):
            found.append(f"  time left      about {in_words(self.seconds_left)}")
        return found


def in_words(seconds: float) -> str:
    """A duration with a fitting unit."""
    for size, word in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {word}"
    return f"{seconds:.0f} s"


def standing(campaign: Folder) -> Standing:
    """Look at the results and the progress files of a campaign."""
    found = survey(campaign.path, campaign.identity, campaign.table.samples, set_aside=False)
    now = time.time()
    running: dict[int, float] = {}
    processes, rate = [], 0.0
    for path in sorted(campaign.path.glob("progress-*.json")):
        told = _read(path)
        if told is None:
            continue
        state = told["state"]
        writer = path.stem.removeprefix("progress-")
        if state == "running" and not in_use(campaign.path, writer):
            state = "killed"
        # Clocks jump, and differ between hosts: durations are the writer's own.
        since = max(0.0, now - told["updated"])
        if state == "running":
            running |= {int(sample): lasts + since for sample, lasts in told["running"].items()}
            rate += (told["done"] - told["done_before"]) / max(told["elapsed"] + since, 1e-9)
        processes.append(
            f"{writer:<14} {state}, {told['workers']} workers, "
            f"process {told['pid']} on {told['host']}, {since:.0f} s ago"
        )
    left = len(found.missing)
    return Standing(
        name=campaign.attributes["campaign_name"],
        total=campaign.table.samples,
        by_status=_counted(found),
        running={k: v for k, v in running.items() if found.status[k] == NOT_RUN},
        rate=rate,
        seconds_left=left / rate if rate > 0.0 else float("nan"),
        processes=processes,
    )


def _counted(found: Survey) -> dict[str, int]:
    counts = Counter(found.status.tolist())
    words = {NOT_RUN: "not_run"} | {int(status): status.word for status in Status}
    return {words[code]: counts[code] for code in sorted(counts, key=lambda c: (c < 0, c))}


def _read(path: Path) -> Any:
    """Content of a progress file; None if it cannot be read or is of another version."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return told if isinstance(told, dict) and told.keys() >= _TOLD else None
