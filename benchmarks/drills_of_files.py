"""Drills with hostile files of results, and random damage."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fuzz
import numpy as np
import tomli_w
from drills import CAMPAIGN, Faults, drill, require
from fuzz import HOSTILE, Content, fault_of, page_fault
from preloaded import ringsim

# Hostile files.


def readers(file: str) -> list[list[str]]:
    return [list(words) for words in fuzz.READERS[file]]


def read_by_all(folder: Path, file: str, what: str, faults: Faults) -> int:
    """Let every command read a hostile file; how many refused it."""
    refused = 0
    for words in readers(file):
        with (
            tempfile.TemporaryDirectory(dir=folder.parent) as place,
            faults.within(what, "-", *words),
        ):
            own = Path(place) / "own"
            # By a program that copies pipes as pipes.
            subprocess.run(["cp", "-a", folder, own], check=True)
            try:
                done = ringsim(*words, folder=own, timeout=60.0)
            except subprocess.TimeoutExpired:
                raise AssertionError("no end in 60 s") from None
            fault = fault_of(done, ("out", ".nc", "journal", "sound", "ringsim:"))
            require(not (fault := fault or page_fault(own)), fault)
            refused += done.returncode == 2
    return refused


def prepared(folder: Path) -> Path:
    own = shutil.copytree(fuzz.sound(), folder / "own")
    (own / "sound").symlink_to(fuzz.sound())
    return own


def the_file(folder: Path, file: str) -> Path:
    return next((folder / "out/journals").iterdir()) if file == "journal" else folder / file


@drill("files", "cut files", "each file of results cut to 0, 1, 100 bytes, half, all but one",
       "read, or refused in one line")  # fmt: skip
def cut(folder: Path) -> str:
    own, refused, faults = prepared(folder), 0, Faults()
    for file in fuzz.READERS:
        content = (path := the_file(own, file)).read_bytes()
        for size in (0, 1, 100, len(content) // 2, len(content) - 1):
            path.write_bytes(content[:size])
            refused += read_by_all(own, file, f"{file} of {size} bytes", faults)
        path.write_bytes(content)
    return faults.ended(f"{faults.tried} commands, {refused} refused it")


@drill("files", "other things", "in place of each file a folder, a pipe, an image, odd links",
       "refused in one line; nothing hangs")  # fmt: skip
def other_things(folder: Path) -> str:
    own, refused, faults = prepared(folder), 0, Faults()
    makers: dict[str, Callable[[Path], Any]] = {
        "a folder": Path.mkdir, "a link to itself": lambda p: p.symlink_to(p),
        "/dev/zero": lambda p: p.symlink_to("/dev/zero"), "a pipe": os.mkfifo,
        "a link to nothing": lambda p: p.symlink_to("nowhere"),
        "an image": lambda p: p.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(999)),
    }  # fmt: skip
    for file in fuzz.READERS:
        kept = (path := the_file(own, file)).rename(folder / "kept")
        for what, make in makers.items():
            make(path)
            refused += read_by_all(own, file, f"{what} as {file}", faults)
            path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
        kept.rename(path)
    return faults.ended(f"{faults.tried} commands, {refused} refused it")


@drill("files", "hostile texts", "HTML, formulas, TeX, terminal codes, 200 kB in texts of results",
       "shown as text; no script in a page, no formula in a table")  # fmt: skip
def texts(folder: Path) -> str:
    own, faults = prepared(folder), Faults()
    kept = {"scene", "campaign", "output", "design", "requirements", "identity", "Conventions",
            "fidelity", "solver", "judge", "modules", "max_difference"}  # fmt: skip
    for file in ("run.nc", "out/campaign.nc"):
        for text in HOSTILE:
            text = text.replace("\0", "")
            content = Content.read(fuzz.sound() / file)
            for name, value in content.attributes.items():
                if isinstance(value, str) and name not in kept:
                    content.attributes[name] = text
            for name, (dims, array, attributes) in content.arrays.items():
                if (array.dtype.kind == "O" and not dims) or name in ("reason", "log"):
                    content.arrays[name] = dims, np.full(array.shape, text, object), attributes
                attributes |= {key: text for key in ("long_name", "units") if key in attributes}
            content.write(own / file)
            read_by_all(own, file, f"{text[:30]!r} in {file}", faults)
    return faults.ended(f"{faults.tried} commands showed them as text, or refused them")


@drill("files", "hostile campaign", "the same texts as title and question in a campaign file",
       "refused, or shown as text")  # fmt: skip
def hostile_campaign(folder: Path) -> str:
    refused, faults = 0, Faults()
    for number, text in enumerate(HOSTILE):
        own = folder / str(number)
        own.mkdir()
        table = tomllib.loads(CAMPAIGN) | {"title": text, "question": text}
        table["set"] |= {"title": text}
        (own / "c.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
        for words in (
            ("campaign", "c.toml", "--samples", 6, "--out", "out"),
            ("status", "out"),
            ("analyse", "out"),
            ("report", "out"),
            ("dossier", "out"),
            ("export", "out"),
            ("plot", "out"),
        ):
            done = ringsim(*words, folder=own)
            with faults.within(repr(text[:30]), words[0]):
                require(not (fault := fault_of(done) or page_fault(own)), fault)
            if done.returncode == 2 and words[0] == "campaign":
                refused += 1
                break
    return faults.ended(f"{refused} of {len(HOSTILE)} texts refused, the others shown as text")


CASES = {"scene": 300, "campaign": 300, "result": 300}


def fuzzed(_folder: Path, kind: str) -> str:
    codes, failed = fuzz.fuzz(kind, cases=CASES[kind])
    first = " / ".join(f"{kind} {case.seed}: {case.fault}"[:250] for case in failed[:6])
    require(not failed, f"{len(failed)} of {codes.total()}: {first}")
    return fuzz.told(codes)


for kind in CASES:
    drill(
        "fuzz",
        f"fuzz {kind}",
        f"{kind} files, damaged or changed at random, by their verbs",
        "taken, or refused in one line that names field or file",
    )(functools.partial(fuzzed, kind=kind))
