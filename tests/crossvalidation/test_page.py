"""The page on cross-validation names tests that exist and has the table of its command."""

import re
from pathlib import Path

from mbdyn_reference import CASES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "cross_validation.md").read_text(encoding="utf-8")


def test_every_file_that_the_page_names_exists() -> None:
    named = set(re.findall(r"(?:tests|benchmarks)/[a-z_/]+\.(?:py|md)", PAGE))
    assert len(named) > 10
    assert [path for path in sorted(named) if not (ROOT / path).is_file()] == []


def test_the_page_has_the_table_of_the_command() -> None:
    """The head of the table stands in the command, and every case has a row at default settings."""
    command = (ROOT / "benchmarks" / "cross_validation.py").read_text(encoding="utf-8")
    head = next(line for line in PAGE.splitlines() if line.startswith("| case | settings"))
    for column in head.strip("| ").split(" | "):
        assert f"| {column} " in command
    for case in CASES:
        assert f"| {case} | default |" in PAGE
