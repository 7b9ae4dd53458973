"""The inputs of all samples: how they lie in netCDF files, how they are correlated."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Annotated, Any, Self

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from ringsim.cable.records import CABLES
from ringsim.overrides import with_number
from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.distributions import (
    Array,
    Calibrated,
    Ranged,
    Values,
    array_of,
    inside,
    label_of,
    labels_of,
    plain,
)
from ringsim.units import ListIn, Model

BLOCK_ROW = "block_row"
"""The label of a sample that says what it is within its block, see ``designs.grouped``."""


@dataclass(frozen=True)
class Column:
    """The values of one input over all samples."""

    name: str
    """Name in netCDF files: the path with underscores."""
    path: str
    """Scene path that the values are written to; empty for labels, which tell samples apart, and
    for inputs that others follow."""
    dim: str
    """Second dimension of ``values``, or empty: "section", "corner", "pulley",
    "pulley_of_two_winches" (one more), or "place_k" for lists of any other length k."""
    units: str
    """Unit of the field, SI; of what has no path as it was told, or empty."""
    origin: str
    """The distribution, in words."""
    values: Values
    """Shape (samples,), or (samples, k) with a value for each place."""
    places: tuple[str, ...] = ()
    """Names of the k places, if they have some."""
    input: str = ""
    """The campaign file's name of what was drawn, which several paths may share; empty: the path.
    """

    @property
    def in_words(self) -> bool:
        """Whether files hold the values as text: words, tables, lists, or these beside numbers."""
        return self.values.dtype.kind in "UO"

    @property
    def has_numbers(self) -> bool:
        """Whether any value is a number, so that the unit says something."""
        kind = self.values.dtype.kind
        return kind != "U" and (kind != "O" or any(map(_is_number, self.values.ravel())))


@dataclass(frozen=True)
class Table:
    """All inputs of all samples, with a seed for each sample."""

    columns: tuple[Column, ...]
    seeds: NDArray[np.int64]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.seeds)

    @property
    def moves_winches(self) -> bool:
        """Whether samples count the pulleys of a cable from different ends."""
        ends = [f"cables.{cable}.end" for cable in CABLES]
        return any(f"{end}.".startswith(f"{c.path}.") for c in self.columns for end in ends)

    def values_of(self, sample: int) -> dict[str, Any]:
        """Values by path of one sample, as :meth:`Scene.with_values` takes them."""
        return {c.path: plain(c.values[sample]) for c in self.columns if c.path}

    def first(self, samples: int) -> "Table":
        """The first samples alone."""
        columns = tuple(replace(each, values=each.values[:samples]) for each in self.columns)
        return Table(columns, self.seeds[:samples])

    def starts_with(self, other: Self) -> bool:
        """Whether the first samples are those of ``other``, bit by bit."""
        count = other.samples
        return (
            count <= self.samples
            and [c.name for c in self.columns] == [c.name for c in other.columns]
            and np.array_equal(self.seeds[:count], other.seeds)
            and all(
                np.array_equal(mine.values[:count], old.values)
                for mine, old in zip(self.columns, other.columns, strict=True)
            )
        )


def add_inputs(file: Any, table: Table, *, compression: int) -> None:
    """Create a variable for every input, and the samples' seeds, in an open netCDF4 dataset.

    Tables and lists stand there by their labels, with which readers can group samples; the
    attribute ``choices`` (JSON) says what each label stands for.
    """
    for column in table.columns:
        values, text = column.values, column.in_words
        kind: Any = str if text else {"b": "i1"}.get(values.dtype.kind, values.dtype)
        if column.dim in file.dimensions and file.dimensions[column.dim].size != values.shape[1]:
            # Of the pulleys of a result, there are as many as the cable with most of them has.
            column = replace(column, dim=f"{column.dim}_of_one_winch")
        if column.dim and column.dim not in file.dimensions:
            file.createDimension(column.dim, values.shape[1])
        dims = ("sample", column.dim) if column.dim else ("sample",)
        packed = compression and not text
        options = {"compression": "zlib", "complevel": compression} if packed else {}
        variable = file.createVariable(column.name, kind, dims, **options)
        role = "input" if column.path or column.input else "label"
        variable.long_name = f"{role} {column.path or column.name}"
        if column.has_numbers and column.units:
            variable.units = column.units
        variable.setncatts(
            {"path": column.path, "role": role, "distribution": column.origin}
            | ({"input": column.input or column.path} if role == "input" else {})
            | ({"dtype": "bool"} if values.dtype.kind == "b" else {})
        )
        if values.dtype.kind == "O":
            choices = {label_of(each): each for each in map(plain, values.ravel())}
            variable.choices, values = json.dumps(choices), labels_of(values)
        variable[:] = values.astype(object if text else kind)
        if column.places and not table.moves_winches:
            variable.coordinates = _add_names(file, column, table)
    seeds = file.createVariable("sample_seed", "i8", ("sample",))
    seeds.long_name = "seed of the sample, from the campaign's seed and the sample's index"
    seeds.units = "1"
    seeds[:] = table.seeds


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _add_names(file: Any, column: Column, table: Table) -> str:
    """The coordinate with the names of a column's places; its own where columns differ in them."""
    shared = len({each.places for each in table.columns if each.dim == column.dim}) <= 1
    name = f"{column.dim}_name" if shared else f"{column.name}_{column.dim}_name"
    if name not in file.variables:
        file.createVariable(name, str, (column.dim,))[:] = np.array(column.places, dtype=object)
        file[name].long_name = f"place of the {column.dim.partition('_')[0]}"
    return name


def read_inputs(file: Any) -> tuple[Column, ...]:
    """The inputs and labels in an open netCDF4 dataset: what is over samples and says so."""
    file.set_auto_maskandscale(False)
    columns: list[Column] = []
    for name, variable in file.variables.items():
        says = {key: variable.getncattr(key) for key in variable.ncattrs()}
        if variable.dimensions[:1] == ("sample",) and "path" in says:
            values = np.asarray(variable[:])
            kind = says.get("dtype", str if values.dtype.kind == "O" else values.dtype)
            if "choices" in says:
                chosen = json.loads(says["choices"])
                each = array_of([chosen[label] for label in values.ravel()])
                values, kind = each.reshape(values.shape), object
            dim, origin = "".join(variable.dimensions[1:]), says.get("distribution", "")
            units = says.get("units", "1")
            named = says.get("coordinates")
            places = tuple(file[named][:]) if named else ()
            values = values.astype(kind)
            own = says.get("input", "")
            columns.append(Column(name, says["path"], dim, units, origin, values, places, own))
    return tuple(columns)


# Correlated inputs: a Gaussian copula over the axes of a design.


class Correlation(Model):
    """Two inputs that depend on each other.

    The coefficient is the linear correlation of the underlying standard normal variables
    (Gaussian copula); between two normal inputs it is their own correlation.
    """

    between: Annotated[tuple[str, str], ListIn]
    """Scene paths, or names, of the two inputs.  Of an input with ``each_section`` the values of
    all places, of two of them those of the same place."""
    coefficient: Annotated[float, Field(gt=-1.0, lt=1.0)]
    """Correlation of the underlying normal variables."""

    def renamed(self, names: Mapping[str, str]) -> Self:
        """With other names of some inputs."""
        first, second = (names.get(each, each) for each in self.between)
        return self.model_copy(update={"between": (first, second)})


def correlate(points: Array, paths: Sequence[str], correlations: Sequence[Correlation]) -> Array:
    """Make independent points of the unit cube, shape (samples, axes), depend on each other.

    There is one path per axis; ``a.b`` in a correlation also means every ``a.b[k]``, section by
    section.  InputError if a pair names what is not drawn, or if the pairs contradict each other.
    """
    matrix = np.eye(len(paths))
    for pair, first, second in pairs_of(paths, correlations):
        matrix[first, second] = matrix[second, first] = pair.coefficient
    moved = np.flatnonzero((matrix != np.eye(len(paths))).any(axis=0))
    if not moved.size:
        return points
    try:
        lower = np.linalg.cholesky(matrix[np.ix_(moved, moved)])
    except np.linalg.LinAlgError:
        raise InputError(
            "correlations: the coefficients are not compatible (their matrix is not positive "
            "definite): bring them closer to 0"
        ) from None
    dependent = points.copy()
    dependent[:, moved] = inside(
        scipy.special.ndtr(scipy.special.ndtri(points[:, moved]) @ lower.T)
    )
    return dependent


def pairs_of(
    paths: Sequence[str], correlations: Sequence[Correlation]
) -> Iterator[tuple[Correlation, int, int]]:
    """Every two axes that depend on each other; InputError as ``correlate`` raises it."""
    for pair in correlations:
        first, second = (_axes(paths, name) for name in pair.between)
        where = f"correlations.between = {list(pair.between)}"
        if set(first) & set(second):
            raise InputError(f"{where} must name two different inputs")
        if len(first) != len(second):
            raise InputError(
                f"{where}: one has {len(first)} values and the other {len(second)}: give both or "
                "neither each_section = true"
            )
        for one, other in zip(first, second, strict=True):
            yield pair, one, other


def partners(
    pairs: Sequence[Mapping[str, Any]], scene: dict[str, Any], drawn: Sequence[str]
) -> dict[str, str]:
    """By drawn input the other one of the first of a file's correlations in which it has a part,
    by itself, as a place of another one, or with a place that is drawn with it.
    """

    def own(name: str) -> str:
        with suppress(InputError):
            return with_number(scene, name)
        return name

    found, known = dict[str, str](), {own(name) for name in drawn}
    for pair in pairs:
        for one, other in permutations(pair["between"]):
            place = own(one)
            for name in drawn:
                with_place = place.startswith(f"{own(name)}[") and place not in known
                if own(name) == place or own(name).startswith(f"{place}[") or with_place:
                    found.setdefault(name, other)
    return found


def _axes(paths: Sequence[str], name: str) -> list[int]:
    found = [k for k, path in enumerate(paths) if path == name or path.startswith(f"{name}[")]
    if not found:
        hint = known_or_nearest(name, dict.fromkeys(path.split("[")[0] for path in paths))
        raise InputError(f'correlations.between names "{name}", which is not an input ({hint})')
    return found


# Unknowns, that data tell of.


@dataclass(frozen=True)
class Axis:
    """One unknown number: an axis of standard normal space."""

    name: str
    """Path or name in a campaign file, with the place where there is one for each."""
    law: Ranged | Calibrated
    """Its prior."""
    units: str
    group: str
    """Of what it is one place: the key that it is drawn for, without a place; its name, if its
    prior is not that of most of them."""
    input: str
    """The key that it is drawn for."""
    shared: tuple[str, ...] = ()
    """Scene paths that all take it, if not the name alone."""

    def moved(self, mean: float, deviation: float, test: str) -> Calibrated:
        """The prior moved and narrowed; of one that an earlier test has moved, by both."""
        before, shift, scatter = self.law, 0.0, 1.0
        if isinstance(before, Calibrated):
            shift, scatter, test = before.shift, before.remaining_scatter, f"{before.data}, {test}"
        return Calibrated(
            of=before.of if isinstance(before, Calibrated) else before,
            shift=shift + scatter * mean, remaining_scatter=scatter * deviation, data=test,
            shared=self.shared,
        )  # fmt: skip


def alike(axes: dict[str, Axis]) -> dict[str, Axis]:
    """Axes, of which those with priors of their own are no places among others."""
    priors = {a.name: (a.law.of if isinstance(a.law, Calibrated) else a.law).model_dump_json()
              for a in axes.values()}  # fmt: skip
    of = {a.group: Counter(priors[b.name] for b in axes.values() if b.group == a.group)
          for a in axes.values()}  # fmt: skip
    usual = {group: each.most_common(1)[0][0] for group, each in of.items()}
    return {name: a if priors[name] == usual[a.group] else replace(a, group=name)
            for name, a in axes.items()}  # fmt: skip


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of a calibration: those of the scene, then those of the measured clock."""

    template: Table
    axes: tuple[Axis, ...]
    lower: Array
    """Root L of the priors' correlations R = L L', shape (unknowns, unknowns): a point w of
    standard normal space is at u = L w, each u_k N(0, 1)."""

    @property
    def names(self) -> list[str]:
        """Of the axes."""
        return [axis.name for axis in self.axes]

    def values(self, points: Array) -> dict[str, Array]:
        """Values by axis at points of standard normal space, shape (samples, unknowns)."""
        normal = points @ self.lower.T
        return {a.name: a.law.of_normal(normal[:, k]) for k, a in enumerate(self.axes)}

    def at(self, points: Array) -> Table:
        """The inputs of the scene there."""
        known, columns = self.values(points), []
        for column in self.template.columns:
            own = [known[a.name] for a in self.axes if a.input == column.input]
            values = np.stack(own, axis=1) if column.dim else own[0]
            columns.append(replace(column, values=values))
        return Table(tuple(columns), np.arange(len(points), dtype=np.int64))

    def cases(self, points: Array) -> list[dict[str, float]]:
        """Values by scene path of each point, one value to a path."""
        found, table = [], self.at(points)
        for sample in range(len(points)):
            row = dict[str, float]()
            for column in table.columns:
                each = np.atleast_1d(column.values[sample])
                own = marks(column.values, ())
                row |= {f"{column.path}{m}": float(v) for m, v in zip(own, each, strict=True)}
            found.append(row)
        return found

    def spread(self, mean: Array, covariance: Array) -> tuple[Array, Array]:
        """Mean and covariance of u, from those of w."""
        return self.lower @ mean, self.lower @ covariance @ self.lower.T


def marks(values: Array, places: tuple[str, ...]) -> list[str]:
    """What follows a path: nothing, or the number or name of each place."""
    if values.ndim == 1:
        return [""]
    return [f'["{p}"]' for p in places] or [f"[{k + 1}]" for k in range(values.shape[1])]
