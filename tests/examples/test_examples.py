"""Every example runs as a user would run it, and leaves the files that it says it wrote."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import preloaded
import pytest
from loops import for_each

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
TOGETHER = ("campaign", "analysis")
SMALLER = (
    ("samples = 16", "samples = 4"),
    ('sections" = 6', 'sections" = 3'),
    ('"--workers", "2"', '"--workers", "0"'),
)
ALONE = [(path.stem,) for path in EXAMPLES if path.stem not in TOGETHER]


@pytest.mark.parametrize("scripts", [TOGETHER, *ALONE], ids="-".join)
def test_an_example_runs(scripts: tuple[str, ...], tmp_path: Path) -> None:
    """One that runs another one first finds in the same folder what that has done; of the samples
    of a campaign four run, of a small ring, in one process.
    """
    for script in scripts:
        text = (ROOT / "examples" / f"{script}.py").read_text(encoding="utf-8")
        for many, few in SMALLER:
            assert (many in text) == (script == "campaign")
            text = text.replace(many, few)
        (tmp_path / f"{script}.py").write_text(text, encoding="utf-8")
        runs(tmp_path / f"{script}.py", tmp_path)


def runs(script: Path, tmp_path: Path) -> None:
    done = preloaded.script(script, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    for name in re.findall(r"^wrote (\S+)$", done.stdout, re.MULTILINE):
        assert (tmp_path / name).stat().st_size > 0


@for_each("script", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_says_what_it_shows(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert 20 <= len(text.splitlines()) <= 50
    assert ast.get_docstring(ast.parse(text))
