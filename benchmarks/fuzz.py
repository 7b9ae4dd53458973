"""Random damage to scenes, campaign files and results: each is taken, or refused in one line.

python benchmarks/fuzz.py [scene] [campaign] [result] [--cases N] [--seconds S] [--seed N]
    [--out DIR]

Case N of a kind is the same on every machine; ``--seed N --cases 1`` makes it again.  A case holds
if the command ends by itself, without a traceback or a warning of Python, with a sound result (exit
code 0), a run that failed (3), or one line that names the field or the file (2).  What does not
hold is printed, and its file kept below ``--out``.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import functools
import math
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import tomli_w

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from preloaded import ringsim

from ringsim.scene import load_scene

SCRIPT = "<script>alert(1)</script>"
HOSTILE = (
    SCRIPT, '"><img src=x onerror=alert(1)>', "$\\frac{$", "=cmd|'/c calc'!A1", "+1+1", "@SUM(1)",
    "{{ 7 * 7 }}", "\x1b[31mred", "two\nlines", "a\0b", "\N{RIGHT-TO-LEFT OVERRIDE}abc", "..",
    "../../etc/x", "x" * 200_000, "", " ", "é" * 30, "%s %d {0}", "-rf", "NaN",
)  # fmt: skip
"""Texts that pages, figures, tables and terminals must show as they are, or refuse."""

VALUES: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-308, 10**30, 2**63, 0, 0.0, -0.0, -1, 1, 2,
    True, False, [], {}, [[]], [{}], [1.0] * 1000, {"kind": "none"}, {"kind": ""}, "none", "rigid",
    date(2026, 1, 1), {"a": {"b": {"c": 1}}}, *HOSTILE,
)  # fmt: skip
FACTORS = (0.0, -1.0, 0.5, 2.0, 10.0, 1e-3, 1e3, 1e-9, 1e9)

CHEAP = {
    "truss2": {"solver.end_time": 0.3},
    "planar-truss": {"solver.end_time": 0.2},
    "ring18": {"structure.sections": 4, "boom": "none", "solver.end_time": 0.3},
    "ring18-cable": {"structure.sections": 3, "solver.end_time": 0.2},
    "ring18-motor": {"structure.sections": 3, "solver.end_time": 0.2},
    "ring18-ground": {"structure.sections": 3, "solver.end_time": 0.2},
}
"""Scenes that are damaged, as small and short as they can be."""

CAMPAIGN: dict[str, Any] = {
    "name": "fuzz", "title": "Damaged", "seed": 7, "scene": "truss2", "fidelity": "frame",
    "max_failed": 3, "check_every": 4,
    "design": {"kind": "random", "samples": 6},
    "set": {"solver.end_time": 0.2, "record.interval": 0.05},
    "inputs": {
        "rods.young_modulus": {"kind": "normal", "mean": 120e9, "standard_deviation": 6e9},
        "cables.upper.friction.coefficient":
            {"kind": "uniform", "low": 2e-4, "high": 6e-4, "each_section": True},
        "stiffness": {"kind": "lognormal", "mean": 1e5, "standard_deviation": 2e4,
                      "shared": ["cables.upper.axial_stiffness", "cables.lower.axial_stiffness"]},
        "cables.lower.winch.stop_time":
            {"kind": "discrete", "values": [0.1, "none"], "probabilities": [0.1, 0.9]},
    },
    "limits": {"timeout": 20.0},
    "requirements": {
        "asynchrony_max": {"max": 30.0, "probability": 0.5, "confidence": 0.9},
        "outcome": {"is": "deployed", "probability": 0.5, "confidence": 0.9},
    },
}  # fmt: skip


def fault_of(
    done: subprocess.CompletedProcess[str],
    names: tuple[str, ...] = (),
    codes: tuple[int, ...] = (0, 2, 3),
) -> str:
    """What is wrong with the way in which a command ended; empty if nothing is.

    Of ``names`` a refusal must hold one: the damaged file, or the keys that were damaged.
    """
    told, code = done.stdout + done.stderr, done.returncode
    lines = done.stderr.strip().splitlines()
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    if "Traceback (most recent call last)" in told:
        return f"traceback: {lines[-1][:200] if lines else ''}"
    # Looked for before it is matched, which would take minutes in a line of 200 kB.
    if warned := [each for each in told.splitlines() if "Warning: " in each]:
        return f"a warning of Python: {warned[0][-200:]}"
    if "\x1b[" in told:
        return "commands for the terminal are printed"
    if code not in codes:
        return f"exit code {code}: {lines[-1][:200] if lines else ''}"
    if code == 2:
        refusals = [
            line
            for line in lines
            if not re.search(r"samples done|journal is damaged: |samples, \d+ failed$", line)
        ]
        if len(refusals) != 1:
            return f"refused in {len(refusals)} lines: {' / '.join(refusals)[:200]}"
        if len(refusals[0]) > 1500:
            return f"refused in {len(refusals[0])} letters: {refusals[0][:200]}"
        if names and not any(name in refusals[0] for name in names):
            return f"the refusal names neither field nor file: {refusals[0][:300]}"
    return ""


def page_fault(folder: Path) -> str:
    """Whether a text became a command of a page or of a table below a folder."""
    for page in folder.rglob("*.html"):
        if re.search(r"<script>alert|<img src=x", page.read_text(encoding="utf-8")):
            return f"{page.name} runs a text of the file"
    for table in folder.rglob("*.csv"):
        if re.search(r'(^|[,"])(=cmd|@SUM)', table.read_text(encoding="utf-8"), re.MULTILINE):
            return f"{table.name} has a formula"
    return ""


ENERGY = 0.05
"""Largest ``energy_error`` of a run that says nothing of it."""


def result_fault(path: Path) -> str:
    """Whether what ran can be read, and has no infinite number, no missing one without a status,
    and no energy that is lost without a word.
    """
    with netCDF4.Dataset(path) as file:
        for name, variable in file.variables.items():
            if variable.dtype is not str and np.isinf(np.asarray(variable[:], float)).any():
                return f"{path.name}: {name} is infinite"
        if "status" not in file.variables:
            return f"{path.name} has no status"
        status = np.atleast_1d(np.ma.filled(file["status"][:], -1))
        lost = np.atleast_1d(np.ma.filled(file["energy_error"][:], np.nan))
        told = file["reason"][:] if "reason" in file.variables else [getattr(file, "reason", "")]
        for one, error, reason in zip(status, lost, told, strict=True):
            if one == 0 and np.isnan(error):
                return f"{path.name}: a run is ok without an energy_error"
            if one == 0 and error > ENERGY and "energy" not in reason:
                return f"{path.name}: energy_error is {error:.3g}, and the reason {reason[:90]!r}"
            if one > 0 and not reason:
                return f"{path.name}: a run failed without a reason"
    return ""


# Tables, as TOML files have them.


def places(table: Any) -> Iterator[tuple[Any, Any]]:
    """Every entry of tables and lists in each other: its owner, and its key or number there."""
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield table, key
        if isinstance(value, (dict, list)):
            yield from places(value)


def damage_table(table: dict[str, Any], chance: random.Random) -> str:
    """Damage one entry of a table; tells which key."""
    owner, key = chance.choice([*places(table)])
    value = owner[key]
    match chance.randrange(9):
        case 0 | 1 | 2:
            owner[key] = copy.deepcopy(chance.choice(VALUES))
        case 3 | 4 if isinstance(value, (int, float)):
            scaled = value * chance.choice(FACTORS)
            owner[key] = int(scaled) if isinstance(value, int) and chance.random() < 0.7 else scaled
        case 5:
            del owner[key]
        case 6 if isinstance(owner, dict):
            own = f"{key}{chance.choice(['s', '_', '.x', ' ', 'é', '[1]', '[99]', ''])}"
            owner[own] = owner.pop(key)
            return str(own)
        case 7 if isinstance(value, list) and value:
            owner[key] = value + value if chance.random() < 0.5 else value[:-1]
        case 8 if isinstance(owner, dict):
            others = [each for each in owner.values() if each is not value] or [1.0]
            owner[key] = copy.deepcopy(chance.choice(others))
        case _:
            owner[key] = str(value) if chance.random() < 0.5 else [value]
    return str(key)


def vary_table(table: dict[str, Any], donor: dict[str, Any], chance: random.Random) -> str:
    """Change a table as a user might, so that most still run; tells which key."""
    entries = [*places(table)]
    numbers = [(o, k) for o, k in entries if isinstance(o[k], float) and o[k] and k != "end_time"]
    kinds = [
        (o, k) for o, k in entries
        if isinstance(o, dict) and isinstance(o[k], dict) and isinstance(donor.get(k), dict)
    ]  # fmt: skip
    optional = [(o, k) for o, k in entries if k in OPTIONAL]
    lists = [(o, k) for o, k in entries if isinstance(o[k], list) and o[k]]
    match chance.randrange(8):
        case 0 if kinds:
            owner, key = chance.choice(kinds)
            owner[key] = copy.deepcopy(donor[key])
        case 1 if optional:
            owner, key = chance.choice(optional)
            del owner[key]
        case 2 if lists:
            owner, key = chance.choice(lists)
            del owner[key][chance.randrange(len(owner[key]))]
        case 3:
            tables = [table, *(o[k] for o, k in entries if isinstance(o[k], dict))]
            mixed = chance.choice(tables)
            rows = chance.sample([*mixed.items()], len(mixed))
            mixed.clear()
            mixed.update(rows)
            return next(iter(mixed), "")
        case _ if numbers:
            owner, key = chance.choice(numbers)
            owner[key] *= chance.choice([0.5, 0.9, 0.99, 1.01, 1.1, 2.0])
        case _:
            return damage_table(table, chance)
    return str(key)


OPTIONAL = frozenset({
    "boom", "net", "faults", "limits", "loads", "friction", "damping", "stop", "controller",
    "latches", "record", "requirements", "title", "question", "outputs", "correlations", "gravity",
    "each_section", "max_failed", "check_every", "step_limit", "interval", "poisson_ratio",
})  # fmt: skip
"""Keys that most scenes and campaigns can do without."""


def damage_text(text: bytes, chance: random.Random) -> bytes:
    """Damage the letters of a file: bytes flipped, lines doubled, lost or cut."""
    lines, place = text.splitlines(keepends=True), chance.randrange(max(1, len(text)))
    line = chance.randrange(len(lines))
    match chance.randrange(6):
        case 0:
            return (
                text[:place] + bytes([text[place] ^ 1 << chance.randrange(8)]) + text[place + 1 :]
            )
        case 1:
            return b"".join([*lines[: line + 1], *lines[line:]])
        case 2:
            return b"".join([*lines[:line], *lines[line + 1 :]])
        case 3:
            return text[:place]
        case 4:
            return text[:place] + chance.choice(HOSTILE).encode()[:50] + text[place:]
    return text[:place] + bytes([chance.randrange(256)]) * 3 + text[place:]


def damaged_toml(
    table: dict[str, Any], donor: dict[str, Any], chance: random.Random
) -> tuple[bytes, tuple[str, ...]]:
    """A file of a table, damaged or, mostly, changed within reason, and the keys of that."""
    table, keys = copy.deepcopy(table), list[str]()
    if chance.random() < 0.7:
        keys += [vary_table(table, donor, chance) for _ in range(chance.choice([1, 1, 2, 3]))]
        return tomli_w.dumps(table).encode(), tuple(keys)
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        keys.append(damage_table(table, chance))
    text = tomli_w.dumps(table).encode()
    return (damage_text(text, chance) if chance.random() < 0.2 else text), tuple(keys)


# Results: all of a netCDF file, to be damaged and written again.


@dataclass
class Content:
    """What a netCDF file holds; dimensions follow from the arrays unless they are given."""

    attributes: dict[str, Any]
    arrays: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]
    sizes: dict[str, int] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Content:
        with netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            arrays = {
                name: (each.dimensions, np.asarray(each[...]), dict(each.__dict__))
                for name, each in file.variables.items()
            }
            sizes = {name: len(each) for name, each in file.dimensions.items()}
            return cls(dict(file.__dict__), arrays, sizes)

    def write(self, path: Path) -> None:
        """The file; an array whose shape does not fit gets dimensions of its own."""
        with netCDF4.Dataset(path, "w") as file:
            for name, size in self.sizes.items():
                file.createDimension(name, size)
            for name, (dims, array, attributes) in self.arrays.items():
                if tuple(self.sizes.get(each) for each in dims) != array.shape:
                    dims = tuple(f"own_{size}" for size in array.shape)
                    for each, size in zip(dims, array.shape, strict=True):
                        if each not in file.dimensions:
                            file.createDimension(each, size)
                text = array.dtype.kind in "OUS"
                made = file.createVariable(
                    name, str if text else array.dtype, dims,
                    fill_value=None if text else attributes.get("_FillValue"),
                )  # fmt: skip
                made.set_auto_maskandscale(False)
                made.setncatts({k: v for k, v in attributes.items() if k != "_FillValue"})
                made[...] = array.astype(object) if text else array
            file.setncatts(self.attributes)


def damage_content(content: Content, chance: random.Random) -> str:
    """Damage one variable, dimension or attribute; tells what was done."""
    name = chance.choice([*content.arrays])
    dims, array, attributes = content.arrays[name]
    match chance.randrange(10):
        case 0:
            del content.arrays[name]
            return f"{name} deleted"
        case 1 if array.dtype.kind == "f":
            value = chance.choice([math.nan, math.inf, 1e308, -1e300, -1.0, 0.0])
            content.arrays[name] = dims, np.full_like(array, value), attributes
            return f"{name} = {value}"
        case 2 if array.dtype.kind in "fi" and array.size:
            array = array.copy()
            value = chance.choice([99, -99, 0, 127] if array.dtype.kind == "i" else [1e300, -1, 0])
            array.flat[chance.randrange(array.size)] = value
            content.arrays[name] = dims, array, attributes
            return f"one {name} = {value}"
        case 3:
            text = chance.choice(HOSTILE).replace("\0", "")
            content.arrays[name] = dims, np.full(array.shape, text, object), attributes
            return f"{name} = text {text[:40]!r}"
        case 4:
            ones = np.ones(array.shape, chance.choice(["i1", "f4"]))
            attributes.pop("_FillValue", None)  # of another type
            content.arrays[name] = dims, ones, attributes
            return f"{name} = ones"
        case 5:
            content.arrays[name] = dims, array[:0] if array.ndim else array[None], attributes
            return f"{name} of shape {content.arrays[name][1].shape}"
        case 6:
            content.sizes[dim := chance.choice([*content.sizes])] += chance.choice([-1, 1])
            content.sizes[dim] = max(content.sizes[dim], 1)
            return f"{dim} of size {content.sizes[dim]}"
        case 7 if attributes:
            return damage_attribute(attributes, chance, f"{name}.")
    return damage_attribute(content.attributes, chance, "")


def damage_attribute(attributes: dict[str, Any], chance: random.Random, where: str) -> str:
    """Lose or replace an attribute, or damage the text that it holds."""
    key = chance.choice([*attributes])
    value, choice = attributes[key], chance.randrange(4)
    if choice == 0 and key != "_FillValue":
        del attributes[key]
        return f"attribute {where}{key} deleted"
    if choice == 1 and isinstance(value, str) and value:
        text = damage_text(value.encode(), chance).decode(errors="replace").replace("\0", "")
        attributes[key] = text
        return f"attribute {where}{key} with letters damaged"
    if key == "_FillValue":
        return f"attribute {where}{key} kept"
    attributes[key] = chance.choice([
        3, math.nan, np.array([1, 2, 3]), *(text.replace("\0", "") or "-" for text in HOSTILE)
    ])  # fmt: skip
    return f"attribute {where}{key} = {str(attributes[key])[:40]!r}"


def damage_bytes(path: Path, chance: random.Random) -> str:
    """Cut a file, or flip some of its bits."""
    content = bytearray(path.read_bytes())
    if chance.random() < 0.3:
        path.write_bytes(content[: (size := chance.randrange(len(content)))])
        return f"cut to {size} bytes"
    for _ in range(number := chance.choice([1, 4, 64])):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    path.write_bytes(content)
    return f"{number} bits flipped"


# Cases.


@dataclass
class Case:
    """A damaged file, the command that reads it, and what came of it."""

    seed: int
    what: str
    command: list[str]
    fault: str = ""
    code: int | None = None


def asked(case: Case, folder: Path, names: tuple[str, ...], seconds: float) -> Case:
    """Run the command of a case in its folder."""
    try:
        done = ringsim(*case.command, folder=folder, timeout=seconds)
    except subprocess.TimeoutExpired:
        case.fault = f"did not end within {seconds:g} s"
        return case
    except UnicodeDecodeError:
        case.fault = "prints what is no UTF-8"
        return case
    case.code = done.returncode
    case.fault = fault_of(done, names)
    (folder / "told.txt").write_text(f"{case}\n{done.stdout}\n{done.stderr}", encoding="utf-8")
    return case


def scene_case(seed: int, folder: Path) -> Case:
    """``check`` and, if that takes it, ``run`` of a damaged scene."""
    chance = random.Random(f"scene {seed}")
    name = chance.choice([*CHEAP])
    table, donor = (
        load_scene(each).with_values(CHEAP[each]).to_table()
        for each in (name, chance.choice([*CHEAP]))
    )
    text, keys = damaged_toml(table, donor, chance)
    (folder / "scene.toml").write_bytes(text)
    case = Case(seed, f"{name}: {', '.join(keys)}", ["check", "scene.toml"])
    asked(case, folder, ("scene.toml", *keys), 60.0)
    if case.fault or case.code != 0:
        return case
    most = {"solver.end_time": 0.2, "solver.step_limit": 300, "record.interval": 0.05}
    limits = [word for key, value in most.items() for word in ("--set", f"{key}={value}")]
    case.command = ["run", "scene.toml", "--out", "run.nc", *limits]
    asked(case, folder, ("scene.toml", "run.nc", *most, *keys), 120.0)
    if not case.fault and (folder / "run.nc").exists():
        case.fault = result_fault(folder / "run.nc")
    return case


def campaign_case(seed: int, folder: Path) -> Case:
    """``campaign --dry-run`` of a damaged campaign file; if that takes it, the campaign itself."""
    chance = random.Random(f"campaign {seed}")
    donor = CAMPAIGN["inputs"] | {"design": {"kind": "latin-hypercube", "samples": 8}}
    text, keys = damaged_toml(CAMPAIGN, donor, chance)
    (folder / "campaign.toml").write_bytes(text)
    command = ["campaign", "campaign.toml", "--dry-run"]
    case = asked(Case(seed, ", ".join(keys), command), folder, ("campaign.toml", *keys), 120.0)
    if case.fault or case.code != 0:
        return case
    case.command = ["campaign", "campaign.toml", "--samples", "3", "--out", "out"]
    asked(case, folder, ("campaign.toml", *keys), 120.0)
    if not case.fault and (folder / "out/campaign.nc").exists():
        case.fault = result_fault(folder / "out/campaign.nc")
    return case


@functools.cache
def sound() -> Path:
    """A folder with a small campaign and a run, made once."""
    folder = Path(tempfile.mkdtemp(prefix="ringsim-sound-"))
    table = CAMPAIGN | {"design": {"kind": "random", "samples": 12}}
    table["set"] = {"solver.end_time": 0.4, "record.interval": 0.05, "record.positions": True}
    (folder / "sound.toml").write_text(tomli_w.dumps(table))
    short = ["--set", "solver.end_time=0.4", "--set", "record.state_interval=0.1"]
    for words in (
        ["campaign", "sound.toml", "--out", "out", "--workers", "2"],
        ["run", "truss2", *short, "--out", "run.nc"],
    ):
        done = ringsim(*words, folder=folder)
        assert done.returncode == 0, done.stderr
    return folder


READERS = {
    "run.nc": (
        ("plot", "run.nc", "--out", "figures"), ("export", "run.nc", "--format", "csv,mat,pvd"),
        ("compare", "run.nc", "sound/run.nc"), ("compare", "sound/run.nc", "run.nc"),
        ("run", "truss2", "--set", "solver.end_time=0.5", "--from", "run.nc", "--out", "new.nc"),
    ),
    "out/campaign.nc": (
        ("analyse", "out/campaign.nc", "--full"), ("report", "out/campaign.nc"),
        ("plot", "out/campaign.nc", "--out", "figures"), ("dossier", "out/campaign.nc"),
        ("export", "out/campaign.nc", "--format", "csv,mat"),
        ("compare", "out/campaign.nc", "sound/out/campaign.nc", "--report", "both.html"),
        ("compare", "sound/out", "out/campaign.nc"), ("status", "out"), ("replay", "out", "1"),
        ("analyse", "out"), ("plot", "out/campaign.nc", "--animate", "--out", "figures"),
    ),
    "out/design.nc": (
        ("status", "out"), ("merge", "out"), ("replay", "out", "1"), ("analyse", "out"),
        ("campaign", "sound/sound.toml", "--out", "out"), ("replay", "out", "0", "--scene"),
    ),
    "journal": (
        ("status", "out"), ("merge", "out"), ("replay", "out", "1"), ("analyse", "out"),
        ("campaign", "sound/sound.toml", "--out", "out"),
    ),
    "out/journals-verified.npz": (("status", "out"), ("merge", "out")),
    "out/progress-all.json": (("status", "out"),),
}  # fmt: skip
"""Files of results, and the commands that read them."""


def result_case(seed: int, folder: Path) -> Case:
    """A verb that reads a damaged file of results."""
    chance = random.Random(f"result {seed}")
    shutil.copytree(sound(), folder, dirs_exist_ok=True)
    (folder / "sound").symlink_to(sound())
    file = chance.choices([*READERS], [4, 8, 3, 2, 1, 1])[0]
    command = list(chance.choice(READERS[file]))
    path = next((folder / "out/journals").iterdir()) if file == "journal" else folder / file
    if path.suffix == ".nc" and chance.random() < 0.75:
        content = Content.read(path)
        what = "; ".join(damage_content(content, chance) for _ in range(chance.choice([1, 1, 2])))
        content.write(path)
    else:
        what = damage_bytes(path, chance)
    if (file.startswith("out/design") or file == "journal") and chance.random() < 0.5:
        (folder / "out/campaign.nc").unlink()
    case = asked(Case(seed, f"{file}: {what}", command), folder, ("out", ".nc", "journal"), 120.0)
    case.fault = case.fault or page_fault(folder)
    return case


KINDS: dict[str, Callable[[int, Path], Case]] = {
    "scene": scene_case, "campaign": campaign_case, "result": result_case,
}  # fmt: skip


def fuzz(
    kind: str, *, seed: int = 0, cases: int = 100, seconds: float = math.inf,
    out: Path | None = None,
) -> tuple[Counter[int | None], list[Case]]:  # fmt: skip
    """How often each exit code came, and the cases that did not hold."""
    codes, failed, end = Counter[int | None](), list[Case](), time.monotonic() + seconds
    for number in range(seed, seed + cases):
        if time.monotonic() > end:
            break
        with tempfile.TemporaryDirectory(prefix="ringsim-fuzz-") as place:
            folder = Path(place)
            case = KINDS[kind](number, folder)
            codes[case.code] += 1
            if case.fault:
                failed.append(case)
                print(
                    f"{kind} {number}: {case.what}: {' '.join(case.command)}: {case.fault}",
                    file=sys.stderr, flush=True,
                )  # fmt: skip
                if out is not None:
                    kept = out / f"{kind}-{number}"
                    with contextlib.suppress(FileExistsError):
                        shutil.copytree(folder, kept, symlinks=True)
    return codes, failed


def told(codes: Counter[int | None]) -> str:
    """How often which exit code came, in words."""
    parts = (f"{number} with exit code {code}" for code, number in sorted(codes.items(), key=str))
    return f"{codes.total()} cases: {', '.join(parts)}"


def main() -> int:
    """Exit code 1 if any case does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", default=[*KINDS], help=" ".join(KINDS))
    parser.add_argument("--cases", type=int, default=100, help="cases of each kind")
    parser.add_argument("--seconds", type=float, default=math.inf, help="time for each kind")
    parser.add_argument("--seed", type=int, default=0, help="number of the first case")
    parser.add_argument("--out", type=Path, help="folder for the files of what does not hold")
    given = parser.parse_args()
    found = False
    for kind in given.kinds:
        if kind not in KINDS:
            parser.error(f"{kind} is none of {', '.join(KINDS)}")
        codes, failed = fuzz(
            kind, seed=given.seed, cases=given.cases, seconds=given.seconds, out=given.out
        )
        print(f"{kind}: {told(codes)}; {len(failed)} did not hold", flush=True)
        found |= bool(failed)
    return int(found)


if __name__ == "__main__":
    sys.exit(main())
