"""Making ``campaign.nc`` of what a folder holds."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ringsim.campaign.folder import Folder
from ringsim.files import DRAFT, writing
from ringsim.storage.locks import GO_ON, locked
from ringsim.storage.merge import NAME, write_merged
from ringsim.storage.netcdf import OutputTable
from ringsim.storage.provenance import provenance

_KEPT = ("identity", "seed", "solver", "campaign", "campaign_name", "scene", "output")


class Merged(NamedTuple):
    """What a folder held when it was to be merged."""

    left: int
    """Samples that have no result; they are missing from a merged file."""
    failed: int
    path: Path | None
    """The merged file, or None if it was not wanted yet."""


def merge(campaign: Folder, *, execution: str, partly: bool) -> Merged:
    """Write ``campaign.nc``, one process at a time, so that it never loses samples it had.

    It says in words who computed it, and is written ``partly`` if samples are left.

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    path = campaign.path / NAME
    with writing(path, GO_ON), locked(campaign.path / "lock-merge", wait=True):
        for draft in campaign.path.glob(f".{NAME}.*{DRAFT}"):
            draft.unlink(missing_ok=True)
        found = campaign.survey()
        left, failed = len(found.missing), len(found.failed)
        if left and not partly:
            return Merged(left, failed, None)
        design = campaign.attributes
        made = provenance(name=design["campaign_name"], title=design["title"], action="merged")
        attributes = made | {name: design[name] for name in _KEPT} | {"execution": execution}
        attributes["history"] += f"\n{design['history']}"
        output = OutputTable.model_validate_json(design["output"])
        failed += write_merged(campaign.path, found, campaign.table, output, attributes)
    return Merged(left, failed, path)
