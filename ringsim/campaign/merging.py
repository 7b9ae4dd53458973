"""Merging a campaign's folder into one file."""

import os
from pathlib import Path

from ringsim.campaign.folder import Folder
from ringsim.campaign.stopping import decided
from ringsim.files import DRAFT, writing
from ringsim.refusal import InputError
from ringsim.storage.journal import FOLDER, DamagedError
from ringsim.storage.locks import GO_ON, locked
from ringsim.storage.merge import NAME as MERGED
from ringsim.storage.merge import write_merged
from ringsim.storage.netcdf import DESIGN, OutputTable, provenance
from ringsim.variables import Fidelity

_KEPT = (
    "identity", "seed", "solver", "campaign", "campaign_name", "scene", "output", "design",
    "requirements", "check_every", "judge", "max_difference", "stop_when", "suspects", "source",
    "ringsim_version", "git_commit", "sources", "exudyn_version", "numba_version",
)  # fmt: skip
"""Attributes of the design that a merged file has, too: what it was run with, whoever merges."""


def merge(campaign: Folder, *, execution: str, partly: bool) -> tuple[int, int, Path | None]:
    """Write ``campaign.nc``, one process at a time, so that it never loses samples it had.

    ``execution`` says who computed it; if samples or checks are left, it is written only if
    ``partly``.  Of a campaign that its rule has ended it holds the samples up to there.  Returns
    the number of samples left, of failed ones, and the file, or None if it is not written.
    InputError if the folder cannot be written to, or no sample at all has run.
    """
    path, design = campaign.path / MERGED, campaign.attributes
    model = Fidelity[design.get("fidelity", "full").upper()]
    title, planned = design["title"], campaign.table.samples
    made = provenance(name=design["campaign_name"], title=title, action="merged", model=model)
    attributes = made | {n: design[n] for n in _KEPT if n in design} | {"execution": execution}
    attributes["history"] += f"\n{design['history']}"
    output = OutputTable.model_validate_json(design["output"])
    with writing(path, GO_ON), locked(campaign.path / "lock-merge", wait=True):
        for draft in campaign.path.glob(f".{MERGED}.*{DRAFT}"):
            draft.unlink(missing_ok=True)
        if (end := decided(campaign)) is not None:
            campaign = campaign.first(end.samples)
            attributes |= {"stopped_after": end.samples, "stop_reason": end.told}
        if "stop_when" in attributes:
            attributes["planned_samples"] = planned
        for whole in (False, True):
            found = campaign.survey()
            checks = campaign.survey(checks=True) if len(campaign.checked) else None
            left, failed = len(found.missing), len(found.failed)
            if not partly and (left or len(campaign.unchecked())):
                return left, failed, None
            if left == campaign.table.samples:
                raise InputError(
                    f"{campaign.path}: none of its {left} samples has run, so there is nothing to "
                    f"merge: run ringsim campaign with the file of {design['campaign_name']} first"
                )
            try:
                failed += write_merged(
                    campaign.path, found, campaign.table, campaign.scene, output, attributes,
                    checks,
                )  # fmt: skip
                break
            except DamagedError:
                if whole:
                    raise
    return left, failed, path


def is_behind(folder: Path) -> bool:
    """Whether there are results that the merged file cannot have."""
    if not (folder / DESIGN).exists():
        return False
    merged = folder / MERGED
    if not merged.exists():
        return True
    newest = max((f.stat().st_mtime for f in (folder / FOLDER).glob("*.journal")), default=0.0)
    return newest > merged.stat().st_mtime and os.access(folder, os.W_OK)
