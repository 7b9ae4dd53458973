"""Making ``campaign.nc`` of what a folder holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ringsim.campaign.folder import Folder
from ringsim.files import DRAFT, writing
from ringsim.storage.locks import GO_ON, in_turn
from ringsim.storage.merge import NAME, merge_shards
from ringsim.storage.provenance import provenance
from ringsim.storage.store import survey

_KEPT = ("identity", "seed", "solver", "campaign", "campaign_name", "scene", "output")


@dataclass(frozen=True)
class Merged:
    """What a folder held when it was to be merged.

    Attributes
    ----------
    left
        Samples that have no result in a shard; they are missing from a merged file.
    failed
        Samples that failed.
    path
        The merged file, or None if it was not wanted yet.
    """

    left: int
    failed: int
    path: Path | None


def merge(campaign: Folder, *, execution: str, set_aside: bool, partly: bool) -> Merged:
    """Write ``campaign.nc``, one process at a time, so that it never loses samples it had.

    Parameters
    ----------
    campaign
        The folder.
    execution
        Who computed it, in words.
    set_aside
        Move broken shards out of the way.
    partly
        Write the file also if samples are left.

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    path = campaign.path / NAME
    with writing(path, GO_ON), in_turn(campaign.path / "lock-merge"):
        for draft in campaign.path.glob(f".{NAME}.*{DRAFT}"):
            draft.unlink(missing_ok=True)
        found = survey(
            campaign.path, campaign.identity, campaign.table.samples, set_aside=set_aside
        )
        left, failed = int((~found.sealed).sum()), len(found.failed)
        if left and not partly:
            return Merged(left, failed, None)
        failed += merge_shards(
            campaign.path,
            found.shards,
            campaign.table,
            campaign.output,
            _attributes(campaign, execution),
        )
    return Merged(left, failed, path)


def _attributes(campaign: Folder, execution: str) -> dict[str, str]:
    attributes = provenance(
        name=campaign.attributes["campaign_name"],
        title=campaign.attributes["title"],
        action="merged",
    )
    attributes |= {name: campaign.attributes[name] for name in _KEPT if name in campaign.attributes}
    attributes["execution"] = execution
    attributes["history"] += f"\n{campaign.attributes['history']}"
    return attributes
