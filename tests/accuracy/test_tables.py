"""Markdown tables: cells as they are, and nothing in a cell breaks its row."""

from __future__ import annotations

import pytest

from ringsim.tables import markdown_table

pytestmark = pytest.mark.quick


def test_cells_stand_as_they_are_given() -> None:
    found = markdown_table(["name", 1e-3], [["1.50", 2.50], ["007", None]])
    assert found.splitlines() == [
        "| name | 0.001 |", "|---|---|", "| 1.50 | 2.5 |", "| 007 | None |",
    ]  # fmt: skip


def test_a_cell_cannot_end_its_row() -> None:
    lines = markdown_table(["reason"], [["a | b\nc"]]).splitlines()
    assert lines[2:] == ["| a \\| b c |"]
