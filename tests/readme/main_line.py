"""The commands of the README's main line, run in a folder as a user would run them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from preloaded import ringsim

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def commands() -> list[list[str]]:
    """What the line calls ringsim with, once it is installed."""
    block = re.search(r"<!-- main -->\n```sh\n(.*?)```", README, re.DOTALL)
    assert block is not None
    parts = [shlex.split(command) for command in block[1].split("&&")]
    return [part[1:] for part in parts if part[0].endswith("bin/ringsim")]


def run(arguments: list[str], folder: Path) -> str:
    """Run ringsim in a folder; returns what it prints."""
    done = ringsim(*arguments, folder=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout
