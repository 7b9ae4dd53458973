"""Campaigns of listed cases, written and run by the program itself."""

import csv
import io
import tempfile
from collections.abc import Mapping, Sequence
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
from ringsim.variables import Status


def run_cases(
    folder: Path, name: str, scene: Scene, cases: Sequence[Mapping[str, Any]], *, workers: int,
    title: str = "", timeout: float = 3600.0, fidelity: str = "full",
    again: frozenset[Status] = frozenset(),
) -> Path:  # fmt: skip
    """Run the cases of a scene that are still missing; returns the merged file: sample k is case k.

    An ordinary campaign called ``name`` goes into ``folder``, which is created, file and all.
    ``cases`` are values by scene path, the same paths in each, one value (no lists) to a path;
    ``timeout`` is the longest time of one run, s; ``fidelity`` is "full" or "frame".

    Cases that ended with a status of ``again`` run again.

    InputError if a case or the folder is refused, which changes no file; KeyboardInterrupt after a
    signal: call again.
    """
    paths, listed = list(cases[0]), io.StringIO()
    writer = csv.DictWriter(listed, paths, lineterminator="\n")
    writer.writeheader()
    for number, case in enumerate(cases):
        if case.keys() != cases[0].keys():
            raise InputError(
                f"case {number} has values for {', '.join(case)}, and must have them for "
                f"{', '.join(paths)}"
            )
        writer.writerow({k: str(v).lower() if isinstance(v, bool) else v for k, v in case.items()})
    base, rows, file = (f"{name}{end}" for end in ("-scene.toml", ".csv", ".toml"))
    table = {
        "name": name, "title": title, "scene": base, "fidelity": fidelity,
        "design": {"kind": "list", "file": rows}, "limits": {"timeout": timeout},
    }  # fmt: skip
    texts = {base: scene.to_toml(), rows: listed.getvalue(), file: tomli_w.dumps(table)}
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    # Judged elsewhere, so that what is refused does not replace the files of what was run.
    with tempfile.TemporaryDirectory(prefix="ringsim-cases-") as drafts:
        for each, text in texts.items():
            write_text(Path(drafts) / each, text)
        campaign = load_campaign(Path(drafts) / file)
        prepare_folder(campaign, folder / name, solver=SOLVERS[fidelity])
    for each, text in texts.items():
        write_text(folder / each, text)
    choices = Choices(Local(workers), campaign.specification.limits, again=again)
    if run_campaign(folder / name, choices) == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    return folder / name / MERGED
