"""The line below the title of a page of measurements: which build made it."""

from __future__ import annotations

import subprocess
from pathlib import Path

from ringsim.build import commit

ROOT = Path(__file__).parents[1]


def stamp(command: str) -> str:
    """Commit and date of what ran, and the command that makes the page again."""
    made = commit()
    words = ["git", "-C", str(ROOT), "log", "-1", "--format=%cs", made.partition("+")[0]]
    date = subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    changed = ", with changes" if "+" in made else ""
    return f"*Made by commit `{made[:7]}` ({date or 'unknown'}){changed}; again by `{command}`.*"
