"""A campaign's folder: its design, its identity, whether it may be gone on with; its merging."""

import contextlib
import hashlib
import json
import os
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.requirements import to_json
from ringsim.campaign.specification import SOLVERS, Campaign, flat
from ringsim.files import DRAFT, writing
from ringsim.refusal import InputError, show
from ringsim.sampling.columns import Table
from ringsim.scene import Scene, scene_from_toml
from ringsim.storage.journal import FOLDER, Survey, survey
from ringsim.storage.locks import GO_ON, locked, tries
from ringsim.storage.netcdf import DESIGN, provenance, read_design, write_design
from ringsim.units import LEFT_OUT
from ringsim.variables import Fidelity


@dataclass(frozen=True)
class Folder:
    """A prepared campaign folder: the inputs of all samples, and the scene that they vary."""

    path: Path
    table: Table
    scene: Scene
    attributes: dict[str, Any]
    """Those of the design: "identity", the digest of all that decides about the results, ..."""

    def first(self, samples: int) -> "Folder":
        """The same with the first samples alone."""
        return replace(self, table=self.table.first(samples))

    def survey(self, *, checks: bool = False) -> Survey:
        """What it holds of every sample, or of every sample's check."""
        return survey(self.path, self.attributes["identity"], self.table.samples, checks=checks)

    @property
    def checked(self) -> NDArray[np.int64]:
        """Samples that run with the judging engine, too."""
        every = int(self.attributes.get("check_every", 0))
        wanted = np.array(json.loads(self.attributes.get("suspects", "[]")), dtype=np.int64)
        if every:
            wanted = np.union1d(wanted, np.arange(0, self.table.samples, every))
        return wanted[wanted < self.table.samples]

    def unchecked(self) -> NDArray[np.int64]:
        """Samples whose check has no result."""
        if not len(self.checked):
            return self.checked
        return np.intersect1d(self.survey(checks=True).missing, self.checked)


def open_folder(path: Path) -> Folder:
    """The campaign in a folder; InputError if there is none."""
    table, attributes = read_design(path)
    scene = scene_from_toml(attributes["scene"], source=f"{path / DESIGN}: scene")
    return Folder(path, table, scene, attributes)


def prepare_folder(
    campaign: Campaign, path: Path, *, solver: str, judge: str = SOLVERS["full"]
) -> None:
    """Create a campaign's folder, or check that it is this campaign's.

    A design may have grown since: if its first samples are those of the folder, the new ones
    are added.  InputError if the folder belongs to another campaign, is in use, or cannot be
    written.
    """
    try:
        os.fspath(path).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(
            f"{path}: its name is not UTF-8: choose another folder with --out"
        ) from None
    table = campaign.draw()
    with writing(path / DESIGN, GO_ON):
        for _ in tries(path):
            if _is_ready(campaign, path, table, solver):
                return
            (path / FOLDER).mkdir(parents=True, exist_ok=True)
            with locked(path / "lock") as alone:
                if alone:
                    if not _is_ready(campaign, path, table, solver):
                        _write(campaign, path, table, solver, judge)
                    return


def _is_ready(campaign: Campaign, path: Path, table: Table, solver: str) -> bool:
    """Whether there is nothing to write to the folder: it is neither new nor does it grow."""
    if (old := opened_as(campaign, path, table, solver)) is not None:
        told = old.attributes["campaign"], old.attributes.get("suspects", "[]")
        same = told == (campaign.text, json.dumps(campaign.suspects))
        return same and old.table.samples == table.samples
    try:
        names = sorted(entry.name for entry in path.iterdir()) if path.exists() else []
    except OSError as error:
        raise InputError(f"{path}: this is no folder to write to: {error.strerror}") from None
    ours = (FOLDER, "lock", "progress", ".design", ".progress")
    strangers = [name for name in names if not name.startswith(ours)]
    if strangers:
        raise InputError(
            f"{path}: this folder holds {strangers[0]} and no campaign: choose a new one with --out"
        )
    if any((path / FOLDER).glob("*.journal")):
        raise InputError(
            f"{path}: this folder holds results in {FOLDER}, but its {DESIGN} is gone, so nobody "
            f"knows which campaign they belong to: bring {DESIGN} back, or choose a new folder "
            "with --out"
        )
    return False


def _write(campaign: Campaign, path: Path, table: Table, solver: str, judge: str) -> None:
    wanted = campaign.specification
    model = Fidelity[wanted.fidelity.upper()]
    made = provenance(name=wanted.name, title=wanted.title, action="designed", model=model)
    attributes = made | {
        "seed": wanted.seed, "solver": solver, "scene": campaign.scene.to_toml(),
        "campaign": campaign.text, "campaign_name": wanted.name,
        "output": wanted.output.model_dump_json(),
        "design": wanted.design.model_dump_json(), "requirements": to_json(wanted.requirements),
    }  # fmt: skip
    if wanted.rule is not None:
        attributes["stop_when"] = wanted.rule.model_dump_json(exclude_none=True)
    if campaign.suspects:
        attributes |= {"suspects": json.dumps(campaign.suspects), "judge": judge}
    if wanted.check_every:
        attributes |= {
            "check_every": wanted.check_every, "judge": judge,
            "max_difference": json.dumps(wanted.max_difference),
        }  # fmt: skip
    content = json.dumps(_decisive(table, attributes), sort_keys=True)
    attributes["identity"] = hashlib.sha256(content.encode()).hexdigest()[:32]
    for draft in path.glob(f".{DESIGN}.*{DRAFT}"):
        draft.unlink(missing_ok=True)
    write_design(path, table, attributes)


def _decisive(table: Table, attributes: dict[str, Any]) -> dict[str, Any]:
    """Everything that decides about the results; the keys say what differs if it does."""
    return {
        "its scene": attributes["scene"],
        "its seed": int(attributes["seed"]),
        "the version of ringsim": attributes["ringsim_version"],
        "the version of exudyn": attributes["exudyn_version"],
        "its inputs": [column.path for column in table.columns],
        "its solver": attributes["solver"],
        "the version of numba": attributes.get("numba_version")
        if attributes["solver"] == SOLVERS["frame"] else None,
    }  # fmt: skip


def opened_as(campaign: Campaign, path: Path, table: Table, solver: str) -> Folder | None:
    """The campaign's folder, None if it is not there yet; InputError if it is another one's."""
    if not (path / DESIGN).exists():
        return None
    old = open_folder(path)
    held = _decisive(old.table, old.attributes)
    mine = {
        "scene": campaign.scene.to_toml(), "seed": campaign.specification.seed, "solver": solver,
        **{f"{name}_version": version(name) for name in ("ringsim", "exudyn", "numba")},
    }  # fmt: skip
    wanted = _decisive(table, mine)
    what = " and ".join(word for word in wanted if wanted[word] != held[word])
    if what:
        scenes = [flat(scene.to_table()) for scene in (campaign.scene, old.scene)]
        change = _first_change(*scenes) or _first_change(wanted, held)
        if what == "its scene" and campaign.scene == old.scene:
            change = ": an older ringsim wrote it without a key of today, and can end it"
        what = f"{what} differs{change}"
    elif not table.starts_with(old.table):
        what = (
            f"its {old.table.samples} samples are not the first of the {table.samples} that "
            f"{campaign.file.name} gives{_changed_input(table, old.table)}"
        )
    if what:
        raise InputError(
            f"{old.path}: this folder holds another campaign ({what}): choose another folder with "
            "--out, or delete this one"
        )
    return old


def _first_change(new: dict[str, Any], old: dict[str, Any]) -> str:
    """The first key of two tables whose value is not the same, with both values; empty if none."""
    for key in {**new, **old}:
        if new.get(key, LEFT_OUT) != old.get(key, LEFT_OUT):
            values = (show(each.get(key, LEFT_OUT)) for each in (new, old))
            return f": {key} = {' instead of '.join(values)}"
    return ""


def _changed_input(new: Table, old: Table) -> str:
    """The first input that is distributed in another way than it was; empty if all are alike."""
    for mine, held in zip(new.columns, old.columns, strict=True):
        with contextlib.suppress(ValueError):  # one that is listed in a file is no JSON
            if change := _first_change(json.loads(mine.origin), json.loads(held.origin)):
                return f"; inputs.{mine.path}{change}"
    return ""
