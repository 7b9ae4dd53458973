"""Where keys stand: paths through all kinds of files, their words, and JSON Schemas of some."""

import difflib
import functools
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from ringsim.cable.friction import PulleyFriction
from ringsim.cable.records import CABLES
from ringsim.cable.ropes import CableFault
from ringsim.campaign.specification import Budget, Specification, Stages
from ringsim.choice import OneOf, kinds_of
from ringsim.measured import Measured
from ringsim.overrides import place_of
from ringsim.reference.keys import Key, keys_of, kind_in, words_of
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.scene import Scene
from ringsim.units import LEFT_OUT, Model

# Where keys stand: paths through files, and what a path leads to.


ROOTS: dict[str, type[Model]] = {
    "scene": Scene, "campaign": Specification, "measured": Measured, "optimisation": Budget,
    "calibration": Stages,
}  # fmt: skip
"""What a file may be; of the last two, the keys that they have beyond those of a campaign."""
_SCHEMAS = ("scene", "campaign")
ANY = "*"
"""Stands in a path for a name of the user's choice."""
_INSIDE = {"": "", "names": f".{ANY}", "list": "[k]"}
_STEP = re.compile(r"""(?:"([^"]*)"|'([^']*)'|([\w*-]+))(?:\[[^\]]*\])?(?:\.|$)""")


@dataclass(frozen=True)
class Found:
    """A key that a path leads to, in one kind of file."""

    root: str
    path: str
    key: Key
    kinds: tuple[str, ...]
    """Kinds of tables that have it; empty where tables have no kinds."""


@functools.cache
def places(root: str) -> dict[type[Model], tuple[str, ...]]:
    """All records of a file with the paths of their tables; the file's own has the path ""."""
    found: dict[type[Model], list[str]] = {}
    for path, model in _below(ROOTS[root], ""):
        found.setdefault(model, []).append(path)
    return {model: tuple(dict.fromkeys(paths)) for model, paths in found.items()}


def _below(
    model: type[Model], path: str, above: tuple[type[Model], ...] = ()
) -> Iterator[tuple[str, type[Model]]]:
    if model in above:  # a distribution of a distribution
        return
    yield path, model
    for key in keys_of(model):
        inside = f"{path}.{key.name}".lstrip(".") + _INSIDE[key.holder]
        for each in key.models:
            yield from _below(each, inside, (*above, model))


def paths(root: str) -> list[str]:
    """Paths of all keys of a file."""
    found = (
        f"{path}.{key.name}".lstrip(".")
        for model, where in places(root).items() for path in where for key in keys_of(model)
    )  # fmt: skip
    return list(dict.fromkeys(found))


def find(path: str) -> list[Found]:
    """The keys that a path leads to, in all files; one for all kinds that have it so.

    Numbers and names in brackets are left out, a quoted step is one name, and ``*`` is any name.
    """
    steps = [next(filter(None, match.groups()), "") for match in _STEP.finditer(path)]
    alike: dict[object, Found] = {}
    for root, model in ROOTS.items():
        for where, key in _follow([model], steps, []):
            facts = (root, key.name, key.form, key.unit, key.default, key.range, key.meaning)
            kinds = alike[facts].kinds if facts in alike else ()
            own = tuple(filter(None, [kind_in(key.owner)]))
            both = tuple(dict.fromkeys(kinds + own))
            alike[facts] = Found(root, alike[facts].path if kinds else where, key, both)
    if not alike and steps and steps[-1] == "kind":  # told with the table that is of a kind
        return find(path.rpartition(".")[0])
    return list(alike.values())


def _follow(
    owners: list[type[Model]], steps: list[str], done: list[str]
) -> Iterator[tuple[str, Key]]:
    if not steps:
        return
    step, *rest = steps
    for key in (key for owner in owners for key in keys_of(owner) if step in (key.name, ANY)):
        path = [*done, key.name]
        if not rest or (key.holder == "names" and len(rest) == 1):
            yield ".".join(path), key
        else:
            named = [ANY] if key.holder == "names" else []
            yield from _follow(key.models, rest[len(named) :], [*path, *named])


def known(path: str, others: list[str]) -> list[Found]:
    """What ``find`` gives; InputError with the nearest path, or the nearest of other names."""
    if found := find(path):
        return found
    every = [one for root in ROOTS for one in paths(root)]
    plain = re.sub(r"\[[^\]]*\]", "", path)
    ends = list(dict.fromkeys(one for one in every if one.endswith(f".{plain}")))
    meant = {found.key.meaning for each in ends for found in find(each)}
    if len(meant) == 1:
        return find(ends[0])
    kind = [
        each for root in ROOTS for model, where in places(root).items() for each in where
        if "kind" in model.model_fields and model.model_fields["kind"].default == path
    ]  # fmt: skip
    if kind:
        return find(min(kind, key=len))
    # Words of meanings before words that look alike: an aperture is no temperature.  One letter is
    # in every meaning.
    near = ends[:2] or difflib.get_close_matches(plain, ROOTS, n=1, cutoff=0.7)
    near = near or (_told_of(plain)[:3] if len(plain) > 2 else [])
    near = near or difflib.get_close_matches(plain, [*others, *every], n=1, cutoff=0.6)
    near = near or [name for name in others if plain and name.startswith(plain)][:3]
    hint = (
        f"did you mean {' or '.join(near)}?" if near else
        f"ringsim explain lists the variables, ringsim explain {', '.join(ROOTS)} the keys"
    )  # fmt: skip
    raise InputError(
        f"{path or show(path)}: neither a key of a file nor a variable of a result ({hint}); a "
        "campaign's own outputs are told in its file, under [outputs]"
    )


def _told_of(word: str) -> list[str]:
    """Paths of the keys whose name or meaning has a word, meanings first."""
    keys: dict[str, list[Key]] = {}
    for root in ROOTS:
        for model, where in places(root).items():
            for path in where:
                for key in keys_of(model):
                    keys.setdefault(f"{path}.{key.name}".lstrip("."), []).append(key)
    of = [(path, key) for path, own in keys.items() for key in own]
    whole = re.compile(rf"\b{re.escape(word)}\b", re.IGNORECASE)
    meant = [path for path, key in of if whole.search(key.meaning)]
    return list(dict.fromkeys([*meant, *(path for path, key in of if word in key.name)]))


# Keys in words, as the command line tells them.


_WIDTH = 100


def facts(key: Key, path: str = "") -> str:
    """What a key takes: form, unit, range and default, in one line.

    ``path`` decides for what a list of it has values.
    """
    unit = "" if key.unit == "1" else f" in {key.unit}"
    each = f", or a list with one for each {_place(path)}" if key.each else ""
    default = "must be given" if key.required else _default(key.default)
    return "; ".join(filter(None, [f"{key.form}{unit}{each}", key.range, default]))


def told(found: Found) -> str:
    """One key with all that stands below it."""
    key, path = found.key, found.path
    kinds = f", of kind {' or '.join(found.kinds)}" if found.kinds else ""
    lines = [f"{path} ({found.root} file{kinds})", *_indented(facts(key, path), 2)]
    lines += _indented(key.meaning, 2)
    return "\n".join([*lines, *_tables(key.models, path, key.meaning)])


def all_of(root: str) -> str:
    """The keys at the top of a file."""
    model = ROOTS[root]
    return "\n".join(
        [f"{root} file", *_indented(words_of(model), 2), *_keys(keys_of(model), "", 2)]
    )


def names_of_pulleys(path: str) -> str:
    """How the values of single pulleys are named, at a path whose lists have one for each."""
    return _PULLEYS.format(path=path)


_PULLEYS = """\
{path}: one value for all pulleys, or a list with one for each from the winch on.
  A single one has a name: {path}["section 6 V"] = VALUE
  Each section has a "first hinge", a "V" and a "second hinge", seen from section 1.
  The last hinge before a cable's end holds the cable, and is no pulley.
  In a scene file: coefficient = {{ default = VALUE, "section 6 V" = VALUE }}
  Faults: pulley = "section 6 V", span = "section 6 V to second hinge" (all: span_name of a run)"""


def _tables(models: list[type[Model]], path: str, said: str) -> Iterator[str]:
    """What tables hold: what all kinds have, then what each kind has of its own, but for what is
    ``said`` already.
    """
    if not models:
        return
    shared = common(models)
    if len(models) > 1 and shared:
        yield "  all kinds:"
        yield from _keys(shared, path, 4)
    names = {key.name for key in shared} if len(models) > 1 else set()
    for model in models:
        kind = kind_in(model)
        yield f'  kind = "{kind}":' if kind else "  keys:"
        if (words := words_of(model).partition("\n\n")[0]) != said:
            yield from _indented(words, 4)
        yield from _keys([key for key in keys_of(model) if key.name not in names], path, 4)


def common(models: list[type[Model]]) -> list[Key]:
    """Keys that all kinds have, and have in the same way."""
    first, *others = ({key.name: key for key in keys_of(model)} for model in models)
    return [
        key for name, key in first.items()
        if all(name in other and facts(other[name]) == facts(key) for other in others)
        and all(other[name].meaning == key.meaning for other in others)
    ]  # fmt: skip


def _keys(keys: list[Key], path: str, indent: int) -> Iterator[str]:
    for key in keys:
        said = f"{key.name}: {facts(key, f'{path}.{key.name}'.lstrip('.'))}"
        yield from _indented(f"{said}. {key.meaning}" if key.meaning else said, indent, hang=4)


def _place(path: str) -> str:
    """What a list at a path has values for."""
    found = dict.fromkeys(place_of(path, closed=closed) for closed in (True, False))
    return " (of an open ring ".join(filter(None, found)) + ")" * (len(found) - 1)


def _default(value: str) -> str:
    """What holds where a key is not given; nothing for a table whose keys have their defaults."""
    return {LEFT_OUT: "left out by default", "": ""}.get(value, f"default {value}")


def _indented(text: str, indent: int, hang: int = 0) -> list[str]:
    """Lines of a text, wrapped; lines that are set in by themselves, such as equations, stay."""
    found: list[str] = []
    for paragraph in text.replace("``", "").split("\n\n"):
        if paragraph.startswith("    "):
            found += [" " * indent + line for line in paragraph.splitlines()]
            continue
        found += textwrap.wrap(
            " ".join(paragraph.split()), _WIDTH, initial_indent=" " * indent,
            subsequent_indent=" " * (indent + hang), break_long_words=False,
        )  # fmt: skip
    return found


# JSON Schemas of scene and campaign files, for editors.
#
# They hold what can be said of a key by itself: names, types, units, bounds, defaults, kinds and
# meanings.  What depends on several keys at once (a step below the end time) is checked by reading
# a file, as ``ringsim check`` does.


DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema_of(kind: str) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the files of a kind, "scene" or "campaign".

    InputError if there is no such kind, or if a record of the user's cannot be a choice.
    """
    if kind not in _SCHEMAS:
        raise InputError(f"--schema {kind}: must be {known_or_nearest(kind, _SCHEMAS)}")
    try:
        made = ROOTS[kind].model_json_schema(schema_generator=_Schema)
    except ValueError as error:
        raise InputError(str(error)) from None
    inputs = made["properties"].get("inputs")
    if inputs is not None:  # paths may be tables of tables: [inputs.rods] young_modulus = {...}
        one = inputs["additionalProperties"]
        nested = {"type": "object", "additionalProperties": {"$ref": "#/$defs/Inputs"}}
        made["$defs"]["Inputs"] = {"anyOf": [one, nested]}
        inputs["additionalProperties"] = {"$ref": "#/$defs/Inputs"}
        learnt = {
            "type": "object",
            "required": ["file"],
            "additionalProperties": False,
            "properties": {
                "file": {"type": "string"},
                "without": {"type": "array", "items": {"type": "string"}},
            },
        }
        inputs["properties"] = {"from": {"anyOf": [{"type": "string"}, learnt]}}
    return {"$schema": DIALECT, **made, "title": f"{kind} file of ringsim"}


class _Schema(GenerateJsonSchema):
    """What pydantic derives from the records, with families, the word "none", and docstrings."""

    def function_plain_schema(
        self, schema: core_schema.PlainValidatorFunctionSchema
    ) -> JsonSchemaValue:
        """A field that holds any kind of a family."""
        mark: OneOf = schema["metadata"]["one_of"]
        kinds = kinds_of(schema["metadata"]["family"]).items()
        return {"anyOf": [self._kind(name, model, mark) for name, model in kinds]}

    def _kind(self, name: str, model: type[Model], mark: OneOf) -> JsonSchemaValue:
        made = self.generate_inner(model.__pydantic_core_schema__)
        return made if name == mark.default else {"allOf": [made], "required": ["kind"]}

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        """A table with what its keys mean."""
        made, model = super().model_schema(schema), schema["cls"]
        if not issubclass(model, Model):
            return made
        made["description"] = words_of(model)
        properties = made.get("properties", {})
        for key in keys_of(model):
            one = properties[key.name]
            one["description"] = "\n".join(filter(None, [key.meaning, facts(key)]))
            for other in _in_words(key):
                one = properties[key.name] = _either(one, other)
            if key.attribute in model.parts():
                properties[key.name] = _either(one, {"const": LEFT_OUT})
        return made


def _in_words(key: Key) -> list[JsonSchemaValue]:
    """What a key of places on cables may also be: their names; see ``ringsim.cable.records``."""
    if issubclass(key.owner, PulleyFriction) and key.name == "coefficient":
        numbers = {"type": "object", "additionalProperties": {"type": "number"}}
        return [numbers | {"required": ["default"]}]
    if key.takes_a_name:
        return [{"type": "string"}]
    if issubclass(key.owner, CableFault) and key.name == "cable":
        return [{"enum": list(CABLES)}]
    return []


def _either(one: JsonSchemaValue, other: JsonSchemaValue) -> JsonSchemaValue:
    """A value of one kind or the other; what is said of the key stays beside both."""
    said: JsonSchemaValue = {}
    for word in ("title", "description", "default"):
        said |= {word: one.pop(word)} if word in one else {}
    return {"anyOf": [one, other], **said}
