"""Files: texts and TOML with refusals of one line, and files that appear whole or not at all."""

import contextlib
import errno
import glob
import os
import re
import resource
import secrets
import shutil
import time
import tomllib
from collections.abc import Iterator
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from ringsim.refusal import DEEPEST, InputError, shorten
from ringsim.tables import size_text

DESIGN, MERGED = "design.nc", "campaign.nc"
"""Files of a campaign's folder: what is drawn, and what came of it."""
DRAFT = ".draft"
"""How names of files end that are still being written; nobody reads them."""


def campaign_cure(folder: Path) -> str:
    """What to give in place of a folder without a campaign: where it has some inside, one of these,
    such as a calibration's stages.
    """
    inside = sorted(file.parent.name for file in folder.glob(f"*/{DESIGN}"))
    if not inside:
        return "give the folder that ringsim campaign has written"
    others = f" .. {inside[-1]}" if len(inside) > 1 else ""
    return f"give a campaign inside it, such as {folder / inside[0]}{others}"


_LONGEST_TEXT = 50_000_000
"""Letters: a scene of 1,000 sections with a value for each has a hundredth of it; /dev/zero would
fill the memory.
"""


def read_text(path: Path | Traversable) -> str:
    """The text of a file; InputError if it cannot be read or is not UTF-8."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            text = file.read(_LONGEST_TEXT + 1)
    except FileNotFoundError:
        raise InputError(
            f"{path}: there is no such file: check its name, and the folder that you are in"
        ) from None
    except UnicodeDecodeError as error:
        if path.name.endswith(".nc"):
            raise InputError(
                f"{path.name}: this is a netCDF file, not a text: give the TOML file that it was "
                "made from (its attributes scene and campaign hold the text)"
            ) from None
        raise InputError(
            f"{path.name}: not a text file: byte {error.start + 1} is not UTF-8; "
            "save it as UTF-8 text"
        ) from None
    except IsADirectoryError:
        raise InputError(f"{path}: this is a folder: give the name of a file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read: {reason}") from None
    if len(text) > _LONGEST_TEXT:
        raise InputError(f"{path}: longer than {_LONGEST_TEXT:,} letters: not a file of ringsim")
    return text


_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY = re.compile(
    rf"^[ \t]*\[{{0,2}}[ \t]*{_PART}(?:[ \t]*\.[ \t]*{_PART}){{{DEEPEST}}}", re.MULTILINE
)


def _depth(found: Any) -> int:
    """Levels of lists and tables in each other."""
    depth, level = 0, [found]
    while level := [v for each in level for v in _inside(each)]:
        depth += 1
    return depth


def _inside(found: Any) -> list[Any]:
    return list(
        found.values() if isinstance(found, dict) else found if isinstance(found, list) else ()
    )


def _toml_cure(error: str, text: str) -> str:
    """The line that is no TOML, and what it is to be if it is one of the common slips."""
    place = re.search(r"line (\d+)", error)
    wrong = text.splitlines()[int(place[1]) - 1].strip() if place else ""
    if not wrong:
        return "; correct that line"
    cure = ""
    if word := re.fullmatch(r"([\w.\"-]+)\s*=\s*([A-Za-z][\w-]*)\s*(#.*)?", wrong):
        cure = f': words need quotes: write {word[1]} = "{word[2]}"'
    elif bound := re.match(r"([\w.-]+)\s*([<>])=?\s*([^\s#,]+)", wrong):
        key = "max" if bound[2] == "<" else "min"
        cure = f": write {bound[1]} = {{ {key} = {bound[3]}, probability = ..., confidence = ... }}"
    elif re.search(r'=\s*"[^"]*\([^"]*=\s*"\w+"', wrong):
        cure = ": quotes within quotes are single ones, as over='time'"
    return f"; correct that line, {shorten(wrong)}{cure}"


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """The tables of a TOML text; an InputError begins with ``source``.

    >>> parse_toml("loads.force = 0.02", "ring.toml")
    {'loads': {'force': 0.02}}
    """
    # Before it is read: a key of a million parts takes a minute.
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.end()) + 1
        raise InputError(f"{source}: line {line}: a key of more than {DEEPEST} parts")
    try:
        read = tomllib.loads(text)
        if _depth(read) > DEEPEST:
            raise RecursionError
        return read
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"{source}: not valid TOML: {error}{_toml_cure(str(error), text)}"
        ) from None
    except RecursionError:
        raise InputError(f"{source}: its lists or tables are nested too deeply") from None
    except ValueError as error:
        raise InputError(f"{source}: a number cannot be read: {error}") from None


def require_place(path: Path) -> None:
    """Refuse (InputError) a file that could not be written, before time is spent on its content."""
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give the name of a file")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}: create it first")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: cannot be written to this folder: choose another one")


def require_regular(path: Path) -> None:
    """Refuse (InputError) a pipe or a device in place of a file that is read here and there: to
    open a pipe waits for a writer, and a device may have no end.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: is a pipe or a device, but must be a file: copy it into one")


def require_file(path: Path, *sources: Path) -> None:
    """Refuse (InputError) a name or a place at which no netCDF file can be written, the files of a
    campaign, which nothing else may replace, and the ``sources`` of what is written.
    """
    require_place(path)
    if path.suffix != ".nc":
        raise InputError(
            f"{path}: the file is netCDF and its name must end with .nc: write {path.stem}.nc "
            '(one variable as a table: dataset["opening_angle"].to_series().to_csv(...))'
        )
    if path.exists() and path.name in (DESIGN, MERGED) and path.with_name(DESIGN).exists():
        raise InputError(
            f"{path}: this file belongs to the campaign in its folder: choose another name"
        )
    if path.exists() and any(each.exists() and path.samefile(each) for each in sources):
        raise InputError(f"{path}: what is read from this file would be lost: choose another name")


@contextlib.contextmanager
def writing(path: Path, cure: str = "free some space or choose another folder") -> Iterator[None]:
    """Refuse, with the cure, every OSError while a file is written, and the RuntimeError by which
    netCDF4 tells of a full disk.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        left = getattr(error, "__notes__", [_short(path)])[0]
        if left.startswith(_FULL):
            reason = os.strerror(errno.ENOSPC)
        raise InputError(f"{path}: cannot be written: {reason}{left}; {cure}") from error


_FULL = ", 0 B "
"""How ``_short`` begins of a full disk."""
_LITTLE_LEFT = 100e6
"""Bytes: a campaign of some hundred samples; where more is left, that is hardly the cause."""


def _short(path: Path) -> str:
    """What a disk or a limit leaves, in words, where it is little: HDF5 says "Permission denied" of
    a full disk, and "HDF error" of a limit.
    """
    told = ""
    with contextlib.suppress(OSError):
        folder = next(each for each in (path, *path.absolute().parents) if each.is_dir())
        disk = shutil.disk_usage(folder)
        if disk.total and disk.free < _LITTLE_LEFT:
            told += f", {size_text(disk.free)} are left on this disk"
    most = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    if 0 <= most < _LITTLE_LEFT:
        told += f", files may have {size_text(most)} here (ulimit -f)"
    return told


_ABANDONED = 3600.0
"""Seconds after which a draft that nobody has written to is one whose writer was killed."""


def _sweep(path: Path) -> None:
    """Remove what killed writers of a file have left of it."""
    for draft in path.parent.glob(f".{glob.escape(path.name)}.*{DRAFT}"):
        with contextlib.suppress(OSError):
            if time.time() - draft.stat().st_mtime > _ABANDONED:
                draft.unlink()


@contextlib.contextmanager
def whole(path: Path, *, lasting: bool = True, swept: bool = True) -> Iterator[Path]:
    """A draft to write to; it replaces ``path`` once it is complete.

    A lasting file is on the disk by then, so that it survives a power cut as well.  Drafts that
    killed writers of its name have left are removed, unless thousands of files make that slow.
    """
    if swept:
        _sweep(path)
    draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}{DRAFT}")
    try:
        draft.touch()  # tells why a folder refuses a file, in better words than HDF5
        try:
            yield draft
        except (OSError, RuntimeError) as error:
            error.add_note(_short(path))  # as long as the draft still takes its room
            raise
        if lasting:
            sync(draft)
        os.replace(draft, path)
        if lasting:
            sync(path.parent)
    finally:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; see ``writing`` for what is refused."""
    with writing(path), whole(path) as draft:
        draft.write_text(text, encoding="utf-8")


def sync(path: Path) -> None:
    """Make the operating system write a file or folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
