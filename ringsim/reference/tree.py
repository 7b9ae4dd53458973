"""Where keys stand: paths through scenes and campaigns, and what a path leads to."""

import difflib
import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass

from ringsim.campaign.specification import Specification
from ringsim.reference.keys import Key, keys_of, kind_in
from ringsim.refusal import InputError, known_or_nearest
from ringsim.scene import Scene
from ringsim.units import Model

ROOTS: dict[str, type[Model]] = {"scene": Scene, "campaign": Specification}
"""What a file may be."""
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
    """The keys that a path leads to, in scenes and in campaigns; one for all kinds that have it so.

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
    ends = [one for one in every if one.endswith(f".{plain}")][:2]
    near = ends or difflib.get_close_matches(plain, [*others, *every], n=1, cutoff=0.6)
    hint = (
        f"did you mean {' or '.join(near)}?" if near else known_or_nearest(plain, [*ROOTS, *others])
    )
    raise InputError(
        f"{path}: no key of a scene or a campaign, and no variable of a result ({hint})"
    )
