"""The worst samples: of each requirement that is violated, of each outcome that falls short of the
goal, and of each way in which runs were lost.
"""

import shlex
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.intervals import Array
from ringsim.analysis.quantities import Mask, good, lost, numbers, quantities, ran
from ringsim.analysis.requirements import OUTCOME, Requirement
from ringsim.analysis.unusual import NOTE, unusual
from ringsim.analysis.verdicts import require_values, violations
from ringsim.tables import Table, counted
from ringsim.variables import GOALS, Fate, Status

MOST = 3
"""Samples that are told of each failure."""


class _Failure(NamedTuple):
    """Samples that failed in one way."""

    words: str
    own: Mask
    badness: Array
    """By which samples are ordered, the worst the largest; NaN comes last."""
    value: str
    """Output that is told of each sample; empty for the reason of its end."""


def worst(campaign: xr.Dataset, requirements: Mapping[str, Requirement]) -> xr.Dataset:
    """The worst samples of each failure along ``worst``, the worst first; empty without failures.

    ``worst_failure`` says what failed, with ``worst_failed`` samples of ``worst_of`` that ran; then
    ``worst_sample``, ``worst_found`` (its value, or why it ended) and ``worst_inputs``, what is
    unusual in its inputs.  Violations are ordered by their distance from the bound, those without
    a value last; outcomes by the V-joints that locked, the fewest first; lost runs by how far they
    came, the shortest first.  InputError if a requirement cannot be judged.
    """
    for name in requirements:
        require_values(campaign, name)
    # What has not run yet is no sample of which others are told.
    campaign = campaign.isel(sample=np.flatnonzero(ran(campaign)))
    rows, chosen = list[tuple[str, int, int, str]](), list[int]()
    for each in _failures(campaign, requirements):
        own = np.flatnonzero(each.own)
        order = own[np.argsort(-each.badness[own], kind="stable")][:MOST]
        for place in order.tolist():
            told = _found(campaign, each.value, place)
            rows.append((each.words, int(each.own.sum()), campaign.sizes["sample"], told))
            chosen.append(place)
    if not rows:
        return xr.Dataset()
    failures, failed, of, found = zip(*rows, strict=True)
    about: dict[str, tuple[NDArray[Any], str]] = {
        "failure": (np.array(failures, dtype=object), "what failed"),
        "failed": (np.array(failed), "samples that failed so"),
        "of": (np.array(of), "samples that have run"),
        "sample": (campaign["sample"].to_numpy()[chosen], "one of the worst of them"),
        "found": (np.array(found, dtype=object), "its value, or why it ended"),
        "inputs": (
            np.array(unusual(campaign, chosen), dtype=object), "what is unusual in its inputs",
        ),
    }  # fmt: skip
    return xr.Dataset(
        {
            f"worst_{name}": (
                "worst", values,
                {"long_name": words} | ({} if values.dtype.kind == "O" else {"units": "1"}),
            )
            for name, (values, words) in about.items()
        }
    )  # fmt: skip


def _failures(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement]
) -> list[_Failure]:  # fmt: skip
    """All failures that happened; those of the same samples as one, with the words of both."""
    ok, gone = good(campaign), lost(campaign)
    stuck = -numbers(campaign, "locked_joints")
    found = []
    for name, wanted in requirements.items():
        badness, value = stuck, ""
        if name != OUTCOME:
            values, value = numbers(campaign, name), name
            low = -np.inf if wanted.min is None else wanted.min
            high = np.inf if wanted.max is None else wanted.max
            badness = np.maximum(low - values, values - high)
        words, own = f"violates {wanted.told(name)}", violations(campaign, name, wanted)
        if not np.isfinite(badness[own]).any():  # why they ended tells more
            badness, value = stuck, ""
        found.append(_Failure(words, own, badness, value))
    fates = numbers(campaign, OUTCOME)
    for fate in Fate:
        if fate not in GOALS and fate != Fate.NONE:
            words = fate.word.replace("_", " ")
            found.append(_Failure(words, ok & (fates == fate), stuck, ""))
    came = -numbers(campaign, "final_time")
    for code in Status:
        own = gone & (campaign["status"].to_numpy() == code)
        found.append(_Failure(f"lost: {code.word.replace('_', ' ')}", own, came, ""))
    kept: dict[tuple[bytes, str], _Failure] = {}
    for each in (each for each in found if each.own.any()):
        key = each.own.tobytes(), each.value
        before = kept.get(key)
        kept[key] = each if before is None else before._replace(
            words=f"{before.words}; {each.words}"
        )  # fmt: skip
    return [*kept.values()]


def _found(campaign: xr.Dataset, name: str, place: int) -> str:
    """The value of an output in a sample, or why it ended: the first clause of its reason."""
    value = float(numbers(campaign, name)[place]) if name else np.nan
    if np.isfinite(value):
        units = quantities()[name].units
        return f"{value:.4g}" + ("" if units == "1" else f" {units}")
    why = str(campaign["reason"].to_numpy()[place]).split("; ")[0] if "reason" in campaign else ""
    return f"no value: {why}" if name else why


def command(folder: str, sample: int) -> str:
    """What runs a sample of the campaign in a folder again."""
    return f"ringsim replay {shlex.quote(folder)} {sample}"


def worst_tables(analysis: xr.Dataset, folder: str) -> list[tuple[str, Table]]:
    """Of each failure its words and a table of its worst samples; none of analyses without."""
    if "worst" not in analysis.dims:
        return []
    found: dict[str, list[tuple[str, ...]]] = {}
    columns = [analysis[f"worst_{name}"].values.tolist() for name in COLUMNS]
    for words, failed, of, sample, value, odd in zip(*columns, strict=True):
        head = f"{words} ({failed} of {counted(of, 'sample')})"
        row = (str(sample), value, odd, command(folder, sample))
        found.setdefault(head, []).append(row)
    return [
        (head, Table(("sample", "found", "unusual in its inputs", "run it again"), rows, left=4))
        for head, rows in found.items()
    ]


COLUMNS = ("failure", "failed", "of", "sample", "found", "inputs")


def worst_lines(analysis: xr.Dataset, folder: str) -> list[str]:
    """The same for terminals."""
    lines = list[str]()
    for head, table in worst_tables(analysis, folder):
        lines.append(f"worst of: {head}")
        for sample, value, odd, again in table.rows:
            lines += [f"  sample {sample}: {value}", f"    inputs: {odd}", f"    {again}"]
    return [*lines, NOTE] if lines else []
