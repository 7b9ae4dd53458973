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
    """Variations of one scene that are to be run.

    Attributes
    ----------
    name, title
        Of the campaign.
    scene
        What all cases vary.
    cases
        Values by scene path, the same paths in each, one value (no lists) to a path.
    timeout
        Longest time of one run, s.
    fidelity
        "full" or "ideal".
    """

    name: str
    title: str
    scene: Scene
    cases: Sequence[Mapping[str, Any]]
    timeout: float = 3600.0
    fidelity: str = "full"


def run_cases(folder: Path, cases: Cases, workers: int) -> Path:
    """Run the cases that are still missing, and merge them.

    Parameters
    ----------
    folder
        Where the files and the campaign's folder go; it is created.
    cases
        What to run.
    workers
        Solver processes.

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
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    write_text(scene, cases.scene.to_toml())
    write_text(rows, _csv(cases.cases))
    write_text(file, tomli_w.dumps(table))
    return file


def _csv(cases: Sequence[Mapping[str, Any]]) -> str:
    paths = list(cases[0])
    for number, case in enumerate(cases):
        if list(case) != paths:
            raise InputError(
                f"case {number} has values for {', '.join(case)}, and must have them for "
                f"{', '.join(paths)}"
            )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(paths)
    writer.writerows([[_word(value) for value in case.values()] for case in cases])
    return text.getvalue()


def _word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
