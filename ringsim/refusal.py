"""Refusing bad input: one clear line, naming field, value, bound and cure; and how commands end."""

import difflib
import math
import re
import typing
from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ringsim.choice import leaves_of
from ringsim.units import EACH, LEFT_OUT, ONE, Model, in_unit, nested_in, unit_of

EXIT_DONE = 0
EXIT_BAD_INPUT = 2
EXIT_FAILED = 3
"""The simulation failed, or too many samples of a campaign did."""
EXIT_NOT_MET = 4
"""A requirement is not met, or not yet shown to be (``analyse --gate``)."""
EXIT_INTERRUPTED = 130
"""Stopped by a signal, or samples are left: the same command goes on (128 + SIGINT)."""

MOST_NAMED = 3
"""So many further faults are named beside the one that is described."""
_MISSPELT = 0.85
"""Likeness above which a name is one of its own table with a letter wrong, and not one of a table
below: load and loads have 0.89.
"""
_MOST_KNOWN = 30
"""Names that a hint lists: more than a table of a scene or campaign has keys."""
DEEPEST = 100
"""Levels of lists and tables: what a scene or a campaign holds has ten."""
_DRAWN = 12
"""Characters of a number above which nobody has written it."""
LONGEST_VALUE = 60
"""Characters of a refused value that are shown."""


class InputError(ValueError):
    """Input that is refused; its text is one line meant for the user."""

    def __init__(self, text: str) -> None:
        line = " ".join(text.split())
        super().__init__("".join(c if c.isprintable() else ascii(c)[1:-1] for c in line))


class NotBuiltError(RuntimeError):
    """The core has not been compiled where this package lies, or of other sources: no input is
    wrong, and no other engine may take its place unasked.
    """


_SAYS = {
    "missing": "{where} is missing: give it a value{in_unit}",
    "greater_than": "{shown} must be above {gt:g}{unit}",
    "greater_than_equal": "{shown} must be at least {ge:g}{unit}",
    "less_than": "{shown} must be below {lt:g}{unit}",
    "less_than_equal": "{shown} must be at most {le:g}{unit}",
    "int": "{shown} must be a whole number, without quotes or decimal point",
    "float": "{shown} must be a finite number{in_unit}, without quotes",
    "finite_number": "{shown} must be a finite number{in_unit}, without quotes",
    "bool": "{shown} must be true or false, without quotes",
    "string": '{shown} must be text in quotes, for example {key} = "a-word"',
    "string_pattern_mismatch": "{shown} must start with a letter or digit and hold only letters, "
    "digits, dots, dashes and underscores",
    "string_too_long": "{shown} must have at most {max_length} characters",
    "literal_error": "{shown} must be {expected}",
    "too_short": "{where} must have {min_length} or more entries",
    "too_long": "{where} must have {max_length} entries at most",
    "model": "{shown} must be a table: write {where} = {{ {keys} }}",
    "dict": "{shown} must be a table: write {where} = {{ {keys} }}",
    "tuple": "{shown} must be one value, or a list with a value for each section",
}
"""What is wrong with a value, by pydantic's word for the fault, or the type that it begins with."""


def explain(error: ValidationError, model: type[BaseModel], source: str) -> str:
    """One line that begins with ``source``: the first fault in full, then where the others are."""
    faults = error.errors(include_url=False)
    # A key that is none first: it may be the one that is missing, misspelt.
    faults.sort(key=lambda fault: fault["type"] != "extra_forbidden")
    line = f"{source}: {_describe(faults[0], model)}"
    groups: dict[str, list[str]] = {"also missing": [], "also at fault": []}
    # What asks for a name that is refused is not at fault itself, as a requirement on an output.
    cause = re.match(r"Value error, (\w+)[:. ]", faults[0]["msg"])
    for fault in faults[1:]:
        if cause and fault["msg"].startswith(f"Value error, {cause[1]} is not "):
            continue
        # Of outputs of one's own none is known where one is refused.
        if faults[0]["loc"][:1] == ("outputs",) and re.match(
            r"Value error, \w+ is not ", fault["msg"]
        ):
            continue
        place, absent = _place(fault, model), fault["type"] == "missing"
        meant = line.endswith(f"(did you mean {place.rpartition('.')[2]}?)")
        own = groups["also missing" if absent else "also at fault"]
        own += [place] * (place not in own and not (absent and meant))
    for words, others in groups.items():
        more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
        line += f"; {words}: {', '.join(others[:MOST_NAMED])}{more}" if others else ""
    return line


def known_or_nearest(key: str, known: Iterable[str]) -> str:
    """The hint behind a refused name: the nearest known one, one that begins so, or all of them.

    >>> known_or_nearest("densty", ["density", "damping"])
    'did you mean density?'
    >>> known_or_nearest("cut", ["cut-cable", "jammed-pulley"])
    'did you mean cut-cable?'
    """
    names = list(known)
    if not names:
        return "it has no keys"
    close = difflib.get_close_matches(key.lower(), names, n=3, cutoff=0.6)
    # Of several that begin alike the shortest: what it is, before its time or its angle.
    close = sorted((name for name in close if close[0].startswith(name)), key=len)
    close += [name for name in names if key and name.startswith(key.lower())]
    if close:
        return f"did you mean {close[0]}?"
    more = f" and {len(names) - _MOST_KNOWN} more" if len(names) > _MOST_KNOWN + 5 else ""
    return f"known: {', '.join(names[:_MOST_KNOWN] if more else names)}{more}"


def show(value: Any, most: int = LONGEST_VALUE) -> str:
    """A value as TOML would write it, shortened to so many characters."""
    return shorten(_toml(value), most)


def _few_digits(value: Any) -> Any:
    """A value; of a number that was drawn or computed no more digits than people compare."""
    if isinstance(value, float) and len(str(value)) > _DRAWN:
        return float(f"{value:.8g}")
    return value


def shorten(text: str, most: int = LONGEST_VALUE) -> str:
    """A text on one line, and cut where it is longer than a reader wants of a refused value; a list
    behind one of its values.
    """
    text = " ".join(text.split())
    if len(text) <= most:
        return text
    cut = text[: most - 3]
    whole = cut.rpartition(", ")[0] if cut.startswith(("[", "{")) else ""
    return f"{whole}, ..." if whole else f"{cut}..."


def _place(fault: Any, model: type[BaseModel]) -> str:
    path = _walk(fault["loc"], model)[0]
    if path:
        return ".".join(path)
    return str(fault.get("ctx", {}).get("error", fault["msg"])).split(" ", 1)[0]


def _describe(fault: Any, model: type[BaseModel]) -> str:
    path, owner, field = _walk(fault["loc"], model)
    where, key = ".".join(path), path[-1] if path else ""
    kind, value, limits = fault["type"], fault["input"], fault.get("ctx", {})
    symbol = unit_of(field, path[-2] if len(path) > 1 else "") if field is not None else "1"
    unit = f" {symbol}".removesuffix(" 1")
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    shown = f"{where} = {show(_few_digits(value))}{unit if number else ''}"
    tables = [] if field is None else models_in(field.annotation)
    kinds = _kinds(field)
    match kind:
        case "extra_forbidden":
            # A model may tell of keys that it once had, or that people look for.
            hint = getattr(owner, "gone", {}).get(key) or _other_kinds_key(path, owner)
            keys = owner.model_fields if owner else {}
            # A key that is a word of Python has another name in the model.
            known = [each.alias or name for name, each in keys.items()]
            misspelt = difflib.get_close_matches(key.lower(), known, n=1, cutoff=_MISSPELT)
            below = [] if owner is None or misspelt else list(_below(key, owner))
            if not hint and below:
                hint = f"did you mean {' or '.join(below[:MOST_NAMED])}?"
            hint = hint or known_or_nearest(key, known)
            return f"{where} is not a known key ({hint})"
        case "union_tag_invalid":
            given = value.get("kind") if isinstance(value, dict) else limits["tag"]
            hint = known_or_nearest(str(given), _kinds(field))
            return f"{where}.kind = {show(given)} is not an available kind ({hint})"
        case "union_tag_not_found":
            choices = " or ".join(map(show, _kinds(field)))
            return f"{where}.kind is missing: say which kind it is with kind = {choices}"
        case "missing" if tables:
            required = [name for name, each in tables[0].model_fields.items() if each.is_required()]
            one_of = f" with {' and '.join(required)}" * bool(required)
            one_of = f" with its kind, one of {', '.join(kinds)}" if kinds else one_of
            return f"{where} is missing: give it a table{one_of}"
        case "model_type" | "model_attributes_type" if kinds:
            choices = " or ".join(map(show, [value] if value in kinds else kinds))
            none = f', or {where} = "{LEFT_OUT}" to leave it out' if value is False else ""
            return f"{shown} must be a table: write [{where}], and below it kind = {choices}{none}"
        case "tuple_type" if size := _components(field):
            return f"{shown} must be a list of {size} numbers{f' in{unit}' if unit else ''}"
        case "tuple_type" if tables:
            return f"{shown} must be a list of tables: write [[{where}]], and its keys below"
        case "tuple_type" if field and typing.get_origin(field.annotation) is tuple:
            return f"{shown} must be a list: {where} = [..., ...]"
        case "value_error":
            text = str(limits["error"])
            return f"{where}.{text}" if where and not text.startswith(where) else text
    if (says := _SAYS.get(kind) or _SAYS.get(kind.split("_")[0])) is None:
        return f"{shown}: {fault['msg'][0].lower()}{fault['msg'][1:]}"
    in_unit = f" in{unit}" if unit else ""
    line = says.format(
        shown=shown, where=where, key=key, unit=unit, in_unit=in_unit,
        keys=_keys_of(tables[0]) if tables else "...", **limits,
    )  # fmt: skip
    if unit == " K" and number and -272.15 <= value <= 0.0:
        return f"{line}; {value:g} C are {value + 273.15:g} K"
    if unit == " m" and number and value > limits.get("le", math.inf):
        return f"{line}; {value:g} mm are {1e-3 * value:g} m"
    if unit == " Pa" and number and 0.0 < value < limits.get("ge", 0.0):
        return f"{line}; {value:g} GPa are {1e9 * value:g} Pa"
    share = number and 1.0 < value <= 100.0 and limits.get("lt", limits.get("le")) == 1.0
    if share and float(f"{value:.3g}") == value:  # nobody writes 1.0827989 per cent
        return f"{line}; {value:g} % are {value / 100.0:g}"
    if not isinstance(value, str):
        return line
    if meant := _meant(value, kind, symbol):
        return f"{line}: write {meant}"
    optional = field is not None and type(None) in typing.get_args(field.annotation)
    # Who writes "never" looks for the word that leaves a value out.
    return f'{line}, or "none" to leave it out' if optional else line


def _keys_of(table: type[BaseModel]) -> str:
    """The keys of a table that need a value, or its first one, as TOML is to have them; those that
    a record calls usual.
    """
    fields = table.model_fields
    names = [n for n, field in fields.items() if field.is_required()] or [*fields][:1]
    needed = {name: fields[name] for name in getattr(table, "usual", names)}
    return ", ".join(
        f"{field.alias or name} = [{', '.join(['...'] * size)}]" if (size := _components(field))
        else f"{field.alias or name} = ..."
        for name, field in needed.items()
    )  # fmt: skip


def _components(field: FieldInfo | None) -> int:
    """How many values a vector has; 0 of all other fields."""
    kinds = [] if field is None else [field.annotation, *typing.get_args(field.annotation)]
    inner = [typing.get_args(each) for each in kinds if typing.get_origin(each) is tuple]
    return next((len(each) for each in inner if Ellipsis not in each), 0)


def _meant(text: str, kind: str, wanted: str) -> str:
    """What a text may mean where a number of a unit or a truth is wanted; empty if nobody can tell.

    >>> _meant("100MPa", "float_type", "Pa"), _meant("2 knots", "float_type", "m/s")
    ('1e+08', 'the number alone')
    >>> _meant("60 C", "float_type", "K"), _meant(".5", "float_type", "m")
    ('333.15', '0.5')
    """
    if kind.startswith("bool"):
        return {"true": "true", "yes": "true", "false": "false", "no": "false"}.get(
            text.lower(), ""
        )
    number = re.match(r"[-+]?(\d+([.,]\d+)?|[.,]\d+)(e[-+]?\d+)?", text.strip(), re.IGNORECASE)
    if not number or not kind.startswith("float"):
        return ""
    alone, behind = number[0].replace(",", "."), text.strip()[number.end() :].strip()
    alone = re.sub(r"^([-+]?)\.", r"\g<1>0.", alone)  # TOML has no .5
    behind = re.sub("degrees?|\u00b0$", "deg", behind)
    if not behind or behind == wanted:
        return alone
    value = in_unit(float(alone), behind, wanted)
    if wanted == "K" and behind.lower().removeprefix("deg").strip() in ("c", "celsius"):
        value = float(alone) + 273.15
    return "the number alone" if value is None else f"{value:.6g}"


def _below(key: str, owner: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Where a key stands in the tables below one that does not have it itself."""
    for name, field in owner.model_fields.items():
        inside = models_in(field.annotation)
        if any(key in table.model_fields for table in inside):
            yield f"{prefix}{name}.{key}"
        for table in inside[:1]:
            yield from _below(key, table, f"{prefix}{name}.")


def _other_kinds_key(path: list[str], owner: type[BaseModel] | None) -> str:
    """The hint behind a key that another kind of the same family has; empty if none has it.

    It stays behind when ``kind`` alone is replaced.
    """
    families = [] if owner is None else [one for one in owner.__mro__[1:] if issubclass(one, Model)]
    others = (kind for one in families if one is not Model for kind in leaves_of(one))
    other = next((kind for kind in others if path[-1] in kind.model_fields), None)
    if owner is None or other is None:
        return ""
    mine, table = show(_tag(owner)), ".".join(path[:-1])
    own = [name for name in owner.model_fields if name != "kind"]
    # Such a kind may say the same by another key, as "cable" for "plane".
    keys = f"; {mine} has {', '.join(own)}" * (0 < len(own) <= _FEW_KEYS)
    return (
        f"kind = {show(_tag(other))} has it, {mine} has not: leave it out, or replace the whole "
        f"table by {table} = {{ kind = {mine} }}{keys}"
    )


_FEW_KEYS = 6
"""Keys of a kind that are all named in a line."""


def _walk(
    loc: tuple[int | str, ...], model: type[BaseModel]
) -> tuple[list[str], type[BaseModel] | None, FieldInfo | None]:
    """Follow a location through the models; leaves out the tags of unions."""
    path: list[str] = []
    owner: type[BaseModel] | None = model
    field: FieldInfo | None = None
    inside: list[type[BaseModel]] = [model]
    for step in loc:
        tagged = [m for m in inside if _tag(m) == step]
        if tagged and path and len(inside) > 1:
            inside, owner = tagged, tagged[0]
        elif named := [m for m in inside if step in m.model_fields]:
            owner, field = named[0], named[0].model_fields[str(step)]
            inside = models_in(field.annotation)
            path.append(str(step))
        elif isinstance(step, int):
            path[-1:] = [f"{path[-1] if path else ''}[{step + 1}]"]
        elif step not in (ONE, EACH):
            owner = inside[0] if inside else None
            field = field if field and typing.get_origin(field.annotation) is dict else None
            path.append(step)
    return path, owner, field


def _kinds(field: FieldInfo | None) -> list[str]:
    models = models_in(field.annotation) if field is not None else []
    return [str(kind) for kind in map(_tag, models) if kind is not None]


def _tag(model: type[BaseModel]) -> Any:
    return model.model_fields["kind"].default if "kind" in model.model_fields else None


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """The records that a field may hold, every kind of a family."""
    types = (part for part in nested_in(annotation) if isinstance(part, type))
    return [kind for each in types if issubclass(each, Model) for kind in leaves_of(each)]


def _toml(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return f'"{value}"'
        case int() if abs(value) > 10**30:
            return f"{'-' if value < 0 else ''}an integer of {value.bit_length()} bits"
        case dict():
            return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(_toml(each) for each in value) + "]"
        case _:
            return str(value)
