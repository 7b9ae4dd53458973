"""What a campaign is going to do, and how far it is, also while its folder is being filled."""

import contextlib
import json
import time
from collections import Counter
from pathlib import Path

import numpy as np

from ringsim.analysis.campaign_notes import ending_lines
from ringsim.campaign.folder import Folder, opened_as
from ringsim.campaign.run import Share
from ringsim.campaign.specification import Campaign
from ringsim.campaign.stopping import End, decided, looks_of
from ringsim.choice import kind_of
from ringsim.execution.local import Local
from ringsim.execution.work import Work, relative_cost
from ringsim.sampling.columns import Column
from ringsim.sampling.designs.grouped import Grouped
from ringsim.sampling.values import labels_of
from ringsim.storage.journal import survey
from ringsim.storage.locks import in_use
from ringsim.storage.netcdf import NOT_RUN
from ringsim.storage.result import Result, sample_of
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
    """Where a campaign stands, from its results and its progress files, as text."""
    planned, end = campaign.table.samples, decided(campaign)
    if end is not None:
        campaign = campaign.first(end.samples)
    found, now = campaign.survey(), time.time()
    left = len(found.missing)
    counts = Counter(found.status.tolist())
    words = {int(Status.OK): Status.OK.word, NOT_RUN: "not_run"}
    lines = [
        f"{campaign.attributes['campaign_name']}: {campaign.table.samples - left} of "
        f"{campaign.table.samples} samples done, {left} left",
        *_stopping(campaign, planned, end),
        *(f"  {words[code]:<14} {counts[code]}" for code in words if counts[code]),
    ]
    endings = ending_lines(found.fate, found.status, lambda k: next(found.results([k])).reason)
    lines += [f"  {line}" for line in endings]
    if every := len(campaign.checked):
        lines.append(f"  checked        {every - len(campaign.unchecked())} of {every}")
    running, rate = dict[int, float](), 0.0
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
            rate += (told["done"] - told["done_before"]) / max(told["elapsed"] + since, 1e-9)
        lines.append(
            f"  {writer:<14} {state}, {told['workers']} workers, "
            f"process {told['pid']} on {told['host']}, {since:.0f} s ago"
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
    if rate > 0.0:
        lines.append(f"  rate           {rate:.3g} samples/s")
        lines.append(f"  time left      about {in_words(left / rate)}")
    return lines


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


def plan(campaign: Campaign, folder: Path, *, workers: int, share: Share, solver: str) -> list[str]:
    """The plan as text; InputError if the folder, which need not exist, is another campaign's.

    The cost is predicted from samples that are done; if there are none, one sample of middling
    cost runs as a trial, and nothing of it is kept.
    """
    table = campaign.draw()
    old = opened_as(campaign, folder, table, solver)
    found = survey(folder, old.attributes["identity"] if old is not None else "", table.samples)
    todo = found.missing[share.holds(found.missing)]
    cost = relative_cost(table, campaign.scene)
    design = campaign.specification.design
    kind = kind_of(design)
    lines = [
        f"{campaign.specification.name}: {table.samples} samples "
        f"({kind} design), {len(todo)} to run here",
        *(
            [f"  runs           {design.runs_told(table.samples)}"]
            if isinstance(design, Grouped)
            else []
        ),
        f"  folder         {folder}",
        f"  workers        {workers}",
        *map(_extent, table.columns),
    ]
    if rule := campaign.specification.rule:
        numbers = rule.numbers(table.samples, campaign.specification.rule_replicates)
        told = ", ".join(map(str, numbers)) or "none before the last sample"
        lines.append(f"  looks          {told} (stop_when)")
    if every := campaign.specification.check_every:
        number = len(range(0, table.samples, every))
        lines.append(f"  checks         {number} samples with the full engine, too (not predicted)")
    if len(todo) == 0:
        return [*lines, "  nothing is left to run"]
    known = np.flatnonzero(np.isfinite(found.seconds))
    if len(known):
        per_cost = float(found.seconds[known].sum() / cost[known].sum())
        basis = f"from {len(known)} samples that are done"
    else:
        trial = int(todo[np.argsort(cost[todo])[len(todo) // 2]])
        kept: list[Result] = []
        work = Work(
            solver=solver, scene=campaign.scene.to_table(), values_of=table.values_of,
            allowance=campaign.specification.limits, keep=kept.append, stop=lambda: "",
        )  # fmt: skip
        Local(1).run([trial], work)
        (result,) = kept
        per_cost = result.seconds / cost[trial]
        basis = f"from a trial run of sample {trial}: {result.status.word}, {result.reason}"
    each = per_cost * cost[todo]
    whole = max(each.sum() / min(workers, len(todo)), each.max())
    return [
        *lines,
        f"  cost           {each.mean():.3g} s a sample ({each.min():.3g} to {each.max():.3g} s), "
        f"{basis}",
        f"  predicted      about {in_words(float(whole))}",
    ]


def _extent(column: Column) -> str:
    values = column.values
    if values.dtype.kind in "iuf":
        unit = "" if column.units == "1" else f" {column.units}"
        extent = f"{values.min():.6g} to {values.max():.6g}{unit}"
    else:
        words = sorted(set(labels_of(values).ravel().tolist()))
        more = [f"and {len(words) - _MOST_SHOWN} more"] if len(words) > _MOST_SHOWN else []
        extent = ", ".join(words[:_MOST_SHOWN] + more)
    each = f", for each {column.dim.partition('_')[0]}" if column.dim else ""
    return f"  {column.path or f'label {column.name}'}: {extent}{each}"
