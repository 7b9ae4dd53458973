"""What a campaign is going to do, told before it does it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ringsim.campaign.folder import open_folder, refuse_another
from ringsim.campaign.share import Share
from ringsim.campaign.specification import Campaign
from ringsim.campaign.status import in_words
from ringsim.execution.cost import relative_cost
from ringsim.execution.local import Local
from ringsim.execution.work import Work
from ringsim.sampling.columns import Table
from ringsim.storage.design_file import NAME
from ringsim.storage.journal import survey
from ringsim.storage.result import Result


def plan(campaign: Campaign, folder: Path, *, workers: int, share: Share, solver: str) -> list[str]:
    """The plan as text.

    The cost is predicted from samples that are done; if there are none, one sample of middling
    cost runs as a trial, and nothing of it is kept.  The folder need not exist.

    Raises
    ------
    InputError
        If the folder belongs to another campaign.
    """
    table = campaign.draw()
    identity = ""
    if (folder / NAME).exists():
        old = open_folder(folder)
        refuse_another(campaign, old, table, solver)
        identity = old.identity
    found = survey(folder, identity, table.samples)
    todo = found.missing[share.holds(found.missing)]
    cost = relative_cost(table, campaign.scene)
    kind = campaign.specification.design.model_dump()["kind"]
    lines = [
        f"{campaign.specification.name}: {table.samples} samples "
        f"({kind} design), {len(todo)} to run here",
        f"  folder         {folder}",
        f"  workers        {workers}",
        *(f"  {line}" for line in _inputs(table)),
    ]
    if len(todo) == 0:
        return [*lines, "  nothing is left to run"]
    known = np.flatnonzero(np.isfinite(found.seconds))
    if len(known):
        per_cost = float(found.seconds[known].sum() / cost[known].sum())
        basis = f"from {len(known)} samples that are done"
    else:
        trial = int(todo[np.argsort(cost[todo])[len(todo) // 2]])
        kept: list[Result] = []
        Local(1).run(
            [trial],
            Work(
                solver=solver,
                scene=campaign.scene.to_table(),
                values_of=table.values_of,
                limits=campaign.specification.limits,
                keep=kept.append,
                stop=lambda: "",
            ),
        )
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


def _inputs(table: Table) -> list[str]:
    lines = []
    for column in table.columns:
        values = column.values
        if values.dtype.kind in "iuf":
            unit = "" if column.units == "1" else f" {column.units}"
            extent = f"{values.min():.6g} to {values.max():.6g}{unit}"
        else:
            extent = ", ".join(sorted({str(value) for value in values.ravel()}))
        each = f", for each {column.dim.partition('_')[0]}" if column.dim else ""
        lines.append(f"{column.path}: {extent}{each}")
    return lines
