"""Where a file comes from: global attributes after ACDD, with versions, texts and machine."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

_PACKAGES = ("ringsim", "exudyn", "numpy", "scipy", "netCDF4", "mpi4py")


def provenance(*, name: str, title: str, action: str) -> dict[str, Any]:
    """Global attributes that say by whom, when, where and with what a campaign's file was made."""
    now = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    software = f"ringsim {version('ringsim')}"
    return {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": title or name,
        "summary": f"Campaign {name} of simulated ring deployments: inputs and outputs by sample.",
        "history": f"{now} {action} by {software}",
        "date_created": now,
        "source": f"{software}: multibody simulation with exudyn",
        "creator_name": "ringsim", "creator_type": "institution", "creator_software": software,
        "python_version": platform.python_version(), "platform": platform.platform(),
        "host": platform.node(), "git_commit": _git_commit(),
    } | {f"{package}_version": version(package) for package in _PACKAGES}  # fmt: skip


def _git_commit() -> str:
    """Commit of the source tree that runs, with "+changes" if files differ; or "unknown"."""
    tree = Path(__file__).resolve().parents[2]
    if not (tree / ".git").exists():
        return "unknown"
    # Without tags, so that it is the commit itself.
    describe = ["describe", "--always", "--abbrev=40", "--dirty=+changes", "--exclude=*"]
    try:
        return subprocess.run(
            ["git", "-C", os.fspath(tree), *describe],
            capture_output=True, text=True, timeout=10, check=True,
        ).stdout.strip()  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return "unknown"
