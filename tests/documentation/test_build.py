"""The documentation is built without a warning, its notebook is executed, and it lacks nothing."""

from __future__ import annotations

import html
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import ringsim
from pages import ROOT
from ringsim.cli import VERBS
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.reference.keys import keys_of
from ringsim.reference.tree import ROOTS, places


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, built by the command that the README gives."""
    folder = tmp_path_factory.mktemp("site")
    words = ["-W", "--keep-going", "-q", "docs", str(folder / "html")]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "sphinx", *words],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | {"RINGSIM_DOCS_CACHE": str(folder / "notebooks")},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "html"


def words(site: Path, page: str) -> str:
    """What a page says, without its marks."""
    text = (site / f"{page}.html").read_text(encoding="utf-8")
    return html.unescape(re.sub(r"<[^>]+>", "", text.partition("<article")[2]))


@pytest.mark.parametrize("root", ROOTS)
def test_every_key_stands_in_the_reference_with_its_meaning(site: Path, root: str) -> None:
    page = " ".join(words(site, f"reference/{root}").split())
    # Other tests define kinds of their own, which the pages do not know.
    for model in (each for each in places(root) if each.__module__.startswith("ringsim.")):
        for key in keys_of(model):
            assert f" {key.name} " in page
            assert " ".join(key.meaning.replace("`", "").split()) in page


def test_places_of_cables_are_numbered(site: Path) -> None:
    page = words(site, "reference/scene")
    assert "section 2 V to second hinge" in page
    assert 'end = "both"' in page


def test_every_variable_verb_and_public_name_is_there(site: Path) -> None:
    page = words(site, "reference/variables")
    for one in (COORDINATES | VARIABLES).values():
        assert one.name in page
        assert one.long_name in page
    page = words(site, "reference/commands")
    for verb in VERBS:
        assert f"Usage: ringsim {verb}" in page
    page = words(site, "reference/python")
    for name in ringsim.__all__:
        assert f"ringsim.{name}" in page
    assert "A copy with the fields at dotted paths replaced" in page  # Scene.with_values


def test_every_example_is_in_the_gallery(site: Path) -> None:
    page = words(site, "gallery")
    for path in (ROOT / "examples").glob("*.py"):
        assert f"python examples/{path.name}" in page
        assert path.read_text(encoding="utf-8").splitlines()[-1].strip() in page


def test_the_notebook_was_executed(site: Path) -> None:
    page = words(site, "study")
    assert re.search(r"deployed\s+8\s+8\s", page)
    assert "largest asynchrony up to the deployment time" in page
    assert list((site / "_images").glob("*.png"))
    assert 'src="_images/' in (site / "study.html").read_text(encoding="utf-8")
    page = words(site, "calibration")
    ends = re.findall(r"(?:coefficient|viscous)" + r"\s+([\d.]+)" * 3, page)
    assert len(ends) == 2
    for truth, (low, _, high) in zip((8e-4, 0.6), ends, strict=True):
        assert float(low) < truth < float(high)


def test_nothing_made_is_left_to_make(site: Path) -> None:
    for page in site.rglob("*.html"):
        assert "made:" not in page.read_text(encoding="utf-8"), page.name


def test_formulas_are_drawn_without_a_script_from_elsewhere(site: Path) -> None:
    page = (site / "theory" / "cables.html").read_text(encoding="utf-8")
    assert page.count("<math") > 30
    assert "\\frac" not in page
    assert not re.findall(r"<script[^>]+src=.(?:https?:)?//", page)
