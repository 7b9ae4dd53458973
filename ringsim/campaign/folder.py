"""A campaign's folder: its design, its identity, whether it may be gone on with."""

import contextlib
import functools
import hashlib
import itertools
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim import build, extensions
from ringsim.analysis import derived
from ringsim.analysis.requirements import to_json
from ringsim.campaign.specification import SOLVERS, Campaign
from ringsim.files import DESIGN, DRAFT, writing
from ringsim.overrides import flat
from ringsim.refusal import InputError, show
from ringsim.sampling.columns import Table
from ringsim.sampling.distributions import plain
from ringsim.scene import Scene, scene_from_toml
from ringsim.storage.journal import FOLDER, Survey, survey
from ringsim.storage.netcdf import (
    GO_ON,
    attributes_of_file,
    locked,
    read_design,
    tries,
    write_design,
)
from ringsim.units import LEFT_OUT
from ringsim.variables import Fidelity, Status


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
        """What it holds of every sample, or of every sample's check; InputError if something was
        run with anything else than its design says.
        """
        return survey(self.path, self.run_with, checks=checks)

    @functools.cached_property
    def run_with(self) -> list[str]:
        """For each sample the digest of what it is run with."""
        return digests(self.table, self.attributes)

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
    if "sources" not in attributes:
        raise InputError(
            f"{path}: an older version of ringsim began this campaign and cannot be continued: "
            "use its campaign.nc as it is, or choose another folder with --out for a new campaign"
        )
    scene = scene_from_toml(attributes["scene"], source=f"{path / DESIGN}: scene")
    derived.known_from(attributes)  # before its requirements, which may be of them
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
    try:  # before the design is looked for: another command may write it just now
        names = sorted(entry.name for entry in path.iterdir()) if path.exists() else []
    except OSError as error:
        raise InputError(f"{path}: cannot be used as a folder: {error.strerror}") from None
    if (old := opened_as(campaign, path, table, solver)) is not None:
        told = old.attributes["campaign"], old.attributes.get("suspects", "[]")
        same = told == (campaign.text, json.dumps(campaign.suspects))
        return same and old.table.samples == table.samples
    ours = (FOLDER, "lock", "progress", ".design", ".progress")
    strangers = [name for name in names if not name.startswith(ours)]
    if strangers:
        raise InputError(
            f"{path}: this folder has other files ({strangers[0]}) and no campaign: choose a new "
            "folder with --out"
        )
    if any((path / FOLDER).glob("*.journal")):
        raise InputError(
            f"{path}: this folder has results in {FOLDER}, but {DESIGN}, which describes their "
            "campaign, is missing: restore it, or choose a new folder with --out"
        )
    return False


_ANEW = "requirements, outputs, checks or number of samples changed"
"""What a file that is called again may have otherwise."""


def _write(campaign: Campaign, path: Path, table: Table, solver: str, judge: str) -> None:
    wanted = campaign.specification
    model = Fidelity[wanted.fidelity.upper()]
    made = attributes_of_file(name=wanted.name, title=wanted.title, action="designed", model=model)
    attributes = made | {
        "seed": wanted.seed, "solver": solver, "scene": campaign.scene.to_toml(),
        "campaign": campaign.text, "campaign_name": wanted.name,
        "output": wanted.output.model_dump_json(),
        "design": wanted.design.model_dump_json(), "requirements": to_json(wanted.requirements),
        "modules": extensions.digest(campaign.scene.imports),
    }  # fmt: skip
    if (path / DESIGN).is_file():  # the same samples, otherwise judged, or more of them
        before = read_design(path)[1]
        attributes |= {name: before[name] for name in ("history", "date_created")}
        if before["campaign"] != campaign.text:
            changed = made["history"].replace("designed", _ANEW)
            attributes["history"] = f"{changed}\n{before['history']}"
    if campaign.clocks:
        attributes["clocks"] = json.dumps(dict(campaign.clocks))
    if wanted.outputs:
        attributes["outputs"] = derived.to_json(wanted.outputs)
    if wanted.rule is not None:
        attributes["stop_when"] = wanted.rule.model_dump_json(exclude_none=True)
    if campaign.suspects:
        attributes |= {"suspects": json.dumps(campaign.suspects), "judge": judge}
    if wanted.check_every:
        attributes |= {
            "check_every": wanted.check_every, "judge": judge,
            "max_difference": json.dumps(wanted.max_difference),
        }  # fmt: skip
    attributes["identity"] = _identity(table, attributes)
    for draft in path.glob(f".{DESIGN}.*{DRAFT}"):
        draft.unlink(missing_ok=True)
    write_design(path, table, attributes)


def _decisive(table: Table, attributes: dict[str, Any]) -> dict[str, Any]:
    """Everything that decides about the results; the keys say what differs if it does."""
    return {
        # Where modules lie decides about nothing.
        "its scene": extensions.LISTED.sub("", attributes["scene"]),
        "its seed": int(attributes["seed"]),
        "the build of ringsim": attributes["sources"],
        "the version of exudyn": attributes["exudyn_version"],
        "its inputs": [column.path for column in table.columns],
        "its solver": attributes["solver"],
        **({"a module that it imports": own} if (own := attributes.get("modules")) else {}),
    }  # fmt: skip


def _identity(table: Table, attributes: dict[str, Any]) -> str:
    content = json.dumps(_decisive(table, attributes), sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:32]


def digests(table: Table, attributes: dict[str, Any]) -> list[str]:
    """Digest of all that decides about the result of each sample of a table, its inputs too."""
    key = _identity(table, attributes).encode()
    own: list[Iterable[bytes]] = [itertools.repeat(b"", table.samples)]
    for column in table.columns:
        if column.path:
            own += [itertools.repeat(f"{column.path} ".encode()), _each_in_bytes(column.values)]
    return [
        hashlib.blake2b(b"".join(parts), key=key, digest_size=8).hexdigest()
        for parts in zip(*own, strict=False)
    ]


def _each_in_bytes(values: NDArray[Any]) -> Iterator[bytes]:
    """The values of one sample after the other."""
    if values.dtype.kind not in "biuf":
        return (json.dumps(plain(each), sort_keys=True).encode() for each in values)
    content, size = values.tobytes(), values.nbytes // max(1, len(values))
    return (content[k * size : (k + 1) * size] for k in range(len(values)))


def other_build(old: Folder) -> str:
    """That another build, or a module that has changed since, began a folder; empty if not."""
    if extensions.digest(old.scene.imports) != old.attributes.get("modules", ""):
        return f"a file of {' or '.join(old.scene.imports)} has changed since it began"
    mine = build.provenance()
    if old.attributes["sources"] == mine["sources"]:
        return ""
    return " began this campaign, and you run ".join(
        f"ringsim {each['ringsim_version']} (sources {each['sources']}, commit "
        f"{each['git_commit']})"
        for each in (old.attributes, mine)
    )


def require_this_build(old: Folder) -> None:
    """Refuse (InputError) to go on with what another build began: its models may differ."""
    if told := other_build(old):
        raise InputError(
            f"{old.path}: {told}: one folder cannot have results of different versions: continue "
            "with that version, or choose another folder with --out"
        )


def opened_as(campaign: Campaign, path: Path, table: Table, solver: str) -> Folder | None:
    """The campaign's folder, None if it is not there yet; InputError if it is another one's."""
    if not (path / DESIGN).exists():
        return None
    old = open_folder(path)
    require_this_build(old)
    held = _decisive(old.table, old.attributes)
    mine = {
        "scene": campaign.scene.to_toml(), "seed": campaign.specification.seed, "solver": solver,
        "sources": build.sources(), "modules": extensions.digest(campaign.scene.imports),
        "exudyn_version": version("exudyn"),
    }  # fmt: skip
    wanted = _decisive(table, mine)
    what = " and ".join(word for word in wanted if wanted[word] != held[word])
    if what:
        scenes = [flat(scene.to_table()) for scene in (campaign.scene, old.scene)]
        change = _first_change(*scenes) or _first_change(wanted, held)
        if what == "its scene" and campaign.scene == old.scene:
            change = ": it was written by an older version of ringsim, which can finish it"
        what = f"{what} differs{change}"
    elif not table.starts_with(old.table):
        changed = _changed_input(table, old.table)
        if table.samples < old.table.samples and not changed:
            raise InputError(
                f"{old.path} was begun with {old.table.samples} samples, {campaign.file.name} now "
                f"asks for {table.samples}: give --samples {old.table.samples} to go on, or "
                "another folder with --out"
            )
        what = (
            f"its {old.table.samples} samples are not the first of the {table.samples} of "
            f"{campaign.file.name}{changed}"
        )
    if what:
        raise InputError(
            f"{old.path}: this folder has another campaign ({what}): choose another folder with "
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


# Which settings may differ when failed samples of a campaign are run again.


FAILED = frozenset(status for status in Status if status.failed)
_TABLES = ("solver.", "record.")
_SHAPING = ("solver.end_time", "record.interval")


def check_settings(scene: Scene, settings: Mapping[str, Any]) -> None:
    """Refuse (InputError) settings that would make samples of another antenna, or of another shape.

    ``scene`` is the campaign's, ``settings`` are values by scene path.
    """
    for path, value in settings.items():
        given = f"--set {path} = {show(value)}"
        if not path.startswith(_TABLES):
            raise InputError(
                f"{given}: failed samples can be run again with other solver.* or record.* "
                "settings only; for a change of the antenna change the campaign file and choose "
                "another --out"
            )
        if path in (*_SHAPING, *scene.structure.shaping):
            raise InputError(
                f"{given}: it changes the size of the result, which must be equal for all "
                "samples: change the campaign file and choose another --out"
            )
    scene.with_values(dict(settings))
