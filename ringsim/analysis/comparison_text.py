"""A comparison of two campaigns or runs as lines for people."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ringsim.analysis.quantities import quantities
from ringsim.tables import interval_text, number_text, text_table

_NAMED = 20
"""Changed outcomes that are listed at most."""


def compared(found: xr.Dataset) -> list[str]:
    """All lines: how samples are paired, outcomes, outputs."""
    pairs = f" ({found.attrs['pairs']} pairs)" if found.attrs["pairs"] > 1 else ""
    lines = [f"{side}: {found.attrs[side]}" for side in ("first", "second") if found.attrs[side]]
    lines.append(f"{found.attrs['pairing']}{pairs}")
    if found.attrs["intervals"]:
        lines.append(found.attrs["intervals"])
    for part in (_outcomes, _outputs):
        if more := list(part(found)):
            lines += ["", *more]
    return lines


def _outcomes(found: xr.Dataset) -> Iterator[str]:
    rows = [
        (str(kind), *map(str, counts))
        for kind, counts in zip(found["kind"].values, found["kind_samples"].values, strict=True)
    ]
    yield from text_table(("outcome", "first", "second"), rows)
    changed = found.sizes["change"]
    if not found.attrs["pairs"]:
        return
    yield f"the outcome differs in {changed} of {found.attrs['pairs']}{':' * bool(changed)}"
    names = ("changed_sample_first", "changed_outcome_first", "changed_outcome_second")
    for sample, first, second in zip(*(found[name].values for name in names), strict=True):
        if (changed := changed - 1) == found.sizes["change"] - _NAMED - 1:
            yield "  ..., all of them in the file of --out"
            return
        yield f"  sample {sample}: {first}, then {second}"


def _outputs(found: xr.Dataset) -> Iterator[str]:
    rows = []
    for name, variable in quantities().items():
        if f"{name}_difference" not in found:
            continue
        first, second = found[f"{name}_mean"].values
        apart = found[f"{name}_difference"].item()
        scale = max(abs(first), abs(second))
        fine = max(4, int(np.log10(scale / abs(apart))) + 4) if apart else 6
        counts = found[f"{name}_samples"].values.tolist()
        largest, place = "-", "-"
        if f"{name}_largest_difference" in found:
            largest = number_text(found[f"{name}_largest_difference"].item())
            place = str(found[f"{name}_largest_difference_sample"].item())
        rows.append((
            name, "" if variable.units == "1" else variable.units, number_text(first, fine),
            number_text(second, fine), number_text(apart),
            interval_text(*found[f"{name}_difference_interval"].values.tolist()),
            str(counts[0]) if found.attrs["pairs"] else " and ".join(map(str, counts)),
            largest, place,
        ))  # fmt: skip
    head = (
        "output", "unit", "first", "second", "difference", "95 % interval", "samples",
        "largest of a pair", "in sample",
    )  # fmt: skip
    if rows:
        columns = 5 if found.attrs["pairs"] == 1 else len(head)
        yield from text_table(head[:columns], [row[:columns] for row in rows])
