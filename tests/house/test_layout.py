"""What must hold for the files as a whole."""

import re
import tomllib
from pathlib import Path

import pytest
from loops import for_each

from ringsim.cli import VERBS, command_of
from ringsim.outputs import VARIABLES

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "ringsim").rglob("*.py"))
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def readme_block(marker: str) -> str:
    """The shell block that follows a marker comment."""
    found = re.search(rf"<!-- {marker} -->\n```sh\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


@for_each("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_longer_than_600_lines(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 600


def test_every_folder_with_code_is_a_package() -> None:
    """A folder without __init__.py would be missing from an installed copy."""
    assert {path.parent for path in SOURCES} == {
        path.parent for path in SOURCES if path.name == "__init__.py"
    }


def test_every_verb_has_a_command() -> None:
    for verb in VERBS:
        assert command_of(verb).help


def test_readme_names_every_verb() -> None:
    for verb in VERBS:
        assert f"`ringsim {verb}" in README


def test_readme_is_short_and_begins_with_pictures() -> None:
    assert len(README.split()) <= 900
    pictures = re.findall(r"!\[[^]]+\]\((docs/images/[^)]+)\)", README.partition("## Start")[0])
    assert len(pictures) == 2
    for name in pictures:
        assert 10_000 < (ROOT / name).stat().st_size < 300_000


def test_results_page_names_variables_that_exist() -> None:
    table = (ROOT / "docs" / "guide" / "results.md").read_text(encoding="utf-8")
    table = table.partition("## What the antenna did")[0]
    named = set(re.findall(r"`([a-z_]+)`", table))
    assert len(named) > 10
    assert named <= set(VARIABLES)


def test_readme_blocks_are_one_line_each() -> None:
    for marker in ("main", "tests"):
        assert len(readme_block(marker).splitlines()) == 1


def test_readme_installs_extras_that_exist() -> None:
    extras = set(PROJECT["project"]["optional-dependencies"])
    named = [set(text.split(",")) for text in re.findall(r"\.\[([a-z,]+)\]", README)]
    assert len(named) == 2
    for each in named:
        assert each <= extras


def test_ci_runs_the_test_block_of_the_readme() -> None:
    assert "pytest" in readme_block("tests")
    assert "<!-- tests -->" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_tests_import_public_names_alone() -> None:
    """So that a function moves, or is written anew, without its tests."""
    private = re.compile(r"^from ringsim\S* import .*(?<!\w)_[a-z]", re.MULTILINE)
    found = [
        path.name for path in (ROOT / "tests").rglob("*.py") if private.search(path.read_text())
    ]
    assert not found
