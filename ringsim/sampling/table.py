"""The design of a campaign: which values every sample has, and which paths it may vary."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ringsim.choice import OneOf
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.overrides import field_at, place_of, pulleys_at, section_of, with_number
from ringsim.refusal import InputError
from ringsim.sampling.columns import Column, Table
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Design
from ringsim.sampling.distributions.family import Distribution, Values
from ringsim.scene import Scene
from ringsim.units import unit_at

AnyDistribution = Annotated[Distribution, OneOf()]
AnyDesign = Annotated[Design, OneOf()]

FIXED = (
    "name", "title", "structure.kind", "structure.sections", "structure.closed", "solver.end_time",
    "record",
)  # fmt: skip
"""Paths that give a result its shape or its name: all samples of a campaign share them."""


def draw(
    base: Scene,
    inputs: Mapping[str, Distribution],
    correlations: Sequence[Correlation],
    design: Design,
    *,
    seed: int,
    folder: Path,
    error_bars_every: int = 0,
) -> Table:
    """Draw all samples of a campaign, which vary the scene ``base``.

    Files that the design names are looked up in ``folder``; one sample in ``error_bars_every``
    states its error bars, none for 0.  InputError if the scene refuses a path or its values.
    """
    factors: dict[str, Distribution] = {}
    for path, distribution in inputs.items():
        refuse_fixed(base, path)
        middle = distribution.quantile(np.array([0.5]))[0].item()
        if distribution.each_section:
            own = [f"{path}[{k + 1}]" for k in range(_each_of(base, path, middle))]
        else:
            base.with_values({path: middle})
            own = [path]
        drawn_already = {with_number(base, each) for each in factors}
        for each in own:
            if with_number(base, each) in drawn_already:
                raise InputError(f"inputs: {each} is drawn twice: leave out one of its inputs")
            factors[each] = distribution
    drawn = design.table(factors, correlations, seed=seed, folder=folder)
    samples = len(next(iter(drawn.values()))) if drawn else getattr(design, "samples", 1)
    columns: list[Column] = []
    taken = {*VARIABLES, *COORDINATES}
    for path in inputs or drawn:
        refuse_fixed(base, path)
        grouped = path in inputs and inputs[path].each_section
        names = [p for p in drawn if p.startswith(f"{path}[")] if grouped else [path]
        values = np.stack([drawn[p] for p in names], axis=1) if grouped else drawn[path]
        column = _column(base, path, values, inputs.get(path))
        if column.name in taken:
            raise InputError(f"inputs: {path} would be named {column.name}, which is taken")
        taken.add(column.name)
        columns.append(column)
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
    _check_extremes(base, table)
    return table


def refuse_fixed(scene: Scene, path: str) -> None:
    """Refuse (InputError) a path whose value all samples of a campaign must share."""
    for fixed in (*FIXED, *scene.structure.shaping):
        if path == fixed or path.startswith((f"{fixed}.", f"{fixed}[")):
            raise InputError(
                f"inputs: {path} must be the same for all samples, because it shapes the result: "
                "give it under [set], and run a campaign for each value"
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


def _column(base: Scene, path: str, values: Values, origin: Distribution | None) -> Column:
    scene = base.with_values({path: values[0].tolist()})
    dim, places = "", tuple[str, ...]()
    if values.ndim == 2:
        dim = place_of(path, closed=scene.structure.closed) or f"place_{values.shape[1]}"
        places = pulleys_at(scene, path)
        if places and field_at(scene, path.partition(".friction")[0]).end == "both":
            dim = "pulley_of_two_winches"
    name = re.sub(r"\W+", "_", path).strip("_")
    words = "listed in a file" if origin is None else origin.model_dump_json(exclude_none=True)
    if values.dtype.kind in "iu" and isinstance(field_at(scene, path), float):
        values = values.astype(float)
    return Column(name, path, dim, unit_at(scene, path), words, values, places)


def _check_extremes(base: Scene, table: Table) -> None:
    """Build scenes with the least and the greatest value, and each word, of every input."""
    spans: set[int] = set()
    suspects: set[int] = {0}
    for column in table.columns:
        flat = column.values.reshape(table.samples, -1)
        if flat.dtype.kind in "iuf":
            suspects |= {int(flat.min(axis=1).argmin()), int(flat.max(axis=1).argmax())}
        else:
            suspects |= {int(k) for k in np.unique(flat[:, 0], return_index=True)[1]}
    for sample in sorted(suspects):
        try:
            spans.add(base.with_values(table.values_of(sample)).spans)
        except InputError as error:
            raise InputError(f"sample {sample}: {error}; change or truncate the inputs") from None
    if len(spans) > 1:
        raise InputError(
            f"inputs: cables of {min(spans)} and of {max(spans)} spans would not fit into one "
            'result, and end = "both" has a span more: draw only from "first" and "last", or '
            "run a campaign for each"
        )
