"""What a campaign is going to do, and what that will cost."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.design import MERGED, placement_of
from ringsim.analysis.influence import pairs
from ringsim.campaign.folder import digests, opened_as
from ringsim.campaign.run import Order, grown
from ringsim.campaign.status import in_words
from ringsim.choice import kind_of
from ringsim.execution.slot import Local
from ringsim.execution.work import Array, Work, relative_cost
from ringsim.refusal import show
from ringsim.sampling.columns import Column, Table
from ringsim.sampling.designs.blocks import Grouped
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.sampling.distributions import labels_of
from ringsim.storage.journal import Survey, survey
from ringsim.storage.result import Result, check_of, sample_of
from ringsim.tables import counted, size_text

Samples = NDArray[np.int64]
_MOST_SHOWN = 10
_SHORT = 20.0
"""A trial run that takes longer hardly consists of loading code, s."""
_STRONG = 0.5
"""Rank correlation of two inputs that is told before anything runs."""


def plan(order: Order, workers: int, say: Callable[[str], None] = lambda line: None) -> list[str]:
    """The plan as text; InputError if the folder, which need not exist, is another campaign's.

    The cost is predicted from samples that are done; if there are none, one sample of middling
    cost runs as a trial, and nothing of it is kept.  So is that of checks by the judging engine.
    ``say`` is told before a trial begins, which may take minutes.
    """
    order.check()
    campaign, share = grown(order.campaign, order.folder), order.share
    table = campaign.draw()
    old = opened_as(campaign, order.folder, table, order.solving)
    run_with = [""] * table.samples if old is None else digests(table, old.attributes)
    found = survey(order.folder, run_with)
    todo = found.missing[share.holds(found.missing)]
    design = campaign.specification.design
    lines = [
        f"{campaign.specification.name}: {table.samples} samples "
        f"({kind_of(design)} design), {len(todo)} to run here",
        *(
            [f"  runs           {design.runs_told(table.samples)}"]
            if isinstance(design, Grouped | SubsetSimulation)
            else []
        ),
        f"  folder         {order.folder}",
        f"  workers        {workers}",
        *map(_extent, table.columns),
    ]
    placed = placement_of(design)
    if placed.population and not placed.has_intervals:
        lines.append(f"  statistics     {placed.told}")
    if placed.population and not campaign.specification.correlations:
        lines += _confounded(table)
    if rule := campaign.specification.rule:
        numbers = rule.numbers(table.samples, campaign.specification.rule_replicates)
        looks = ", ".join(map(str, numbers)) or "none before the last sample"
        lines.append(f"  looks          {looks} (stop_when)")
    judged = survey(order.folder, run_with, checks=True)
    runs = sum(int(np.isfinite(each.seconds).sum()) for each in (found, judged))
    each, told, size = _predicted(order, table, found, todo, lambda sample: sample, runs, say)
    lines += [f"  cost           {words}" for words in told]
    if len(each):
        every = campaign.specification.check_every
        every_run = table.samples + (-(-table.samples // every) if every else 0)
        whole = f"{size_text(size * every_run)} for all"
        lines.append(
            f"  disk           {size_text(size)} a run, {whole}, once or twice that for {MERGED}"
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
            f"  checks         {len(checked)} samples with the full engine, too, {len(open_)} to "
            "run here"
        )
        own, told, _ = _predicted(order, table, judged, open_, check_of, runs, say)
        lines += [f"  cost of checks {words}" for words in told]
        each = np.concatenate([each, own])
    if not len(each):
        return [*lines, "  nothing is left to run"]
    whole = max(each.sum() / min(workers, len(each)), each.max())
    checks = "; checks come on top" if getattr(design, "check", 0) else ""
    rest = f" for these, up to {in_words(most)} with all levels{checks}" if most else ""
    return [*lines, f"  predicted      about {in_words(float(whole))}{rest}"]


def _predicted(
    order: Order,
    table: Table,
    found: Survey,
    todo: Samples,
    number: Callable[[int], int],
    runs: int,
    say: Callable[[str], None],
) -> tuple[Array, list[str], float]:
    """Time of each run (s), that in words, and bytes that a run takes in the journals; ``number``
    is that of a sample's run, ``runs`` are those that the journals hold.
    """
    if not len(todo):
        return np.empty(0), [], 0.0
    campaign, cost = order.campaign, relative_cost(table, order.campaign.scene)
    known = np.flatnonzero(np.isfinite(found.seconds))
    if len(known):
        per_cost = float(found.seconds[known].sum() / cost[known].sum())
        basis = f"from {len(known)} samples that are done"
        written = (file.stat().st_size for file in (order.folder / "journals").iterdir())
        size = sum(written) / runs
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
        say(f"a trial run of {check}sample {trial}, to tell the cost ...")
        # A process's first run loads code: a short one is repeated.
        Local(1).run([number(trial)] * 2, work)
        result = kept[-1]
        per_cost = result.seconds / cost[trial]
        size = float(len(result.body) + len(result.header()))
        basis = f"from a trial run of sample {trial}: {result.status.word}, {result.reason}"
    each = per_cost * cost[todo]
    ends = f"{each.min():.3g}", f"{each.max():.3g}"
    spread = f" ({ends[0]} to {ends[1]} s)" if ends[0] != ends[1] else ""
    return each, [f"{each.mean():.3g} s each{spread}, {basis}"], size


def _confounded(table: Table) -> list[str]:
    """A line if inputs go together, as points of a design do that are few for its dimensions."""
    found: dict[bytes, tuple[str, Array]] = {}
    for column in table.columns:
        if column.path and column.values.dtype.kind in "iuf":
            values = column.values.reshape(table.samples, -1).astype(float)
            for k, each in enumerate(values.T):
                place = show(column.places[k]) if column.places else k + 1
                name = f"{column.path}[{place}]" if column.dim else column.path
                found.setdefault(each.tobytes(), (name, each))  # paths that share their values
    names = [name for name, _ in found.values()]
    if len(names) < 2:
        return []
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
    return [
        f"  inputs         {both} have a rank correlation of {first.correlation:+.2f} in these "
        f"samples{others}: the effect of one may be told as the "
        'other\'s; draw more samples for each replicate, or with design.kind = "random"'
    ]


def _extent(column: Column) -> str:
    values = column.values
    unit = column.units if column.has_numbers and column.units != "1" else ""
    if values.dtype.kind in "iuf":
        extent = f"{values.min():.6g} to {values.max():.6g} {unit}".rstrip()
    else:
        words = sorted(set(labels_of(values).ravel().tolist()))
        more = [f"and {len(words) - _MOST_SHOWN} more"] if len(words) > _MOST_SHOWN else []
        extent = ", ".join(words[:_MOST_SHOWN] + more) + (unit and f", in {unit}")
    each = f", for each {column.dim.partition('_')[0]}" if column.dim else ""
    return f"  {column.path or f'label {column.name}'}: {extent}{each}"
