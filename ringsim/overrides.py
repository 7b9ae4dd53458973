"""Values at dotted paths: ``rods.bar.outer_diameter``, ``rods.young_modulus[3]``."""

import difflib
import operator
import re
import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ringsim.cable.records import CABLES, number_of, path_of, spans_of
from ringsim.choice import kinds_of
from ringsim.refusal import DEEPEST, InputError, shorten
from ringsim.structures.family import Structure
from ringsim.units import LEFT_OUT

if TYPE_CHECKING:
    from ringsim.scene import Scene

MOST_SECTIONS = 1000
"""A table that asks for more is refused, and names of their pulleys would only fill the memory."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def parse_assignment(text: str) -> tuple[str, Any]:
    """Split ``PATH=VALUE``; the value is TOML, or a bare word taken as a string.

    InputError if there is no ``=``, no path or no value.

    >>> parse_assignment("loads.force = 0.02")
    ('loads.force', 0.02)
    >>> parse_assignment("rods.kind=ancf")
    ('rods.kind', 'ancf')
    """
    path, _, raw = (part.strip() for part in text.partition("="))
    if not path or not raw:
        told = shorten(text)
        raise InputError(f"--set {told}: must read PATH=VALUE, for example loads.force=0.02")
    return path, parse_value(raw, f"--set {shorten(path)}")


def parse_value(text: str, where: str) -> Any:
    """What a text means as TOML, or the text itself if it is a bare word.

    InputError, with where it stands, if it begins like a table or a list and is none.
    """
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError) as error:
        if text.startswith(("{", "[")):
            raise InputError(
                f"{where} = {shorten(text)}: not a valid TOML table or list ({error}): write for "
                'example { kind = "stall", speed = 0.1 }'
            ) from None
        return text
    return table["value"] if len(table) == 1 else text


def in_turn(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by path of several tables, so that what is set again counts where it is set last: a
    whole list would overwrite its places that stand before it.

    >>> in_turn({"lug": 0.1, "pin[2]": 0.6}, {"pin": 0.5}, {"pin[2]": 0.7})
    {'lug': 0.1, 'pin': 0.5, 'pin[2]': 0.7}
    """
    found = dict[str, Any]()
    for path, value in (item for table in tables for item in table.items()):
        found.pop(path, None)
        found[path] = value
    return found


def section_of(path: str) -> tuple[str, int | str | None]:
    """Split ``a.b[k]`` into ``a.b`` and k, or the name of a pulley; without them None.

    Shells may have taken the quotes of a name.

    >>> section_of("rods.young_modulus[3]"), section_of("loads.force")
    (('rods.young_modulus', 3), ('loads.force', None))
    >>> section_of('cables.upper.friction.coefficient["section 6 V"]')
    ('cables.upper.friction.coefficient', 'section 6 V')
    """
    if matched := re.fullmatch(r"(.*)\[([0-9]{1,6})\]", path, re.DOTALL):
        return matched[1], int(matched[2])
    matched = re.fullmatch(r"(.*)\[(\"?)(\w[\w -]*)\2\]", path)
    return (matched[1], matched[3]) if matched else (path, None)


def field_at(record: Any, path: str) -> Any:
    """The value of a scene at a dotted path, one entry of a list at ``name[k]``."""
    inner, section = section_of(with_number(record, path))
    value = operator.attrgetter(inner)(record)
    return value[section - 1] if isinstance(section, int) and isinstance(value, tuple) else value


def set_path(table: dict[str, Any], path: str, value: Any) -> None:
    """Write ``value`` at ``path`` into nested tables, in place.

    A step through a part that is not there creates it.  A last step ``name[k]`` is the value of
    section k, counted from 1, or of a pulley by its number or name; a field that had one value for
    all becomes a list first.  The value "none" (or None) removes a part, and puts the default back
    in any other field but ``kind``, where "none" is a word like others.  InputError if the path is
    malformed or leads through a value that is not a table.
    """
    scene = table
    inner, section = section_of(path := with_number(table, path))
    if isinstance(section, str):  # of something that has no names
        inner = path
    *steps, name = inner.split(".")
    if len(steps) >= DEEPEST:
        raise InputError(f"{shorten(path)}: a path of more than {DEEPEST} parts")
    for step in steps:
        if not _NAME.fullmatch(step):
            raise InputError(f"{path}: {step!r} is not the name of a table")
        if table.get(step, LEFT_OUT) == LEFT_OUT:
            table[step] = {}
        table = table[step]
        if not isinstance(table, dict):
            raise InputError(f"{path}: {step} is a value, not a table: give it as {step}=VALUE")
    if not _NAME.fullmatch(name):
        raise InputError(f"{path}: {name!r} is not a field name, or one with its section: name[1]")
    old = table.get(name)
    if isinstance(section, int):
        if old is None:
            near = difflib.get_close_matches(name, table, n=1, cutoff=0.6)
            cure = f"did you mean {near[0]}?" if near else "give one value for all first"
            raise InputError(f"{path}: there is no {name} yet: {cure}")
        values = (
            list(old) if isinstance(old, (list, tuple)) else [old] * (length_at(scene, inner) or 1)
        )
        if not 1 <= section <= len(values):
            raise InputError(
                f"{path}: there is no value {section}: choose one from 1 to {len(values)}"
            )
        values[section - 1] = value
        table[name] = values
    elif value is not None and (value != LEFT_OUT or name == "kind"):
        table[name] = value
    elif old is None or isinstance(old, dict):
        table[name] = LEFT_OUT
    else:
        del table[name]


def flat(table: Any, whole: str | None = None, prefix: str = "") -> Any:
    """Join nested tables to dotted paths, down to values; with ``whole`` down to tables that have
    this key, or would need it, since not all that they hold are tables.

    Names of pulleys become paths like others, after the ``default`` of all.

    >>> flat({"coefficient": {"section 6 V": 0.002, "default": 0.001}}, prefix="cables.upper")
    {'cables.upper.coefficient': 0.001, 'cables.upper.coefficient["section 6 V"]': 0.002}
    """
    if not isinstance(table, dict):
        return {prefix: table} if prefix else table
    if prefix and whole and not all(isinstance(inner, dict) for inner in table.values()):
        return {prefix: table} if prefix else table
    found: dict[str, Any] = {}
    pulleys = bool(prefix) and place_of(prefix, closed=True) == "pulley"
    for name, inner in sorted(table.items(), key=lambda item: pulleys and item[0] != "default"):
        path = f"{prefix}.{name}" if prefix else name
        if pulleys:
            path = prefix if name == "default" else f'{prefix}["{name}"]'
        found |= flat(inner, whole, path)
    return found


def place_of(path: str, *, closed: bool) -> str | None:
    """What a list at ``path`` has one value for: a section, corner or pulley; None if nothing."""
    if path in ("net.stiffness", "offload.residual") and not closed:
        return "corner"
    if path.startswith("cables."):
        return "pulley" if path.endswith(".coefficient") else None
    if path in ("hinge_spring.angles", "hinge_spring.torques"):
        return None
    return "section"


def length_at(scene: "Scene | dict[str, Any]", path: str) -> int | None:
    """Values in a list at ``path``, also of tables; None: any number."""
    place = place_of(path, closed=at_path(scene, "structure.closed") is not False)
    sections = at_path(scene, "structure.sections")
    if place == "pulley" or not isinstance(sections, int):
        return len(pulleys_at(scene, path)) or None
    return {"section": sections, "corner": sections + 1}.get(place or "")


def points_in(scene: "Scene | dict[str, Any]") -> tuple[str, ...]:
    """What cables run along, also of tables; nothing where these are sure to be refused."""
    kind = str(at_path(scene, "structure.kind") or "pantograph-ring")
    structure: Any = kinds_of(Structure).get(kind)
    if structure is None:
        return ()
    if (sections := at_path(scene, "structure.sections")) is None:
        own = structure.model_fields.get("sections")  # a constant of the class if it is no field
        sections = structure.sections if own is None else own.default
    usable = type(sections) is int and 0 < sections <= MOST_SECTIONS
    return tuple(structure.cable_points(sections)) if usable else ()


def with_names(table: dict[str, Any]) -> dict[str, Any]:
    """A scene's table in which faults name cables, pulleys and spans, as files may; what cannot be
    named keeps its number.
    """
    points, cables = points_in(table), table.get("cables") or {}
    present = [name for name in CABLES if isinstance(cables.get(name), dict)]
    faults = [dict(fault) for fault in table.get("faults", ())]
    for fault in faults if points else ():
        number = fault.get("cable")
        if isinstance(number, int) and 0 < number <= len(present):
            fault["cable"] = present[number - 1]
            path = path_of(points, cables[fault["cable"]].get("end", "first"))
            for key, names in (("pulley", path[1:-1]), ("span", spans_of(path))):
                if isinstance(k := fault.get(key), int) and 0 < k <= len(names):
                    fault[key] = names[k - 1]
    return table | ({"faults": faults} if faults else {})


def pulleys_at(scene: "Scene | dict[str, Any]", path: str) -> tuple[str, ...]:
    """Names of the pulleys that a list at ``path`` has values for, if it has."""
    return _cable_at(scene, path)[1:-1]


def _cable_at(scene: "Scene | dict[str, Any]", path: str) -> tuple[str, ...]:
    """Names of the points of the cable whose pulleys a list at ``path`` has values for."""
    points = points_in(scene) if place_of(path, closed=True) == "pulley" else ()
    end = at_path(scene, ".".join([*path.split(".")[:2], "end"]))
    return path_of(points, end) if points else ()


def with_number(scene: "Scene | dict[str, Any]", path: str) -> str:
    """A path with the number of a pulley instead of its name; InputError if it is unknown."""
    inner, name = section_of(path)
    cable = _cable_at(scene, inner) if isinstance(name, str) else ()
    if not isinstance(name, str) or not cable:
        return path
    try:
        return f"{inner}[{number_of(name, cable[1:-1], path, cable[-1])}]"
    except ValueError as error:
        raise InputError(str(error)) from None


def at_path(owner: Any, path: str) -> Any:
    """What a dotted path leads to in a record or in nested tables; None if nothing."""
    for step in path.split("."):
        owner = owner.get(step) if isinstance(owner, dict) else getattr(owner, step, None)
    return owner
