"""Make the accuracy reports of the built-in scenes again, and the settings that come with ringsim.

Run: python benchmarks/accuracy_reports.py [scene ...]

Writes docs/accuracy/SCENE.md and .png, and ringsim/scenes/evidence/SCENE.toml.  A study that was
interrupted goes on from runs/accuracy-SCENE, and begins anew if the engine has changed since.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from ringsim.scene import builtin_scenes

ROOT = Path(__file__).parents[1]
READERS = {"analysis", "campaign", "cli", "execution", "plots", "sampling", "scenes", "storage"}
"""Rooms without an effect on the numbers of a run."""


def engine() -> str:
    """A digest of all code that decides about the numbers of a run."""
    found = hashlib.sha256(version("exudyn").encode())
    for path in sorted((ROOT / "ringsim").rglob("*.py")):
        if path.relative_to(ROOT / "ringsim").parts[0] not in READERS:
            found.update(path.read_bytes())
    return found.hexdigest()


def fresh(folder: Path) -> Path:
    """The folder, without what another engine left there."""
    mark = folder / "engine.txt"
    if folder.exists() and (not mark.exists() or mark.read_text() != engine()):
        print(f"{folder}: the engine has changed: the study begins anew", flush=True)
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    mark.write_text(engine())
    return folder


def remake(name: str) -> None:
    folder = fresh(ROOT / "runs" / f"accuracy-{name}")
    command = [sys.executable, "-m", "ringsim", "accuracy", name, "--out", str(folder)]
    subprocess.run(command, check=True)
    docs, evidence = ROOT / "docs" / "accuracy", ROOT / "ringsim" / "scenes" / "evidence"
    for target in (docs, evidence):
        target.mkdir(parents=True, exist_ok=True)
    for end in ("md", "png"):
        shutil.copyfile(folder / f"accuracy.{end}", docs / f"{name}.{end}")
    shutil.copyfile(folder / "settings.toml", evidence / f"{name}.toml")


if __name__ == "__main__":
    for each in sys.argv[1:] or builtin_scenes():
        remake(each)
