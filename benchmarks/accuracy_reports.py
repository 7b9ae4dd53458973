"""Make the accuracy reports of the built-in scenes again, and the settings that come with ringsim.

Run: python benchmarks/accuracy_reports.py [scene ...]

Writes docs/accuracy/SCENE.md and .png, and ringsim/scenes/evidence/SCENE.toml.  A study that was
interrupted goes on from runs/accuracy-SCENE; delete that folder after changing the engine.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from ringsim.scene import builtin_scenes

ROOT = Path(__file__).parents[1]


def remake(name: str) -> None:
    folder = ROOT / "runs" / f"accuracy-{name}"
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
