"""The design of a campaign: which values every sample has."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ringsim.choice import load_package, one_of
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.refusal import InputError
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Axis, Design
from ringsim.sampling.distributions.family import Distribution
from ringsim.sampling.paths import each_of, field_at, refuse_fixed, unit_at
from ringsim.scene import Scene, place_of

for _package in ("distributions", "distributions.continuous", "designs"):
    load_package(f"ringsim.sampling.{_package}")

if TYPE_CHECKING:
    AnyDistribution = Distribution
    AnyDesign = Design
else:
    AnyDistribution = one_of(Distribution)
    AnyDesign = one_of(Design)


@dataclass(frozen=True)
class Column:
    """The values of one input over all samples.

    Attributes
    ----------
    name
        Name in netCDF files: the path with underscores.
    path
        Scene path that the values are written to.
    dim
        Second dimension of ``values``, or empty: what there is a value for, "section", "corner"
        "pulley" or "pulley_of_two_winches" (one more), or "place_k" for lists of any other
        length k.
    units
        SI unit of the field.
    origin
        The distribution, in words.
    values
        Shape (samples,), or (samples, k) with a value for each place.
    """

    name: str
    path: str
    dim: str
    units: str
    origin: str
    values: NDArray[Any]


@dataclass(frozen=True)
class Table:
    """All inputs of all samples, with a seed for each sample."""

    columns: tuple[Column, ...]
    seeds: NDArray[np.int64]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.seeds)

    def values_of(self, sample: int) -> dict[str, Any]:
        """Values by path of one sample, as :meth:`Scene.with_values` takes them."""
        return {column.path: column.values[sample].tolist() for column in self.columns}

    def starts_with(self, other: Table) -> bool:
        """Whether the first samples are those of ``other``, bit by bit."""
        count = other.samples
        return (
            count <= self.samples
            and [c.path for c in self.columns] == [c.path for c in other.columns]
            and np.array_equal(self.seeds[:count], other.seeds)
            and all(
                np.array_equal(mine.values[:count], old.values)
                for mine, old in zip(self.columns, other.columns, strict=True)
            )
        )


def draw(
    base: Scene,
    inputs: Mapping[str, Distribution],
    correlations: Sequence[Correlation],
    design: Design,
    *,
    seed: int,
    folder: Path,
) -> Table:
    """Draw all samples of a campaign.

    Parameters
    ----------
    base
        Scene that the samples vary.
    inputs
        Distribution by scene path.
    correlations
        Pairs of inputs that depend on each other.
    design
        How samples are placed.
    seed
        Seed of the campaign.
    folder
        Where files that the design names are looked up.

    Raises
    ------
    InputError
        If a path or its values are refused by the scene.
    """
    axes: list[Axis] = []
    for path, distribution in inputs.items():
        refuse_fixed(base, path)
        middle = distribution.quantile(np.array([0.5]))[0].item()
        if distribution.each_section:
            count = each_of(base, path, middle)
            axes += [Axis(f"{path}[{k + 1}]", distribution) for k in range(count)]
        else:
            base.with_values({path: middle})
            axes.append(Axis(path, distribution))
    twice = [path for path, count in Counter(axis.path for axis in axes).items() if count > 1]
    if twice:
        raise InputError(f"inputs: {twice[0]} is drawn twice: leave out one of its inputs")
    drawn = design.table(axes, correlations, seed=seed, folder=folder)
    samples = len(next(iter(drawn.values()))) if drawn else getattr(design, "samples", 1)
    columns: list[Column] = []
    taken = VARIABLES.keys() | COORDINATES.keys()
    for path in dict.fromkeys([*inputs, *(p for p in drawn if not axes)]):
        refuse_fixed(base, path)
        grouped = path in inputs and inputs[path].each_section
        names = [p for p in drawn if p.startswith(f"{path}[")] if grouped else [path]
        values = np.stack([drawn[p] for p in names], axis=1) if grouped else drawn[path]
        column = _column(base, path, values, inputs.get(path), design)
        if column.name in taken:
            raise InputError(f"inputs: {path} would be named {column.name}, which is taken")
        taken.add(column.name)
        columns.append(column)
    table = Table(tuple(columns), _seeds(seed, samples))
    _check_extremes(base, table)
    return table


def _column(
    base: Scene, path: str, values: NDArray[Any], origin: Distribution | None, design: Design
) -> Column:
    first = values[0].tolist()
    scene = base.with_values({path: first})
    dim = ""
    if values.ndim == 2:
        dim = place_of(path, closed=scene.structure.closed) or f"place_{values.shape[1]}"
        if dim == "pulley" and values.shape[1] != scene.structure.pulleys:
            dim = "pulley_of_two_winches"
    name = path.replace(".", "_").replace("[", "_").removesuffix("]")
    words = "listed in a file" if origin is None else origin.model_dump_json(exclude_none=True)
    found = field_at(scene, path)
    if values.dtype.kind in "iu" and isinstance(found, float):
        values = values.astype(float)
    return Column(name, path, dim, unit_at(scene, path), words, values)


def _seeds(seed: int, samples: int) -> NDArray[np.int64]:
    """One seed per sample, from the campaign's seed and the sample's index alone."""
    seeds = np.empty(samples, dtype=np.int64)
    for sample in range(samples):
        state = np.random.SeedSequence(seed, spawn_key=(sample,)).generate_state(1, np.uint64)
        seeds[sample] = int(state[0] >> np.uint64(1))
    return seeds


def _check_extremes(base: Scene, table: Table) -> None:
    """Build the scenes that hold the least and the greatest value of every input.

    Every word among the inputs is in one of them, so that all numbers of spans are seen.
    """
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


def with_error_bars(table: Table, every: int) -> Table:
    """Add an input that has one sample in ``every`` state its error bars; none if that is 0.

    Raises
    ------
    InputError
        If the inputs say already which samples do.
    """
    if every == 0:
        return table
    path = "solver.error_bars"
    if any(column.path == path for column in table.columns):
        raise InputError(f"error_bars_every = {every}: {path} is an input already: leave out one")
    chosen = np.arange(table.samples) % every == 0
    column = Column(path.replace(".", "_"), path, "", "1", f"one sample in {every}", chosen)
    return dataclasses.replace(table, columns=(*table.columns, column))


def first_samples(table: Table, count: int) -> Table:
    """The design cut down to its first samples."""
    cut = tuple(dataclasses.replace(c, values=c.values[:count]) for c in table.columns)
    return Table(cut, table.seeds[:count])
