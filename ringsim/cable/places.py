"""Names of the points of a cable's path and of its spans, in inputs, outputs and messages."""

import difflib
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

CABLES = ("upper", "lower")
OF_SECTION = ("first hinge", "V", "second hinge")
"""Pulleys of a section; its first hinge assembly is the one next to the section before."""


def points_of(sections: int) -> tuple[str, ...]:
    """What a cable runs along, from section 1 on.

    >>> points_of(1)
    ('section 1 first hinge', 'section 1 V', 'section 1 second hinge')
    """
    return tuple(f"section {k} {place}" for k in range(1, sections + 1) for place in OF_SECTION)


def path_of(points: Sequence[str], end: str) -> tuple[str, ...]:
    """The path from the winch on: the winch, its pulleys, and the cable's end or other winch.

    ``points`` are in the order of the sections, ``end`` is that of ``Cable``.

    >>> path_of(points_of(1), "last")
    ('winch', 'section 1 second hinge', 'section 1 V', 'section 1 first hinge')
    """
    path = points[::-1] if end == "last" else points
    return ("winch", *path, *(("far winch",) if end == "both" else ()))


def spans_of(path: Sequence[str]) -> tuple[str, ...]:
    """Names of the spans by their ends; the section stands there once if both have the same.

    >>> spans_of(path_of(points_of(1), "first"))[:2]
    ('winch to section 1 first hinge', 'section 1 first hinge to V')
    """
    return tuple(f"{one} to {_short(one, other)}" for one, other in pairwise(path))


def _short(before: str, name: str) -> str:
    section = " ".join(name.split()[:2]) + " "
    return name.removeprefix(section) if before.startswith(section) else name


def number_of(name: str, names: Sequence[str], where: str, end: str = "") -> int:
    """Number, from 1, of a named pulley or span; ValueError with the nearest name if unknown, or if
    it is that of the cable's ``end``.
    """
    if name in names:
        return names.index(name) + 1
    if name == end:
        raise ValueError(
            f'{where}: the cable is fixed there and has no pulley: the last is "{names[-1]}"'
        )
    begun = [each for each in names if each.startswith(f"{name} ")]  # a span by its pulley
    near = begun or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    hint = f'did you mean "{near[0]}"?' if near else f'the first is "{names[0]}"'
    raise ValueError(f"{where}: there is no place of that name ({hint})")


def numbered(table: dict[str, Any], points: Sequence[str]) -> dict[str, Any]:
    """A scene's table with numbers and lists for the pulleys and spans that it names.

    These are ``cable``, ``pulley`` and ``span`` of faults, and tables of coefficients: ``default``
    and one value for each named pulley.  ValueError if a name is unknown, or there is no default.
    """
    cables, faults = table.get("cables"), table.get("faults")
    known = cables if isinstance(cables, dict) else {}
    paths, present, changed = [], [], dict(known)
    for name in CABLES if points else ():
        if not isinstance(cable := known.get(name), dict):
            continue
        present.append(name)
        paths.append(path_of(points, cable.get("end", "first")))
        law = cable.get("friction")
        if isinstance(law, dict) and isinstance(law.get("coefficient"), dict):
            listed = _listed(law["coefficient"], paths[-1], f"cables.{name}.friction.coefficient")
            changed[name] = cable | {"friction": law | {"coefficient": listed}}
    if changed != known:
        table = table | {"cables": changed}
    if points and isinstance(faults, (list, tuple)):
        table = table | {
            "faults": [_fault(fault, present, paths, k) for k, fault in enumerate(faults, 1)]
        }
    return table


def _listed(given: dict[str, Any], path: Sequence[str], where: str) -> list[Any]:
    if "default" not in given:
        raise ValueError(f"{where}.default is missing: give it for all pulleys that have no own")
    values = [given["default"]] * (len(path) - 2)
    for name, value in given.items():
        if name != "default":
            values[number_of(name, path[1:-1], f'{where}."{name}"', path[-1]) - 1] = value
    return values


def _fault(fault: Any, present: Sequence[str], paths: Sequence[Sequence[str]], number: int) -> Any:
    """A fault with numbers; on a cable that is not there any will do, since that is refused."""
    if not isinstance(fault, dict):
        return fault
    made = dict(fault)
    if fault.get("cable") in present:
        made["cable"] = present.index(fault["cable"]) + 1
    cable = made.get("cable", 1)
    path = paths[cable - 1] if cable in range(1, len(paths) + 1) else ()
    for key, names, end in (("pulley", path[1:-1], path[-1:]), ("span", spans_of(path), ())):
        if isinstance(name := fault.get(key), str):
            where = f'faults[{number}].{key} = "{name}"'
            made[key] = number_of(name, names, where, *end) if path else 1
    return made
