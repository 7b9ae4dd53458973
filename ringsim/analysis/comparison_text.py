"""A comparison of two campaigns or runs as lines for people."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ringsim.analysis.losses import NOTE, marked
from ringsim.analysis.quantities import quantities
from ringsim.tables import Table, interval_text, number_text, slim

_NAMED = 20
"""Changed outcomes that are listed at most."""


def compared(found: xr.Dataset) -> list[str]:
    """All lines: how samples are paired, outcomes, outputs."""
    pairs = f" ({found.attrs['pairs']} pairs)" if found.attrs["pairs"] > 1 else ""
    lines = [f"{side}: {found.attrs[side]}" for side in ("first", "second") if found.attrs[side]]
    lines.append(f"{found.attrs['pairing']}{pairs}")
    lines += [*filter(None, [found.attrs[NOTE]])]
    if found.attrs["intervals"]:
        lines.append(found.attrs["intervals"])
    for part in (_outcomes, _requirements, _outputs):
        if more := list(part(found)):
            lines += ["", *more]
    return lines


def _shares(found: xr.Dataset, word: str, dim: str, head: str) -> list[str]:
    """Counts of all samples, shares of those compared, and their differences."""
    rows = []
    for name in found[dim].values:
        one = {str(n): v.values for n, v in found.sel({dim: name}).items()}
        counts = one[f"{word}_compared"].tolist()
        low, high = one[f"{word}_share_difference_interval"].tolist()
        rows.append((
            str(name).replace("_", " ") if word == "kind" else str(name),
            *map(str, one[f"{word}_samples"]),
            *(number_text(share, 3) for share in one[f"{word}_share"]),
            number_text(one[f"{word}_share_difference"].item(), 3),
            interval_text(low, high, 3),
            str(counts[0]) if found.attrs["pairs"] else " and ".join(map(str, counts)),
        ))  # fmt: skip
    names = (
        head, "first", "second", "share in first", "in second", "difference", "95 % interval",
        "samples",
    )  # fmt: skip
    columns = 3 if found.attrs["pairs"] == 1 else len(names)
    return slim(marked(Table(names[:columns], [row[:columns] for row in rows]), found)).lines()


def _requirements(found: xr.Dataset) -> Iterator[str]:
    if "requirement" in found.dims:
        yield from _shares(found, "kept", "requirement", "samples that keep to")


def _outcomes(found: xr.Dataset) -> Iterator[str]:
    yield from _shares(found, "kind", "kind", "outcome")
    changed = found.sizes["change"]
    if not found.attrs["pairs"]:
        return
    yield f"the outcome differs in {changed} of {found.attrs['pairs']}{':' * bool(changed)}"
    names = ("changed_sample_first", "changed_outcome_first", "changed_outcome_second")
    for sample, first, second in zip(*(found[name].values for name in names), strict=True):
        if (changed := changed - 1) == found.sizes["change"] - _NAMED - 1:
            yield "  ..., all of them in the file of --out"
            return
        yield f"  sample {sample}: {first}, then {second}".replace("_", " ")


def _outputs(found: xr.Dataset) -> Iterator[str]:
    rows = []
    for name, variable in quantities().items():
        if f"{name}_difference" not in found:
            continue
        first, second = found[f"{name}_mean"].values
        if np.isnan(first) and not found.attrs["pairs"]:
            continue
        apart = found[f"{name}_difference"].item()
        scale = max(abs(first), abs(second))
        fine = max(4, int(np.log10(scale / abs(apart))) + 4) if abs(apart) > 0 else 6
        counts = found[f"{name}_samples"].values.tolist()
        largest, place = "-", "-"
        if f"{name}_largest_difference" in found:
            largest = number_text(found[f"{name}_largest_difference"].item())
            place = str(found[f"{name}_largest_difference_sample"].item())
        rows.append((
            name, "" if variable.units == "1" else variable.units, number_text(first, fine),
            number_text(second, fine), number_text(apart),
            interval_text(*found[f"{name}_difference_interval"].values.tolist()),
            _worse(found, name),
            str(counts[0]) if found.attrs["pairs"] else " and ".join(map(str, counts)),
            largest, place,
        ))  # fmt: skip
    head = (
        "output", "unit", "first", "second", "difference", "95 % interval", "worse", "samples",
        "largest of a pair", "in sample",
    )  # fmt: skip
    if rows:
        columns = 7 if found.attrs["pairs"] == 1 else len(head)
        table = Table(head[:columns], [row[:columns] for row in rows])
        yield from slim(marked(table, found)).lines()


def _worse(found: xr.Dataset, name: str) -> str:
    """Which side an output is worse on, where the interval of the difference leaves out zero; of
    two runs by the difference itself.
    """
    ends = found[f"{name}_difference_interval"].values
    if found.attrs["pairs"] == 1:
        ends = np.full(2, found[f"{name}_difference"].item())
    ends = np.sort(quantities()[name].badness * ends)
    return "second" if ends[0] > 0.0 else "first" if ends[1] < 0.0 else "-"
