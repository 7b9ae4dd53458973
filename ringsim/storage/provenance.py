"""Where a file comes from: global attributes after ACDD, with versions, texts and machine."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = ("ringsim", "exudyn", "numpy", "scipy", "netCDF4", "mpi4py")


def provenance(*, name: str, title: str, action: str) -> dict[str, Any]:
    """Global attributes that say by whom, when, where and with what a file was made.

    Parameters
    ----------
    name, title
        Of the campaign.
    action
        What was done, in one or two words.
    """
    now = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    software = f"ringsim {version('ringsim')}"
    found: dict[str, Any] = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": title or name,
        "summary": f"Campaign {name} of simulated ring deployments: inputs and outputs by sample.",
        "history": f"{now} {action} by {software}",
        "date_created": now,
        "source": f"{software}: multibody simulation with exudyn",
        "creator_name": "ringsim",
        "creator_type": "institution",
        "creator_software": software,
        "python_version": platform.python_version(),
        "platform": platform.platform(),
        "host": platform.node(),
        "git_commit": git_commit(),
    }
    for package in _PACKAGES:
        try:
            found[f"{package}_version"] = version(package)
        except PackageNotFoundError:
            found[f"{package}_version"] = "not installed"
    return found


def git_commit() -> str:
    """Commit of the source tree that runs, with "+changes" if files differ; or "unknown"."""
    tree = Path(__file__).resolve().parents[2]
    if not (tree / ".git").exists():
        return "unknown"
    git = ["git", "-C", os.fspath(tree)]
    try:
        commit = subprocess.run(
            [*git, "rev-parse", "HEAD"], capture_output=True, text=True, timeout=10, check=True
        ).stdout.strip()
        changed = subprocess.run(
            [*git, "status", "--porcelain", "--untracked-files=no"],
            capture_output=True, text=True, timeout=10, check=True,
        ).stdout.strip()  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit}+changes" if changed else commit
