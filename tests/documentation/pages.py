"""Pages of the documentation, and the blocks in them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if "_build" not in page.parts]


def blocks(page: Path, language: str, *, mark: str = "") -> list[str]:
    """Fenced blocks of a language; with ``mark`` only those below this comment."""
    above = rf"<!-- {mark} -->\n" if mark else ""
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^{above}```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def calls(text: str) -> list[list[str]]:
    """What a shell block calls ringsim with."""
    lines = text.replace("\\\n", " ").splitlines()
    words = [shlex.split(line, comments=True) for line in lines if line.startswith("ringsim ")]
    return [each[1 : each.index(">") if ">" in each else None] for each in words]
