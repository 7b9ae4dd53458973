"""What a campaign is going to do and what that will cost, and how far it is, also while its folder
is being filled.
"""

import contextlib
import json
import shlex
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis import derived
from ringsim.analysis.campaign_notes import ending_lines
from ringsim.analysis.design import placement_of
from ringsim.analysis.intervals import quantities, samples_needed
from ringsim.analysis.requirements import Requirement, doubt_of
from ringsim.campaign.folder import FAILED, Folder, digests, open_folder, opened_as, other_build
from ringsim.campaign.merging import is_behind
from ringsim.campaign.run import Order, grown, growth_told
from ringsim.campaign.watch import End, decided, looks_of, named
from ringsim.choice import kind_of
from ringsim.execution.slot import Local
from ringsim.execution.work import FULL, Array, Work, relative_cost
from ringsim.files import DESIGN, MERGED
from ringsim.refusal import show
from ringsim.sampling.columns import Column, Table
from ringsim.sampling.designs.blocks import Grouped
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.sampling.distributions import labels_of
from ringsim.storage.journal import Survey, survey
from ringsim.storage.netcdf import in_use, runs_in
from ringsim.storage.result import Result, check_of, sample_of
from ringsim.tables import counted, number_text, size_text, with_unit
from ringsim.variables import NO_CODE, Status

Samples = NDArray[np.int64]
_MOST_SHOWN = 10
_SHORT = 20.0
"""A trial run that takes longer hardly consists of loading code, s."""
_UNUSUAL = 5.0
"""Time of a sample that runs over that of others from which on both are told."""
_BARS = "solver.error_bars"
_STRONG = 0.5
"""Rank correlation of two inputs that is told before anything runs."""


def plan(order: Order, workers: int, say: Callable[[str], None] = lambda line: None) -> list[str]:
    """The plan as text; InputError if the folder, which need not exist, is another campaign's.

    The cost is predicted from samples that are done; if there are none, one sample of middling
    cost runs as a trial, and nothing of it is kept.  So is that of checks by the judging engine,
    but from the samples' own cost where a trial would take long.  ``say`` is told before a trial
    begins, which may take minutes.
    """
    order.check()
    campaign, share = grown(order.campaign, order.folder), order.share
    if order.again and (order.folder / DESIGN).exists():
        order.prepare()  # which only reads what has begun
        old: Folder | None = open_folder(order.folder)
        table = open_folder(order.folder).table
    else:
        table = campaign.draw()
        old = opened_as(campaign, order.folder, table, order.solving)
    run_with = [""] * table.samples if old is None else digests(table, old.attributes)
    found = survey(order.folder, run_with)
    codes = [*(FAILED if order.again else ()), *([] if order.overrides else [NO_CODE])]
    todo = np.flatnonzero(np.isin(found.status, codes))
    todo = todo[share.holds(todo)]
    design = campaign.specification.design
    lines = [
        f"{campaign.specification.name}: {counted(table.samples, 'sample')} ({kind_of(design)} "
        f"design), {len(todo)} to run",
        *(
            [f"  runs           {design.runs_told(table.samples)}"]
            if isinstance(design, Grouped | SubsetSimulation)
            else []
        ),
        f"  folder         {order.folder}",
        f"  workers        {workers}",
        *map(extent_told, table.columns),
    ]
    if recorded := derived.of_records(campaign.specification.outputs):
        lines.append(
            f"  outputs        read from records every {campaign.scene.record.interval:g} s: "
            f"{', '.join(recorded)}; peaks between two records are missed, a smaller "
            "record.interval shows them"
        )
    placed = placement_of(design)
    if placed.population and not placed.has_intervals:
        lines.append(f"  statistics     {placed.told}")
    if placed.population and not campaign.specification.correlations:
        lines += _confounded(table, design.independent)
    lines += _required(campaign.specification.requirements)
    if placed.population:
        lines += _out_of_reach(campaign.specification.requirements, table.samples)
    if rule := campaign.specification.rule:
        numbers = rule.numbers(table.samples, campaign.specification.rule_replicates)
        looks = ", ".join(map(str, numbers)) or "none before the last sample"
        lines.append(f"  early stop     checked after {looks} samples (stop_when)")
    judged = survey(order.folder, run_with, checks=True)
    runs = sum(int(np.isfinite(each.seconds).sum()) for each in (found, judged))
    each, told, size = _predicted(order, table, found, todo, lambda sample: sample, runs, say)
    lines += [f"  cost           {words}" for words in told]
    if len(each):
        every = campaign.specification.check_every
        every_run = table.samples + (-(-table.samples // every) if every else 0)
        whole = f"{size_text(size * every_run)} for all"
        lines.append(
            f"  disk           {size_text(size)} a run, {whole}, and once or twice that for "
            f"{MERGED}"
        )
    most = 0.0
    if isinstance(design, SubsetSimulation) and not design.ended:
        done = table.samples - len(found.missing)
        one = each.mean() if len(each) else np.nanmean(found.seconds)
        most = float(one) * (design.most_runs - done) / workers
    if every := campaign.specification.check_every:
        checked = np.arange(0, table.samples, every)
        open_ = np.intersect1d(checked, judged.missing)
        open_ = open_[share.holds(open_)]
        lines.append(
            f"  checks         {counted(len(checked), 'sample')} with the full engine, too, "
            f"{len(open_)} to run"
        )
        cost, over = relative_cost(table, campaign.scene), np.isfinite(found.seconds)
        known, these = (each, todo) if len(each) else (found.seconds[over], np.flatnonzero(over))
        like = float(known.sum() / cost[these].sum()) if len(known) else 0.0
        own, told, _ = _predicted(order, table, judged, open_, check_of, runs, say, like)
        lines += [f"  cost of checks {words}" for words in told]
        each = np.concatenate([each, own])
    if not len(each):
        return [*lines, "  nothing is left to run"]
    whole = max(each.sum() / min(workers, len(each)), each.max())
    checks = ", without checks" if getattr(design, "check", 0) else ""
    rest = f" for these, up to {in_words(most)} for all levels{checks}" if most else ""
    return [*lines, f"  predicted      about {in_words(float(whole))}{rest}"]


def plan_of_course(
    order: Order, runs: int, checks: int, told_runs: str, workers: int, say: Callable[[str], None]
) -> list[str]:  # fmt: skip
    """What campaigns one after the other cost that are like an order, with no runs yet: so many
    runs, which are ``told_runs``, and checks by the judging engine; lines as of ``plan``.
    """
    table = order.campaign.draw()
    todo = np.arange(table.samples)
    with tempfile.TemporaryDirectory(prefix="ringsim-plan-") as empty:
        none = survey(Path(empty), [""] * table.samples)
    each, (told,), size = _predicted(order, table, none, todo, lambda sample: sample, 0, say)
    seconds = float(each.mean()) * runs
    lines = [*map(extent_told, table.columns), f"  workers        {workers}"]
    lines += [f"  cost           about {counted(runs, 'run')} ({told_runs}), {told}"]
    if checks:
        own, (told,), _ = _predicted(order, table, none, todo, check_of, 0, say, float(each.mean()))
        lines += [f"  checks         {checks} with the full engine, {told}"]
        seconds += float(own.mean()) * checks
    return [
        *lines,
        f"  disk           {size_text(size)} a run, {size_text(size * (runs + checks))} for all",
        f"  predicted      about {in_words(seconds / workers)}, if nothing has run yet",
    ]


def _predicted(
    order: Order,
    table: Table,
    found: Survey,
    todo: Samples,
    number: Callable[[int], int],
    runs: int,
    say: Callable[[str], None],
    like: float = 0.0,
) -> tuple[Array, list[str], float]:
    """Time of each run (s), that in words, and bytes that a run takes in the journals; ``number``
    is that of a sample's run, ``runs`` are those that the journals hold.  Of checks ``like`` is the
    time of a sample of middling cost (s).
    """
    if not len(todo):
        return np.empty(0), [], 0.0
    campaign, cost = order.campaign, relative_cost(table, order.campaign.scene)
    known = np.flatnonzero(np.isfinite(found.seconds))
    if len(known):
        per_cost = float(found.seconds[known].sum() / cost[known].sum())
        basis = f"from {counted(len(known), 'completed sample')}"
        written = (file.stat().st_size for file in (order.folder / "journals").iterdir())
        size = sum(written) / runs
    elif like * FULL > _SHORT:
        per_cost, size = like * FULL, 0.0
        basis = f"estimated as {FULL:g} times a sample's: a trial would take as long"
    else:
        trial = int(todo[np.argsort(cost[todo])[len(todo) // 2]])
        kept: list[Result] = []
        work = Work(
            solver=order.solving, scene=campaign.scene.to_table(),
            values_of=lambda sample: table.values_of(sample_of(sample)),
            allowance=campaign.specification.limits, keep=kept.append, judge=order.judge,
            stop=lambda: "long enough" if kept and kept[0].seconds > _SHORT else "",
        )  # fmt: skip
        check = "" if number(trial) == trial else "the check of "
        say(f"trial run of {check}sample {trial} to predict the cost ...")
        # A process's first run loads code: a short one is repeated.
        Local(1).run([number(trial)] * 2, work)
        result = kept[-1]
        per_cost = result.seconds / cost[trial]
        size = float(len(result.body) + len(result.header()))
        basis = f"from a trial run of sample {trial}: {result.status.word}, {result.reason}"
        basis += _has_of(result, campaign.specification.requirements)
        if result.status != Status.OK:
            basis += "; runs that end well may take far longer than this one"
    each, barred = per_cost * cost[todo], np.zeros(len(todo), dtype=bool)
    for column in table.columns:
        if column.path == _BARS and column.values.dtype.kind == "b":
            barred = column.values[todo]
            for has in (False, True):  # what error bars cost is known once some have run
                own = known[column.values[known] == has]
                if len(own):
                    time_of = float(found.seconds[own].sum() / cost[own].sum())
                    each[barred == has] = time_of * cost[todo[barred == has]]
    ends = _span(each[~barred] if not barred.all() else each)
    basis = "with error bars, " * bool(barred.all()) + basis
    if barred.any() and not barred.all():
        ends += f"; with error bars {_span(each[barred])}"
    spread = f" ({ends})" if each.min() < each.max() else ""
    return each, [f"{each.mean():.3g} s each{spread}, {basis}"], size


def _has_of(result: Result, requirements: Mapping[str, Requirement]) -> str:
    """What a run has of the outputs that are required, beside which a limit in another unit shows;
    nothing of those that it does not compute itself.
    """
    values = result.arrays() if result.status == Status.OK else {}
    known = [name for name in requirements if name in values and name in quantities()]
    told = [
        f"{name} {with_unit(number_text(float(values[name])), quantities()[name].units)}"
        for name in known
    ]
    return f"; it has {', '.join(told)}" * bool(told)


def _span(seconds: Array) -> str:
    ends = dict.fromkeys((f"{seconds.min():.3g}", f"{seconds.max():.3g}"))
    return f"{' to '.join(ends)} s"


def _required(requirements: Mapping[str, Requirement]) -> list[str]:
    """A line a requirement; a bound on the side on which nothing is wrong is pointed out."""
    return [
        f"  requirement    {wanted.told(name)} with probability {wanted.probability:g}, confidence "
        f"{wanted.confidence:g}" + f" ({doubt})" * bool(doubt)
        for name, wanted in requirements.items()
        for doubt in [doubt_of(name, [key for key, _ in wanted.limits])]
    ]


def _out_of_reach(requirements: Mapping[str, Requirement], samples: int) -> list[str]:
    """Lines on requirements that so many samples cannot show, however well all of them do."""
    lines = []
    for name, wanted in requirements.items():
        needed = samples_needed(0, wanted.probability, wanted.confidence)
        if needed > samples:
            lines.append(
                f"  requirement    {name}: {counted(samples, 'sample')} cannot prove a "
                f"probability of {wanted.probability:g} with a confidence of "
                f"{wanted.confidence:g}; at least {needed} are needed, all without a violation"
            )
    return lines


def _confounded(table: Table, independent: bool) -> list[str]:
    """A line if inputs go together, as points of a design do that are few for its dimensions."""
    found: dict[bytes, tuple[str, Array]] = {}
    for column in table.columns:
        follows = '"kind":"function"' in column.origin  # as its leader does: no input of its own
        if (column.path or column.input) and not follows and column.values.dtype.kind in "iuf":
            values = column.values.reshape(table.samples, -1).astype(float)
            for k, each in enumerate(values.T):
                place = show(column.places[k]) if column.places else k + 1
                called = column.path or column.input
                name = f"{called}[{place}]" if column.dim else called
                found.setdefault(each.tobytes(), (name, each))  # paths that share their values
    names = [name for name, _ in found.values()]
    if len(names) < 2:
        return []
    # Here: what analyses results takes half a second to load, and status needs none of it.
    from ringsim.analysis.influence import pairs

    values = np.column_stack([each for _, each in found.values()])
    strong = [
        pair for pair in pairs(values, ~np.eye(len(names), dtype=bool))
        if abs(pair.correlation) > _STRONG
    ]  # fmt: skip
    if not strong:
        return []
    first, more = strong[0], len(strong) - 1
    others = f" (and {counted(more, 'other pair')})" * (more > 0)
    both = f"{names[first.first]} and {names[first.second]}"
    cure = "draw more samples"
    if not independent:
        cure += ' per replicate, or use design.kind = "random"'
    return [
        f"  inputs         {both} have a rank correlation of {first.correlation:+.2f} in these "
        f"samples{others}: the effect of one may be taken for that of the other; {cure}"
    ]


def extent_told(column: Column) -> str:
    """A line with the values of an input, or with the samples that have error bars."""
    values = column.values
    if column.path == _BARS and values.dtype.kind == "b":
        barred = np.flatnonzero(values).tolist()
        shown = ", ".join(map(str, barred[:_MOST_SHOWN])) + ", ..." * (len(barred) > _MOST_SHOWN)
        return f"  error bars     samples {shown}"
    unit = column.units if column.has_numbers and column.units != "1" else ""
    if values.dtype.kind in "iuf":
        extent = f"{values.min():.6g} to {values.max():.6g} {unit}".rstrip()
    else:
        words = sorted(set(labels_of(values).ravel().tolist()))
        more = [f"and {len(words) - _MOST_SHOWN} more"] if len(words) > _MOST_SHOWN else []
        extent = ", ".join(words[:_MOST_SHOWN] + more) + (unit and f", in {unit}")
    each = f", for each {column.dim.partition('_')[0]}" if column.dim else ""
    if '"kind":"function"' in column.origin:
        each += f", follows {column.input}"
    elif column.path and column.input not in ("", column.path):
        return f"  {column.input}, {column.path}: {extent}{each}"
    return f"  {column.path or column.input or f'label {column.name}'}: {extent}{each}"


# How far it is.


_TOLD = {"state", "host", "pid", "workers", "updated", "running", "spent", "ended"}


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
    words = {int(Status.OK): Status.OK.word, NO_CODE: "not_run"}
    lines = [
        f"{campaign.attributes['campaign_name']}: {campaign.table.samples - left} of "
        f"{counted(campaign.table.samples, 'sample')} done, {left} left",
        *_stopping(campaign, planned, end),
        *([f"  runs           {growth}"] if growth else []),
        *(f"  {words[code]:<14} {counts[code]}" for code in words if counts[code]),
    ]
    numbers = np.arange(len(found.status))
    endings = ending_lines(
        found.fate, found.status, numbers, lambda sample: next(found.results([sample])).reason
    )
    lines += [f"  {line}" for line in endings]
    if every := len(campaign.checked):
        lines.append(f"  checked        {every - len(campaign.unchecked())} of {every}")
    running, workers = dict[int, float](), 0
    spent, ended = np.zeros(2), np.zeros(2)
    for path in sorted(campaign.path.glob("progress-*.json")):
        if not path.is_file():  # to open a pipe would wait for its writer
            continue
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
            f"  {called:<14} {state}, {counted(told['workers'], 'worker')}, process "
            f"{told['pid']} on {told['host']}, last report {since:.0f} s ago"
        )
    checks = campaign.survey(checks=True) if running else found
    unfinished = [
        item for item in running.items()
        if (found if item[0] >= 0 else checks).status[sample_of(item[0])] == NO_CODE
    ]  # fmt: skip
    if unfinished:
        longest = sorted(unfinished, key=lambda item: -item[1])[:_MOST_SHOWN]
        listed = ", ".join(f"{named(number)} ({seconds:.0f} s)" for number, seconds in longest)
        usual = spent[0] / ended[0] if ended[0] else np.inf
        if longest[0][1] > _UNUSUAL * usual:
            listed += f"; those that have ended took {usual:.2g} s each"
        lines.append(f"  running        {len(unfinished)}: {listed}")
    if workers and ended.any():
        if ended[0]:
            checking = min(workers, sum(number < 0 for number, _ in unfinished))
            free = workers - checking or workers
            rate = free * ended[0] / max(spent[0], 1e-9)
            busy = f"{counted(checking, 'worker')} busy with checks" if checking else ""
            busy = "between checks" if checking == workers else busy
            beside = busy or "without checks" * bool(ended[1])
            beside = f" ({beside})" * bool(beside)
            lines.append(f"  rate           {rate:.3g} samples/s so far{beside}")
        about = time_left(campaign, workers, dict(unfinished))
        lines.append(f"  time left      {about}{' for these' * bool(growth)}")
    if left and (changed := other_build(campaign)):
        on = "; its workers go on with the build that began it" if workers else ""
        lines.append(f"  not continued  {changed.strip()}: what is left is refused{on}")
    return [*lines, f"  next           {_next(campaign, left, growth)}"]


def _next(campaign: Folder, left: int, growth: str) -> str:
    """What to do next, as a command; what grows is merged once it has all its samples."""
    folder = shlex.quote(str(campaign.path))
    if runs_in(campaign.path):
        if not left and not len(campaign.unchecked()):
            return "wait: the results of all samples are being merged, and figures drawn"
        if not np.isfinite(campaign.survey().seconds).any():
            return "wait: no sample has ended yet"
        return f"wait; ringsim merge {folder} gives the results so far"
    if left or len(campaign.unchecked()) or (growth and not (campaign.path / MERGED).exists()):
        again = f"ringsim campaign FILE --out {folder}"
        most = tomllib.loads(str(campaign.attributes["campaign"])).get("max_failed", np.inf)
        if (failed := len(campaign.survey().failed)) > most:
            once = f", or run these again: {again} --retry-failed" * (not growth)
            return (
                f"{counted(failed, 'sample')} failed, more than max_failed = {most}: raise it{once}"
            )
        return f"{again} continues it"
    verb = "merge" if is_behind(campaign.path) else "analyse"
    return f"ringsim {verb} {folder}"


def time_left(campaign: Folder, workers: int, running: Mapping[int, float] | None = None) -> str:
    """About how long samples, and checks by the other engine, take that are left, by those that
    have ended; ``running`` are those that run, each with how long it has, s.

    Before any check has ended one is taken for as many times a sample as in a plan, and before any
    sample has ended one for so much less than a check.
    """
    cost, checked = relative_cost(campaign.table, campaign.scene), campaign.unchecked()
    found = campaign.survey()
    per_sample = _per_cost(cost, found)
    per_check = _per_cost(cost, campaign.survey(checks=True)) if len(checked) else np.nan
    guessed = len(checked) > 0 and np.isnan(per_check)
    from_check = np.isnan(per_sample) and not guessed and not np.isnan(per_check)
    per_sample = per_check / FULL if from_check else per_sample
    left = np.concatenate([found.missing, ~checked]).astype(np.int64)  # as ``check_of``
    if not len(left):
        return "none"
    is_check = left < 0
    per = np.where(is_check, FULL * per_sample if guessed else per_check, per_sample)
    each = per * cost[np.where(is_check, ~left, left)]
    lasted = np.array([(running or {}).get(number, np.nan) for number in left.tolist()])
    # Of a check that takes longer than was guessed nobody knows how long.
    each[is_check & guessed & (lasted > each)] = np.nan
    runs, known = np.isfinite(lasted), np.isfinite(each)
    if not known.any():
        return "not known yet"
    rest = np.maximum(each - np.where(runs, lasted, 0.0), 0.0)
    # Workers are free once what they run ends; those with a run of unknown end wait for no sample.
    free, ends = np.zeros(workers), np.sort(np.where(known, rest, np.inf)[runs])[::-1][:workers]
    free[: len(ends)] = ends
    free = np.sort(free if np.isfinite(free).any() else np.zeros(workers))
    waiting = rest[known & ~runs]
    # All of it spread over those that are free by then; the last ones leave workers idle.
    shared = (waiting.sum() + np.cumsum(free)) / np.arange(1, workers + 1)
    until = shared[np.append(shared[:-1] > free[1:], False).argmin()] if len(waiting) else 0.0
    until = max(until, free[0] + waiting.max(initial=0.0), rest[runs & known].max(initial=0.0))
    told = f"about {in_words(float(until))}"
    done = np.isfinite(found.seconds)
    if len(found.missing) and done.any() and cost[found.missing].mean() < 0.8 * cost[done].mean():
        told += " (costly samples come first)"  # as those with error bars: the rate so far is less
    if (guessed and (is_check & known).any()) or (from_check and not is_check.all()):
        told += f", a check taken as {FULL:g} times a sample"
    for kind, word in ((~is_check, "sample"), (is_check, "check")):
        if count := int((kind & ~known).sum()):
            told += f", plus {counted(count, word)} of unknown duration"
    return told


def _per_cost(cost: Array, found: Survey) -> float:
    """Seconds of a run of middling cost, by those that are over; NaN if none is."""
    done = np.isfinite(found.seconds)
    return float(found.seconds[done].sum() / cost[done].sum()) if done.any() else np.nan


def _stopping(campaign: Folder, planned: int, end: End | None) -> list[str]:
    """Whether the campaign's rule has ended it, or when it looks again; nothing without a rule."""
    if end is not None:
        return [f"  ended          {end.samples} of at most {planned} samples: {end.told}"]
    missing = campaign.survey().missing
    first = int(missing[0]) if len(missing) else planned
    coming = [count for count in looks_of(campaign) if count > first]
    return (
        [f"  early stop     next checked after {coming[0]} samples (stop_when)"] if coming else []
    )
