"""Values at dotted paths: ``rods.bar.outer_diameter``, ``rods.young_modulus[3]``."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from ringsim.refusal import InputError

_STEP = re.compile(r"^([A-Za-z_][A-Za-z0-9_]*)(?:\[(\d+)\])?$")


def parse_assignment(text: str) -> tuple[str, Any]:
    """Split ``PATH=VALUE``; the value is TOML, or a bare word taken as a string.

    Raises
    ------
    InputError
        If there is no ``=`` or no path.
    """
    path, equals, raw = text.partition("=")
    path, raw = path.strip(), raw.strip()
    if not equals or not path or not raw:
        raise InputError(f"--set {text}: must read PATH=VALUE, for example loads.force=0.02")
    try:
        return path, tomllib.loads(f"value = {raw}")["value"]
    except tomllib.TOMLDecodeError:
        return path, raw


def set_path(table: dict[str, Any], path: str, value: Any, sections: int) -> None:
    """Write ``value`` at ``path`` into nested tables, in place.

    A step ``name[k]`` is the value of section k, counted from 1; a field that had one value for
    all sections becomes a list of ``sections`` values first.  The value ``none`` removes a part.

    Raises
    ------
    InputError
        If the path is malformed or leads through a value that is not a table.
    """
    *inner, last = path.split(".")
    for step in inner:
        matched = _STEP.match(step)
        if matched is None or matched[2] is not None:
            raise InputError(f"{path}: {step!r} is not the name of a table")
        table = table.setdefault(step, {})
        if not isinstance(table, dict):
            raise InputError(f"{path}: {step} is a value, not a table")
    matched = _STEP.match(last)
    if matched is None:
        raise InputError(f"{path}: {last!r} is not a field name (or a name with [section])")
    name, index = matched[1], matched[2]
    if index is None:
        if value == "none":
            table.pop(name, None)
        else:
            table[name] = value
        return
    if not 1 <= int(index) <= sections:
        raise InputError(f"{path}: there is no section {index} (there are 1 to {sections})")
    if name not in table:
        raise InputError(f"{path}: {name} has no value to change for one section; set it first")
    old = table[name]
    values = list(old) if isinstance(old, list) else [old] * sections
    if int(index) > len(values):
        raise InputError(f"{path}: {name} has only {len(values)} values")
    values[int(index) - 1] = value
    table[name] = values
