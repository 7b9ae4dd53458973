"""Campaigns of listed cases, written and run by the program itself.

What they leave behind is an ordinary campaign: ``NAME.toml`` and ``NAME.csv`` can be read, changed
and run with ``ringsim campaign``, and an interrupted one goes on when it is asked for again.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from ringsim.campaign.folder import prepare_folder
from ringsim.campaign.run import Choices, run_campaign
from ringsim.campaign.specification import SOLVERS, load_campaign
from ringsim.execution.local import Local
from ringsim.exit_codes import EXIT_INTERRUPTED
from ringsim.files import write_text, writing
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.storage.merge import NAME as MERGED


@dataclass(frozen=True)
class Cases:
    """Variations of one scene that are to be run."""

    name: str
    title: str
    scene: Scene
    """What all cases vary."""
    cases: Sequence[Mapping[str, Any]]
    """Values by scene path, the same paths in each, one value (no lists) to a path."""
    timeout: float = 3600.0
    """Longest time of one run, s."""
    fidelity: str = "full"
    """``"full"`` or ``"ideal"``."""


def run_cases(folder: Path, cases: Cases, workers: int) -> Path:
    """Run the cases that are still missing, and merge them.

    Files and the campaign's folder go into ``folder``, which is created.

    Returns
    -------
    Path
        The merged file: sample k is case k.

    Raises
    ------
    InputError
        If a case is refused, or the folder cannot be written or holds another campaign.
    KeyboardInterrupt
        If a signal stopped it; the same call goes on.
    """
    file = write_cases(folder, cases)
    campaign = load_campaign(file)
    home = folder / cases.name
    prepare_folder(campaign, home, solver=SOLVERS[cases.fidelity])
    choices = Choices(Local(workers), campaign.specification.limits)
    if run_campaign(home, choices) == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    return home / MERGED


def write_cases(folder: Path, cases: Cases) -> Path:
    """Write scene, campaign file and list of cases; returns the campaign file."""
    scene, rows, file = (folder / f"{cases.name}{end}" for end in ("-scene.toml", ".csv", ".toml"))
    table = {
        "name": cases.name,
        "title": cases.title,
        "scene": scene.name,
        "fidelity": cases.fidelity,
        "design": {"kind": "list", "file": rows.name},
        "limits": {"timeout": cases.timeout},
    }
    listed = io.StringIO()
    writer = csv.DictWriter(listed, list(cases.cases[0]), lineterminator="\n")
    writer.writeheader()
    for number, case in enumerate(cases.cases):
        if case.keys() != cases.cases[0].keys():
            raise InputError(
                f"case {number} has values for {', '.join(case)}, and must have them for "
                f"{', '.join(cases.cases[0])}"
            )
        writer.writerow({k: str(v).lower() if isinstance(v, bool) else v for k, v in case.items()})
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    write_text(scene, cases.scene.to_toml())
    write_text(rows, listed.getvalue())
    write_text(file, tomli_w.dumps(table))
    return file
