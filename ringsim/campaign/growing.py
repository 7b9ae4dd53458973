"""Designs that grow with their results: which samples come next, and how well they went."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from ringsim.campaign.folder import Folder, open_folder
from ringsim.campaign.specification import Campaign
from ringsim.refusal import InputError
from ringsim.sampling.designs.subset_simulation import SubsetSimulation
from ringsim.sampling.distributions.family import Array
from ringsim.storage.netcdf import DESIGN
from ringsim.variables import GOALS, Fate, Status


def grows(campaign: Campaign) -> bool:
    """Whether the samples of a campaign depend on the results of others."""
    return isinstance(campaign.specification.design, SubsetSimulation)


def grown(campaign: Campaign, path: Path) -> Campaign:
    """A campaign with the samples that follow from the results in its folder, if there is one.

    InputError if the runs do not compute the output that is asked for.
    """
    design = campaign.specification.design
    if not isinstance(design, SubsetSimulation) or not (path / DESIGN).exists():
        return campaign
    folder = open_folder(path)
    known = _responses(folder, design)
    design = design.knowing(known)
    wanted = campaign.specification.model_copy(update={"design": design})
    suspects = _suspects(folder, known, design) if design.check and design.ended else ()
    return replace(campaign, specification=wanted, suspects=suspects)


def _suspects(folder: Folder, known: Array, design: SubsetSimulation) -> tuple[int, ...]:
    """Runs on which the probability depends most: the nearest ones outside the event, half of what
    is wanted; of those in it, lost, or short of their goal the rest, evenly spread.
    """
    short = ~np.isin(folder.survey().fate, (*GOALS, Fate.NONE))
    found = np.flatnonzero((known > design.target) | np.isneginf(known) | short)
    outside = np.setdiff1d(np.arange(len(known)), found)
    near = outside[np.argsort(-known[outside], kind="stable")][: design.check // 2]
    count = min(design.check - len(near), len(found))
    chosen = np.linspace(0, len(found) - 1, count).round().astype(int)
    return tuple(np.union1d(found[chosen], near).tolist())


def growth_told(folder: Folder) -> str:
    """How many runs a campaign that grows has, in words; nothing of others."""
    table = json.loads(folder.attributes.get("design", "{}"))
    if table.get("kind") != "subset-simulation":
        return ""
    design = SubsetSimulation.model_validate(table)
    if not len(folder.survey().missing):
        design = design.knowing(_responses(folder, design))
    return design.runs_told(folder.table.samples)


def is_open(campaign: Campaign) -> bool:
    """Whether more samples may follow from the results of those that it has."""
    design = campaign.specification.design
    return isinstance(design, SubsetSimulation) and not design.ended


def _responses(folder: Folder, design: SubsetSimulation) -> Array:
    """Responses of the first samples, all of which have run."""
    found = folder.survey()
    count = int(found.missing[0]) if len(found.missing) else folder.table.samples
    values = np.full(count, np.nan)
    for result in found.results(np.arange(count)):
        arrays = result.arrays()
        if design.of in arrays:
            values[result.sample] = arrays[design.of]
        elif result.status == Status.OK and result.fate in GOALS:
            raise InputError(
                f"design.of = {design.of}: sample {result.sample} reached its goal without a value "
                "of it: its model does not compute it; choose another output, or another fidelity"
            )
    return design.responses(values, found.status[:count] != Status.OK)
