"""Which ringsim this is: its version, its commit, and a digest of what decides about results."""

import functools
import hashlib
import os
import re
import subprocess
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parent
AROUND = (
    "__main__.py", "accessor.py", "analysis", "campaign", "cli", "execution",
    "export.py", "measured.py", "plots", "reference", "report", "sampling", "storage",
    "stowed_angle.py", "vibration.py",
)  # fmt: skip
"""What plans and reads results and never makes them: no part of the sources' digest, so that a
campaign goes on after a figure was mended.  All else counts, also what comes new."""


def digest_of(files: Iterable[Path]) -> str:
    """A digest of files below the package, by their places in it and their bytes: the same
    of a checkout and of a copy that was installed from it.
    """
    digest = hashlib.blake2b(digest_size=6)
    for place, file in sorted((file.relative_to(ROOT).as_posix(), file) for file in files):
        content = file.read_bytes()
        digest.update(f"{place} {len(content)} ".encode() + content)
    return digest.hexdigest()


@functools.cache
def sources() -> str:
    """The digest of all sources that decide about the result of a run."""
    every = (file for kind in ("py", "c", "h") for file in ROOT.rglob(f"*.{kind}"))
    return digest_of(file for file in every if file.relative_to(ROOT).parts[0] not in AROUND)


@functools.cache
def commit() -> str:
    """Commit of the sources that run, with "+changes" if files differ from it; or "unknown".

    Of an installed copy that which its version names, as that of a checkout does.
    """
    tree = ROOT.parent
    if not (tree / ".git").exists():
        named = re.search(r"\+g([0-9a-f]+)", version("ringsim"))
        return named[1] if named else "unknown"
    # Without tags, so that it is the commit itself.
    describe = ["describe", "--always", "--abbrev=40", "--dirty=+changes", "--exclude=*"]
    try:
        return subprocess.run(
            ["git", "-C", os.fspath(tree), *describe],
            capture_output=True, text=True, timeout=10, check=True,
        ).stdout.strip()  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def provenance() -> dict[str, str]:
    """Version, commit and sources as attributes of a file, and by which words it is found."""
    return {
        "ringsim_version": version("ringsim"), "git_commit": commit(), "sources": sources(),
        "keywords": "deployable structures, ring antenna, multibody dynamics, asynchrony",
    }  # fmt: skip
