"""What matters, for a report: rows of text out of an analysis."""

from typing import NamedTuple

import xarray as xr

from ringsim.analysis.sensitivity_text import gate_lines, told_rows


class WhatMatters(NamedTuple):
    """A table, and what it leaves out."""

    head: list[str]
    rows: list[list[str]]
    notes: list[str]


def what_matters(analysis: xr.Dataset | None) -> WhatMatters | None:
    """The groups or inputs that explain each output most; None if the design allows no index."""
    if analysis is None or "output" not in analysis.dims:
        return None
    head, rows = told_rows(analysis)
    notes = list(gate_lines(analysis))
    return WhatMatters(head, rows, notes) if rows or notes else None
