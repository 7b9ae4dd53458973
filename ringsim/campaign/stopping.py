"""Ending a campaign once its samples are enough, at the same sample whoever has run them."""

import os
import time
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim.analysis.design import placement
from ringsim.analysis.requirements import OUTCOME, required_by
from ringsim.analysis.verdicts import Rule, holds, rule_of
from ringsim.campaign.folder import Folder
from ringsim.files import DESIGN, DRAFT, MERGED, writing
from ringsim.refusal import InputError
from ringsim.storage.journal import FOLDER, DamagedError
from ringsim.storage.merge import write_merged
from ringsim.storage.netcdf import GO_ON, OutputTable, locked, provenance
from ringsim.storage.result import sample_of
from ringsim.variables import Fidelity

# Samples end in any order, and beyond the last look some have run already.  The rule asks only the
# first samples of a look, all of them and no others, and only once they have all run: its answer is
# a function of the campaign alone.


_PAUSE = 2.0
"""Seconds between two looks for samples of others, at least."""


@dataclass(frozen=True)
class End:
    """Where a campaign ended before its last sample, and why."""

    samples: int
    told: str


def decided(campaign: Folder) -> End | None:
    """The first look whose samples have all run and are enough; None if there is none (yet)."""
    rule = rule_of(campaign.attributes)
    if rule is None:
        return None
    judged = _Judge(campaign, rule)
    try:
        for count in judged.numbers:
            told = judged.at(count)
            if told is None:
                return None
            if told:
                return End(count, told)
    except InputError:  # a requirement that its samples do not tell of ends nothing
        return None
    return None


def looks_of(campaign: Folder) -> list[int]:
    """Samples at all looks of a campaign's rule; none without one."""
    rule = rule_of(campaign.attributes)
    return [] if rule is None else _Judge(campaign, rule).numbers


def as_decided(campaign: Folder) -> Folder:
    """A campaign up to where its rule has ended it, else as it is."""
    return campaign if (end := decided(campaign)) is None else campaign.first(end.samples)


class _Judge:
    """What becomes of a rule at each look; reads every result once."""

    def __init__(self, campaign: Folder, rule: Rule) -> None:
        self._campaign, self._rule = campaign, rule
        self._empty = xr.Dataset(attrs=campaign.attributes)
        self._placed = placement(self._empty)
        self.numbers = rule.numbers(campaign.table.samples, self._placed.replicates)
        self._requirements = required_by(campaign.attributes)
        named = [each.requirement or each.of for each in rule.conditions]
        self._names = sorted({str(name) for name in named} - {OUTCOME})
        self._known = {name: np.empty(0) for name in self._names}
        self._present: set[str] = set()

    def at(self, count: int) -> str | None:
        """What shows that the samples of a look are enough, "" if they are not; None if some of
        them, or of their checks, have not run.
        """
        first = self._campaign.first(count)
        found = first.survey()
        if len(found.missing) or len(first.unchecked()):
            return None
        before = len(next(iter(self._known.values()))) if self._names else count
        more = {name: np.full(count - before, np.nan) for name in self._names}
        for result in found.results(np.arange(before, count)) if self._names else ():
            arrays = result.arrays()
            for name in self._names:
                if name in arrays:
                    more[name][result.sample - before] = arrays[name]
                    self._present.add(name)
        self._known = {n: np.append(self._known[n], more[n]) for n in self._names}
        columns: dict[str, Any] = {"status": found.status, OUTCOME: found.fate}
        columns |= {name: self._known[name] for name in self._present}
        dataset = self._empty.assign({n: ("sample", v) for n, v in columns.items()})
        dataset = dataset.assign_coords(sample=np.arange(count))
        return holds(self._rule, dataset, self._requirements, self._placed)


class Watch:
    """Follows a running campaign from look to look."""

    def __init__(self, campaign: Folder, again: Iterable[int] = ()) -> None:
        """Watch a campaign of which the samples ``again`` run first, before any look."""
        rule = rule_of(campaign.attributes)
        self._judge = None if rule is None else _Judge(campaign, rule)
        self._numbers = self._judge.numbers if self._judge is not None else []
        self._most, self._again = campaign.table.samples, set(again)
        self._left = Counter[int]()
        self._next, self._asked, self._end = 0, -_PAUSE, ""

    def in_order(self, numbers: Sequence[int]) -> list[int]:
        """Samples and checks to be run, those first that the next look waits for."""
        self._left = Counter(map(self._look_of, numbers))
        return sorted(numbers, key=self._look_of)  # stable

    def _look_of(self, number: int) -> int:
        """The first look that waits for a sample, or for its check."""
        sample = sample_of(number)
        return 0 if sample in self._again else bisect_right(self._numbers, sample)

    def finished(self, number: int) -> None:
        """Note that a sample or check has run."""
        self._left[self._look_of(number)] -= 1

    def ended(self) -> str:
        """Why the samples are enough, or an empty string; asked often.

        InputError if the rule asks for what the samples do not tell.
        """
        while self._judge is not None and not self._end and self._next < len(self._numbers):
            waits = any(self._left[look] for look in range(self._next + 1))
            # Those of other parts of the campaign end when they end.
            if waits or time.monotonic() - self._asked < _PAUSE:
                break
            count = self._numbers[self._next]
            if (told := self._judge.at(count)) is None:
                self._asked = time.monotonic()
                break
            if told:
                self._end = f"{count} of at most {self._most} samples are enough: {told}"
            self._next += 1
        return self._end


# Merging a campaign's folder into one file.


_KEPT = (
    "identity", "seed", "solver", "campaign", "campaign_name", "scene", "output", "design",
    "requirements", "check_every", "judge", "max_difference", "stop_when", "suspects", "source",
    "ringsim_version", "git_commit", "sources", "exudyn_version",
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
                    f"{campaign.path}: no sample has run, so there is nothing "
                    "to merge: first run ringsim campaign with the file of "
                    f"{design['campaign_name']}"
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
