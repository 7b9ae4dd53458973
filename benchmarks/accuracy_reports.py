"""Make the accuracy reports of scenes that have one again, and the settings that come with ringsim.

Run: python benchmarks/accuracy_reports.py [--brief] [scene ...]

Writes docs/evidence/accuracy/SCENE.md and .png, and ringsim/scenes/evidence/SCENE.toml.  A study
that was interrupted goes on from runs/accuracy-SCENE, and begins anew if the engine has changed
since.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from stamp import stamp

ROOT = Path(__file__).parents[1]
EVIDENCE = ROOT / "ringsim" / "scenes" / "evidence"
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


def remake(name: str, *words: str) -> None:
    folder = fresh(ROOT / "runs" / "-".join(["accuracy", name, *words]))
    command = [sys.executable, "-m", "ringsim", "accuracy", name, "--out", str(folder), *words]
    subprocess.run(command, check=True)
    docs = ROOT / "docs" / "evidence" / "accuracy"
    for target in (docs, EVIDENCE):
        target.mkdir(parents=True, exist_ok=True)
    title, _, rest = (folder / "accuracy.md").read_text(encoding="utf-8").partition("\n")
    made = stamp(" ".join(["python benchmarks/accuracy_reports.py", *words, name]))
    (docs / f"{name}.md").write_text(f"{title}\n\n{made}\n{rest}", encoding="utf-8")
    shutil.copyfile(folder / "accuracy.png", docs / f"{name}.png")
    shutil.copyfile(folder / "settings.toml", EVIDENCE / f"{name}.toml")


if __name__ == "__main__":
    brief = [word for word in sys.argv[1:] if word == "--brief"]
    names = [word for word in sys.argv[1:] if word != "--brief"]
    for each in names or sorted(path.stem for path in EVIDENCE.glob("*.toml")):
        remake(each, *brief)
