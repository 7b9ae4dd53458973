"""A campaign's folder: its design, its identity, and whether it may be gone on with."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ringsim.campaign.specification import Campaign
from ringsim.files import DRAFT, writing
from ringsim.refusal import InputError
from ringsim.sampling.columns import Table
from ringsim.scene import Scene, scene_from_toml
from ringsim.storage.design_file import NAME, read_design, write_design
from ringsim.storage.journal import FOLDER
from ringsim.storage.locks import GO_ON, busy, locked, tries
from ringsim.storage.netcdf import Output
from ringsim.storage.provenance import provenance
from ringsim.storage.survey import Survey, survey


@dataclass(frozen=True)
class Folder:
    """A prepared campaign folder.

    Attributes
    ----------
    path
        Where it is.
    identity
        Digest of everything that decides about the results.
    table
        Inputs of all samples.
    scene
        Scene that they vary.
    solver
        ``module:function`` that runs one sample.
    attributes
        Global attributes of the design.
    """

    path: Path
    identity: str
    table: Table
    scene: Scene
    solver: str
    attributes: dict[str, Any]

    def survey(self) -> Survey:
        """What it holds of every sample."""
        return survey(self.path, self.identity, self.table.samples)

    @property
    def output(self) -> Output:
        """How the merged file is stored."""
        return Output.model_validate_json(self.attributes["output"])


def open_folder(path: Path) -> Folder:
    """The campaign in a folder.

    Raises
    ------
    InputError
        If there is none.
    """
    table, attributes = read_design(path)
    scene = scene_from_toml(attributes["scene"], source=f"{path / NAME}: scene")
    return Folder(path, attributes["identity"], table, scene, attributes["solver"], attributes)


def prepare_folder(campaign: Campaign, path: Path, *, solver: str) -> Folder:
    """Create a campaign's folder, or check that it is this campaign's.

    A design may have grown since: if its first samples are those of the folder, the new ones
    are added.

    Parameters
    ----------
    campaign
        What is to be run.
    path
        The folder.
    solver
        ``module:function`` that runs one sample.

    Raises
    ------
    InputError
        If the folder belongs to another campaign, is in use, or cannot be written.
    """
    try:
        os.fspath(path).encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(
            f"{path}: its name is not UTF-8: choose another folder with --out"
        ) from None
    table = campaign.draw()
    with writing(path / NAME, GO_ON):
        for _ in tries():
            found = _as_it_is(campaign, path, table, solver)
            if found is not None:
                return found
            (path / FOLDER).mkdir(parents=True, exist_ok=True)
            with locked(path / "lock") as alone:
                if alone:
                    found = _as_it_is(campaign, path, table, solver)
                    return found or _write(campaign, path, table, solver)
    raise busy(path)


def _as_it_is(campaign: Campaign, path: Path, table: Table, solver: str) -> Folder | None:
    """The folder, if there is nothing to write to it; None if it is new or its design grows."""
    if not (path / NAME).exists():
        _refuse_strangers(path)
        return None
    old = open_folder(path)
    refuse_another(campaign, old, table, solver)
    same = old.table.samples == table.samples and old.attributes["campaign"] == campaign.text
    return old if same else None


def _refuse_strangers(path: Path) -> None:
    strangers = sorted(entry.name for entry in _entries(path) if not _ours(entry.name))
    if strangers:
        raise InputError(
            f"{path}: this folder holds {strangers[0]} and no campaign: choose a new one with --out"
        )
    if any((path / FOLDER).glob("*.journal")):
        raise InputError(
            f"{path}: this folder holds results in {FOLDER}, but its {NAME} is gone, so nobody "
            f"knows which campaign they belong to: bring {NAME} back, or choose a new folder "
            "with --out"
        )


def _write(campaign: Campaign, path: Path, table: Table, solver: str) -> Folder:
    wanted = campaign.specification
    attributes = provenance(name=wanted.name, title=wanted.title, action="designed") | {
        "identity": _identity(campaign, table, solver),
        "seed": wanted.seed,
        "solver": solver,
        "campaign": campaign.text,
        "campaign_name": wanted.name,
        "scene": campaign.scene.to_toml(),
        "output": wanted.output.model_dump_json(),
    }
    for draft in path.glob(f".{NAME}.*{DRAFT}"):
        draft.unlink(missing_ok=True)
    write_design(path, table, attributes)
    return open_folder(path)


def _entries(path: Path) -> list[Path]:
    try:
        return list(path.iterdir()) if path.exists() else []
    except OSError as error:
        raise InputError(f"{path}: this is no folder to write to: {error.strerror}") from None


def _ours(name: str) -> bool:
    return name.startswith((FOLDER, "lock", "progress", ".design", ".progress"))


def _identity(campaign: Campaign, table: Table, solver: str) -> str:
    content = {
        "scene": campaign.scene.to_toml(),
        "inputs": [column.path for column in table.columns],
        "seed": campaign.specification.seed,
        "solver": solver,
        "version": version("ringsim"),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def refuse_another(campaign: Campaign, old: Folder, table: Table, solver: str) -> None:
    """Make sure that a folder holds this campaign, or fewer samples of it.

    Raises
    ------
    InputError
        If it holds another one; the text says what differs.
    """
    cure = "choose another folder with --out, or delete this one"
    if old.identity != _identity(campaign, table, solver):
        paths = [column.path for column in table.columns]
        suspects = {
            "its scene": campaign.scene.to_toml() != old.attributes["scene"],
            "its seed": campaign.specification.seed != int(old.attributes["seed"]),
            "the version of ringsim": old.attributes["ringsim_version"] != version("ringsim"),
            "its inputs": paths != [column.path for column in old.table.columns],
            "its solver": solver != old.solver,
        }
        what = " and ".join(word for word, differs in suspects.items() if differs)
        raise InputError(f"{old.path}: this folder holds another campaign ({what} differs): {cure}")
    if not table.starts_with(old.table):
        raise InputError(
            f"{old.path}: this folder holds another campaign (its {old.table.samples} samples are "
            f"not the first of the {table.samples} that {campaign.file.name} gives): {cure}"
        )
