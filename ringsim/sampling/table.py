"""The design of a campaign: which values every sample has, and which paths it may vary."""

import contextlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ringsim.choice import OneOf, kind_of
from ringsim.files import require_regular
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.overrides import field_at, place_of, pulleys_at, section_of, with_number
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.sampling.columns import BLOCK_ROW, Column, Correlation, Table
from ringsim.sampling.designs import Design
from ringsim.sampling.designs.blocks import Grouped
from ringsim.sampling.distributions import Distribution, Values, extremes_of, is_label, plain
from ringsim.scene import Scene
from ringsim.tables import unit_text
from ringsim.units import ListIn, Model, unit_at

AnyDistribution = Annotated[Distribution, OneOf()]
AnyDesign = Annotated[Design, OneOf()]

FIXED = (
    "name", "title", "structure.kind", "structure.sections", "structure.closed", "solver.end_time",
    "record",
)  # fmt: skip
"""Paths that give a result its shape or its name: all samples of a campaign share them."""
_NAMED_ALREADY = ("sample", "sample_seed", "reason", "log", "corner", "pulley")
"""What files of campaigns hold beside inputs and outputs."""


def draw(
    base: Scene, inputs: Mapping[str, Distribution], correlations: Sequence[Correlation],
    design: Design, *, seed: int, folder: Path, error_bars_every: int = 0,
) -> Table:  # fmt: skip
    """Draw all samples of a campaign, which vary the scene ``base``.

    Files that the design names are looked up in ``folder``; one sample in ``error_bars_every``
    states its error bars, none for 0.  InputError if the scene refuses a path or its values.
    """
    factors: dict[str, Distribution] = {}
    written: dict[str, str] = {}
    followers = {name: law for name, law in inputs.items() if law.follows}
    inputs = {name: law for name, law in inputs.items() if not law.follows}
    free = {n for n in (law.follows for law in followers.values()) if n in inputs}
    free = {n for n in free if is_label(n) or ("." not in n and _is_number(inputs[n]))}
    for name, law in followers.items():
        if law.follows not in inputs:
            hint = known_or_nearest(law.follows, inputs)
            raise InputError(f"inputs: {name} follows {law.follows}, which is not drawn ({hint})")
        refuse_fixed(base, name)
        _refuse_unit(base, name, law)
    for name, distribution in inputs.items():
        if name in free and not distribution.shared:  # no field of a scene takes it
            if distribution.each_section:
                raise InputError(
                    f"inputs: {name} has no path, so that nothing tells how many values "
                    "each_section gives it: leave it out"
                )
            factors[name] = distribution
            continue
        _refuse_unit(base, name, distribution)
        places = _places(base, name, distribution)
        for path in _paths_of(name, distribution):
            own = {with_number(base, f"{path}{place}") for place in places}
            if twice := own & written.keys():
                raise InputError(
                    f"inputs: {min(twice)} is drawn twice, by {written[min(twice)]} and by {name}: "
                    "leave out one of them"
                )
            written |= dict.fromkeys(own, name)
        factors |= {f"{name}{place}": distribution for place in places}
    drawn = design.table(factors, correlations, seed=seed, folder=folder)
    samples = len(next(iter(drawn.values()))) if drawn else getattr(design, "samples", 1)
    columns: list[Column] = []
    for name, distribution in inputs.items():
        if distribution.each_section:
            values = np.stack([drawn[p] for p in drawn if p.startswith(f"{name}[")], axis=1)
        else:
            values = drawn[name]
        words = distribution.model_dump_json(exclude_none=True)
        if name in free:
            plain_name = re.sub(r"\W+", "_", name).strip("_")
            unit = distribution.unit or ""
            if distribution.shared:
                unit = unit_at(base, distribution.shared[0])
            columns.append(Column(plain_name, "", "", unit, words, values, input=name))
        if name in free and not distribution.shared:
            continue
        paths = _paths_of(name, distribution)
        columns += [
            replace(_column(base, path, values, words, design), input=name) for path in paths
        ]
    for name, follower in followers.items():
        source = next(each for each in columns if each.input == follower.follows)
        values = follower.values_at(name, source.values)
        words = follower.model_dump_json(exclude_none=True)
        column = _column(base, name, values, words, design)
        columns.append(replace(column, input=follower.follows))
    for name in () if inputs else drawn:
        if not is_label(name):
            refuse_fixed(base, name)
        columns.append(_column(base, name, drawn[name], "listed in a file", design))
    if isinstance(design, Grouped):
        rows, words = np.array(design.rows(factors, seed)), f"row of a {kind_of(design)} block"
        columns.append(Column(BLOCK_ROW, "", "", "1", words, rows))
    if every := error_bars_every:
        path = "solver.error_bars"
        if any(column.path == path for column in columns):
            raise InputError(f"error_bars_every = {every}: {path} is an input, too: leave out one")
        chosen = np.arange(samples) % every == 0
        columns.append(Column("solver_error_bars", path, "", "1", f"one sample in {every}", chosen))
    # From the campaign's seed and the sample's index alone, so that a design can grow.
    sequences = (np.random.SeedSequence(seed, spawn_key=(k,)) for k in range(samples))
    states = [int(each.generate_state(1, np.uint64)[0]) >> 1 for each in sequences]
    table = Table(tuple(columns), np.array(states, dtype=np.int64))
    taken, before = {*VARIABLES, *COORDINATES, *_NAMED_ALREADY}, list[str]()
    for column in columns:
        if column.name in taken:
            where = column.path or column.input or f"label {column.name}"
            raise InputError(f"inputs: {where} would have the name {column.name}, which is in use")
        if lost := first_inside(column.path, before):
            raise InputError(
                f"inputs: {column.path} would overwrite {lost}: put it before that input"
            )
        taken.add(column.name)
        before.append(column.path)
    _check_extremes(base, table, design)
    return table


def _refuse_unit(base: Scene, name: str, law: Distribution) -> None:
    if law.unit is not None:
        own = unit_at(base, _paths_of(name, law)[0])
        raise InputError(
            f"inputs: {name}.unit = {show(law.unit)}: the scene says the unit of its paths "
            f"({unit_text(own) or 'none'}): leave it out"
        )


def _is_number(law: Distribution) -> bool:
    """Whether numbers are drawn: no part of a scene is one, so that ``temperature`` may be."""
    return law.quantile(np.array([0.5])).dtype.kind in "iuf"


def _paths_of(name: str, distribution: Distribution) -> tuple[str, ...]:
    """The scene paths that take what is drawn for an input."""
    shared = distribution.shared
    if shared and (("." in name and name not in shared) or len(set(shared)) < len(shared)):
        raise InputError(
            f'inputs."{name}".shared = {show(shared)} must list each path once, also that of the '
            "input, or the input must have a name without dots"
        )
    return shared or (name,)


def _places(base: Scene, name: str, distribution: Distribution) -> list[str]:
    """What follows the paths of an input, one factor each: "", or "[1]", "[2]", ..."""
    middle = plain(distribution.quantile(np.array([0.5]))[0])
    for path in (paths := _paths_of(name, distribution)):
        refuse_fixed(base, path)
    try:
        if not distribution.each_section:
            base.with_values(dict.fromkeys(paths, middle))
            return [""]
        counts = {path: _each_of(base, path, middle) for path in paths}
    except InputError as error:
        if "." not in name and f"{name} is not a known key" in str(error):
            raise InputError(
                f"inputs: {error}; a name of one's own takes shared = [PATH, ...], or an input of "
                'kind = "function" that follows it'
            ) from None
        # A value that nobody has written; a path that is none is at fault with any.
        at_fault = "is not a known key", "there is no value", "leave out each_section"
        if isinstance(middle, float) and not any(words in str(error) for words in at_fault):
            told = f"inputs: {name}: {show(middle)} is among what is drawn for it"
            raise InputError(f"{told}, and {error}") from None
        raise InputError(f"inputs: {error}") from None
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{path} has {count}" for path, count in counts.items())
        raise InputError(
            f"inputs: {name} gives one value for each section, but its lists differ in length: "
            f"{told}: leave out each_section, or give each path an input of its own"
        )
    return [f"[{k + 1}]" for k in range(min(counts.values()))]


def with_own_places(base: Scene, inputs: Mapping[str, Distribution]) -> dict[str, Distribution]:
    """Inputs, where places of one with ``each_section`` have distributions of their own, too.

    Such an input becomes one for each place, in their order, so that correlations between places
    of two inputs stay.  InputError as ``draw`` raises it.
    """
    by_place = dict[str, dict[str, Distribution]]()
    for name, law in inputs.items():
        alone = {with_number(base, p): p for p in inputs if p.startswith(f"{name}[")}
        if not (law.each_section and alone) or law.shared or law.follows:
            continue
        every = [f"{name}{place}" for place in _places(base, name, law)]
        if alone.keys() & {*every}:
            bare = law.model_copy(update={"each_section": False})
            called = [f'{name}["{each}"]' for each in pulleys_at(base, name)] or every
            own = [alone.get(p, word) for p, word in zip(every, called, strict=True)]
            by_place[name] = {path: inputs.get(path, bare) for path in own}
    for name, law in inputs.items():
        if law.follows in by_place:
            place_ = next(path for path in by_place[law.follows] if path in inputs)
            raise InputError(
                f"inputs: {name} follows {law.follows}, of which {place_} has a distribution of "
                f"its own: let {name} follow one place, or leave out {place_}"
            )
    moved = {path for places in by_place.values() for path in places}
    found = dict[str, Distribution]()
    for name, law in inputs.items():
        if name not in moved:
            found |= by_place.get(name, {name: law})
    return found


class Learnt(Model):
    """Inputs that a campaign file takes from the result of a calibration."""

    file: str
    """The posterior.nc, looked up beside the campaign file."""
    without: Annotated[tuple[str, ...], ListIn] = ()
    """Unknowns of it that are left out: those of the test stand alone."""


def learnt_from(
    file: Path, without: Sequence[str] = ()
) -> tuple[dict[str, Any], list[dict[str, Any]], dict[str, Any]]:
    """The inputs and correlations, as tables of a campaign file, that a calibration has found, and
    the clock of its test by the test's name, offset and drift before and after.

    An input with a value for each place is one for each, as no two have learnt the same.
    InputError if the file has none.
    """
    import netCDF4

    if not file.exists():
        raise InputError(
            f"inputs.from: there is no file {file}: run the calibration first that makes it "
            "(ringsim calibrate), or correct the name"
        )
    require_regular(file)
    try:
        with netCDF4.Dataset(file) as data:
            words = {n: getattr(data, n, "") for n in ("inputs", "correlations", "clocks")}
    except OSError as error:
        raise InputError(f"inputs.from: {file.name} cannot be read: {error}") from None
    if not words["correlations"]:
        raise InputError(
            f"inputs.from: {file.name} has no posterior: give the posterior.nc of ringsim calibrate"
        )
    inputs, pairs = json.loads(words["inputs"]), json.loads(words["correlations"])
    for name in without:
        if name not in inputs:
            raise InputError(
                f"inputs.from.without: {name} is no unknown of {file.name} "
                f"({known_or_nearest(name, inputs)})"
            )
    left = {name: law for name, law in inputs.items() if name not in without}
    pairs = [pair for pair in pairs if all(name in left for name in pair["between"])]
    return left, pairs, json.loads(words["clocks"] or "{}")


def first_inside(path: str, others: Iterable[str]) -> str:
    """The first path that leads into what ``path`` holds; empty if none does."""
    return next((other for other in others if other.startswith((f"{path}.", f"{path}["))), "")


def refuse_fixed(scene: Scene, path: str) -> None:
    """Refuse (InputError) a path whose value all samples of a campaign must share."""
    for fixed in (*FIXED, *scene.structure.shaping):
        if fixed.startswith(f"{path}."):
            raise InputError(
                f"inputs: {path} cannot be drawn as a whole, because {fixed} in it changes the "
                f"size of the result: draw its values one by one, as {path}.NAME"
            )
        if path == fixed or path.startswith((f"{fixed}.", f"{fixed}[")):
            raise InputError(
                f"inputs: {path} must be the same for all samples, because it changes the size "
                "of the result: give it under [set], and run a campaign for each value"
            )


def _each_of(base: Scene, path: str, value: Any) -> int:
    """How many values the list at a path has; InputError if it is one value for all sections."""
    if section_of(path)[1] is not None:
        raise InputError(f"inputs: {path} is one section already: leave out each_section")
    scene = base.with_values({path: value})
    try:
        return len(field_at(scene.with_values({f"{path}[1]": value}), path))
    except InputError:
        told = f"inputs: {path} is one value for all sections: leave out each_section"
        raise InputError(told) from None


def _column(base: Scene, path: str, values: Values, words: str, design: Design) -> Column:
    name = re.sub(r"\W+", "_", path).strip("_")
    if is_label(path):
        if values.dtype.kind != "U" or not name:
            raise InputError(
                f"design.file: column {path} is no scene path, and no label, because it holds no "
                f"text: name a path ({known_or_nearest(path, Scene.model_fields)}), or write words "
                f"like {path}-1"
            )
        return Column(name, "", "", "1", words, values)
    try:
        scene = base.with_values({path: plain(values[0])})
    except InputError as error:
        raise InputError(f"{design.where(0, path)}: {_named(base, [path], error)}") from None
    dim, names = "", tuple[str, ...]()
    if values.ndim == 2:
        dim = place_of(path, closed=scene.structure.closed) or f"place_{values.shape[1]}"
        names = pulleys_at(scene, path)
        if names and field_at(scene, path.partition(".friction")[0]).end == "both":
            dim = "pulley_of_two_winches"
    if values.dtype.kind in "iu" and isinstance(field_at(scene, path), float):
        values = values.astype(float)
    return Column(name, path, dim, unit_at(scene, path), words, values, names)


def _named(base: Scene, paths: Sequence[str], error: InputError) -> str:
    """What an error says, with the paths that name a pulley instead of its number.

    Unless samples have their winches at other ends: numbers count from there.
    """
    told = str(error)
    for path in paths if not any(path.endswith(".end") for path in paths) else ():
        with contextlib.suppress(InputError):
            told = told.replace(with_number(base, path), path)
    return told


def _from_table(table: Table, path: str, sample: int) -> str:
    """Where a value comes from that follows another input: from a table, and for which value."""
    for column in table.columns:
        if column.path == path and '"kind":"function"' in column.origin:
            leaders = (
                c for c in table.columns if not c.dim and '"kind":"function"' not in c.origin
            )
            lead = next((c for c in leaders if (c.input or c.path) == column.input), None)
            at = "" if lead is None else f" = {show(plain(lead.values[sample]))} {lead.units}"
            return f" (by its table for {column.input}{at.removesuffix(' 1')})"
    return ""


def _check_extremes(base: Scene, table: Table, design: Design) -> None:
    """Build scenes with the least and the greatest value, and each word, of every input."""
    spans: set[int] = set()
    suspects: set[int] = {0}
    for column in table.columns:
        suspects |= extremes_of(column.values) if column.path else set()
    for sample in sorted(suspects):
        values = table.values_of(sample)
        try:
            spans.add(base.with_values(values).spans)
        except InputError as error:
            told = _named(base, list(values), error)
            path = max((path for path in values if path in told), key=len, default="")
            told += _from_table(table, path, sample)
            raise InputError(f"{design.where(sample, path)}: {told}; {design.cure}") from None
    if len(spans) > 1:
        raise InputError(
            f"inputs: cables of {min(spans)} and of {max(spans)} spans cannot be in one result "
            '(end = "both" has one span more): draw only from "first" and "last", or run a '
            "campaign for each"
        )
