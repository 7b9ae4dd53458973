"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tabulate import tabulate


def markdown_table(head: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """A table as GitHub reads it; cells stay as they are given, numbers among them unformatted.

    Parameters
    ----------
    head
        Names of the columns.
    rows
        One cell for each column; a ``|`` or a line break in a cell is masked.
    """
    cells = [[" ".join(str(cell).split()).replace("|", "\\|") for cell in row] for row in rows]
    # Without alignment the columns are not padded: one long cell would widen every line.
    names = [str(name) for name in head]
    table: str = tabulate(cells, names, "github", disable_numparse=True, stralign=None)
    return table
