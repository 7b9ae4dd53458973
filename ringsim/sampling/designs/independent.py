"""Designs of points that stand for themselves: grids, random and spread ones, single changes."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from ringsim.files import read_text
from ringsim.overrides import parse_value
from ringsim.refusal import InputError, known_or_nearest
from ringsim.sampling.columns import Correlation, read_inputs
from ringsim.sampling.designs import Design, Factors, Samples
from ringsim.sampling.distributions import Array, Values, array_of, inside, is_label

Levels = Annotated[int, Field(ge=1, le=100_000)]
MOST_POINTS = 10_000_000


class Grid(Design):
    """Every combination; the last input changes fastest.

    Discrete inputs take all their values.  Uniform ones go from end to end in equal steps,
    unbounded ones stand at the middles of intervals of equal probability.
    """

    correlated: ClassVar[bool] = False
    population: ClassVar[bool] = False

    kind: Literal["grid"] = "grid"
    levels: Levels | dict[str, Levels] = 3
    """Points of every continuous input, or a table with one entry per path, 3 for those that it
    leaves out."""

    def points(self, factors: Factors, seed: int) -> Array:
        """All combinations of the inputs' levels."""
        counts = _by_path("levels", self.levels, list(factors), 3)
        lines = [each.levels(counts[path]) for path, each in factors.items()]
        size = math.prod(len(line) for line in lines)
        if size > MOST_POINTS:
            raise InputError(
                f"design.levels: the grid has {size} samples and must have at most {MOST_POINTS}: "
                "use fewer levels"
            )
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(size, -1)


def _by_path(
    key: str, given: int | Mapping[str, int], paths: Sequence[str], default: int
) -> dict[str, int]:
    """What a design says of every factor: one number, or a table by path or by input, whose places
    take it.
    """
    if isinstance(given, int):
        return dict.fromkeys(paths, given)
    inputs = {path: path.rpartition("[")[0] for path in paths}
    names = {*paths, *inputs.values()} - {""}
    for path in given:
        if path not in names:
            hint = known_or_nearest(path, names)
            raise InputError(f'design.{key}."{path}" is not an input ({hint})')
    return {path: given.get(path, given.get(inputs[path], default)) for path in paths}


class RandomDesign(Design):
    """Plain Monte Carlo: sample i depends on the campaign's seed and on i alone."""

    gone: ClassVar[dict[str, str]] = {
        "replicates": "samples of a random design are already independent: leave it out",
    }
    independent: ClassVar[bool] = True
    extendable: ClassVar[bool] = True

    kind: Literal["random"] = "random"
    samples: Samples
    """Number of samples."""

    def points(self, factors: Factors, seed: int) -> Array:
        """One stream of random numbers per sample, in the order of the factors."""
        points = np.empty((self.samples, len(factors)))
        for sample in range(self.samples):
            stream = np.random.SeedSequence(seed, spawn_key=(sample,))
            points[sample] = np.random.default_rng(stream).random(len(factors))
        return inside(points)


# What designs share whose points depend on each other: independent replicates of the design.


class Replicated(Design):
    """A design that may be made of ``replicates``, each with a randomisation of its own.

    Sample i is a point of replicate i modulo ``replicates``, so that the first samples of a
    campaign are spread over all of them.  Only replicates are independent of each other: the
    scatter of their results is what tells how certain a result is.
    Source: L'Ecuyer and Lemieux, in Modeling Uncertainty (2002), randomised quasi-Monte Carlo.
    """

    samples: Samples
    """Number of samples, a multiple of ``replicates``."""
    replicates: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Independent designs among which the samples are divided; from 2 on there are intervals."""

    @model_validator(mode="after")
    def _whole_replicates(self) -> "Replicated":
        if left := self.samples % self.replicates:
            near = max(self.samples - left, self.replicates)
            raise ValueError(
                f"samples = {self.samples} must be a multiple of replicates = {self.replicates}, "
                f"for example {near}: all replicates have the same number of samples"
            )
        return self

    def points(self, factors: Factors, seed: int) -> Array:
        """The points of all replicates, those of the first with the campaign's own seed."""
        return self.spread(len(factors), seed)

    def spread(self, axes: int, seed: int) -> Array:
        """The points of all replicates in a unit cube of so many axes."""
        found = np.empty((self.samples, axes))
        for number in range(self.replicates):
            # Keys of two numbers, since those of one are the seeds of samples.
            key = () if number == 0 else (0, number)
            stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
            points = self.replicate(self.samples // self.replicates, axes, stream)
            found[number :: self.replicates] = points
        return inside(found)

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """One replicate in the unit cube, shape (samples, axes)."""
        raise NotImplementedError


class LatinHypercube(Replicated):
    """Every input has exactly one sample in each of its n intervals of equal probability.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979).  Not extendable.
    """

    kind: Literal["latin-hypercube"] = "latin-hypercube"

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """Random places within randomly permuted intervals."""
        from scipy.stats import qmc

        return np.asarray(qmc.LatinHypercube(d=axes, rng=stream).random(samples))


class Sobol(Replicated):
    """Low-discrepancy sequence with linear matrix scrambling and a digital shift.

    Balanced at powers of two; fewer samples are the first ones of the next power of two.
    Source: Joe and Kuo (2008) directions, Matousek (1998) scrambling, as in scipy.
    """

    extendable: ClassVar[bool] = True

    kind: Literal["sobol"] = "sobol"

    def replicate(self, samples: int, axes: int, stream: np.random.Generator) -> Array:
        """The first points of the sequence that belongs to the stream."""
        return sobol_points(samples, axes, stream, kind=self.kind)


def sobol_points(samples: int, axes: int, stream: np.random.Generator, *, kind: str) -> Array:
    """The first points of a scrambled sequence, shape (samples, axes).

    InputError, which names the kind of the design, above the dimensions of the directions.
    """
    from scipy.stats import qmc

    if axes > qmc.Sobol.MAXDIM:
        raise InputError(
            f"design.kind = {kind} needs {axes} dimensions and has at most {qmc.Sobol.MAXDIM}: "
            "draw fewer inputs"
        )
    engine = qmc.Sobol(d=axes, scramble=True, rng=stream, bits=30)
    return np.asarray(engine.random_base2((samples - 1).bit_length())[:samples])


class Listed(Design):
    """One sample per row of a CSV file with scene paths in its header, or per netCDF sample.

    A CSV file has commas between its cells and points in its numbers.  A column of text whose name
    is no scene path holds labels, which are kept beside the results.

    In a netCDF file every variable over the dimension ``sample`` that has an attribute ``path``
    is taken: the design or the result of another campaign can be listed as it is.
    """

    population: ClassVar[bool] = False
    cure: ClassVar[str] = "correct it there"

    kind: Literal["list"] = "list"
    file: str
    """Looked up beside the campaign file."""

    def where(self, sample: int, path: str) -> str:
        """Where a sample stands in the file; see :meth:`Design.where`."""
        row = "" if self.file.endswith(".nc") else f"row {sample + 1} below the header, "
        return f"{self.file}: {row}sample {sample}{path and f', column {path}'}"

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """Values by path; see :meth:`Design.table`."""
        if factors or correlations:
            raise InputError(
                "inputs: a listed design has its inputs in its file: leave out inputs and "
                "correlations"
            )
        path = folder / self.file
        if not path.is_file():
            raise InputError(f"design.file = {self.file}: there is no file {path}")
        columns = _from_netcdf(path) if path.suffix == ".nc" else _from_csv(path)
        if not columns or not len(next(iter(columns.values()))):
            raise InputError(f"design.file = {self.file}: no samples in it")
        return columns


def _from_csv(path: Path) -> dict[str, Values]:
    lines = csv.reader(read_text(path).splitlines())
    rows = [[word.strip() for word in row] for row in lines if row]
    if not rows:
        return {}
    (header, *rows), where = rows, f"design.file = {path.name}:"
    for mark, word in {";": "semicolons", "\t": "tabs"}.items():
        if any(mark in name for name in header):
            raise InputError(
                f"{where} its columns are separated by {word}, and must be by commas, with points "
                "in numbers (0.5): export it as CSV with commas"
            )
    for name in header:
        if not name or header.count(name) > 1:
            raise InputError(f"{where} column name {name!r} must be a scene path, once")
    for number, row in enumerate(rows, start=1):
        for name, word in zip(header, row, strict=False):
            if _DECIMAL_COMMA.fullmatch(word):
                raise InputError(
                    f'{where} row {number} below the header, column {name}: "{word}" has a decimal '
                    f"comma: write {word.replace(',', '.')}"
                )
        if len(row) != len(header):
            raise InputError(
                f"{where} row {number} has {len(row)} values and must have {len(header)}, one per "
                "column; commas separate values, decimals have points (0.5)"
            )
    columns = {name: words for name, *words in zip(header, *rows, strict=True)} if rows else {}
    return {name: _typed(name, words, f"{where} column {name}") for name, words in columns.items()}


_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def _typed(name: str, words: Sequence[str], where: str) -> Values:
    """The cells of a column: numbers, true and false, tables, words; or labels."""
    cells = array_of([_cell(word, where) for word in words])
    return np.array(words) if is_label(name) and cells.dtype.kind not in "if" else cells


def _cell(word: str, where: str) -> Any:
    if word in ("true", "false"):
        return word == "true"
    for kind in (int, float):
        try:
            return kind(word)
        except (ValueError, OverflowError):
            continue
    return parse_value(word, where) if word.startswith(("{", "[")) else word


def _from_netcdf(path: Path) -> dict[str, Values]:
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            columns = read_inputs(file)
    except OSError as error:
        raise InputError(f"design.file = {path.name}: cannot be read: {error}") from None
    return {column.path or column.name: column.values for column in columns}


Places = Annotated[int, Field(ge=1, le=100_000)]
_BASE = 1


class OneAtATime(Design):
    """A base case, then every input in turn at each of its other levels, the others at the base.

    Levels are those of a grid: all values of a discrete input, a uniform one from end to end in
    equal steps, of unbounded ones the middles of intervals of equal probability.  An input with
    ``each_section`` changes in one section at a time: one bad part in each.  Interactions of
    inputs stay unseen.
    """

    correlated: ClassVar[bool] = False
    population: ClassVar[bool] = False

    kind: Literal["one-at-a-time"] = "one-at-a-time"
    levels: Annotated[int, Field(ge=2, le=100_000)] = 2
    """Points of every continuous input."""
    base: Places | dict[str, Places] = _BASE
    """Which level of an input, from 1 on, is that of the base case; or a table with one entry per
    path, 1 for those that it leaves out."""

    def points(self, factors: Factors, seed: int) -> Array:
        """The base case, then input by input in their order, shape (samples, factors)."""
        lines = {path: each.levels(self.levels) for path, each in factors.items()}
        places = _by_path("base", self.base, list(lines), _BASE)
        for path, line in lines.items():
            if places[path] > len(line):
                raise InputError(
                    f"design.base = {places[path]} for {path}, which has {len(line)} levels: "
                    "give one of these"
                )
        middle = np.array([line[places[path] - 1] for path, line in lines.items()])
        rows = [middle]
        for axis, (path, line) in enumerate(lines.items()):
            for value in np.delete(line, places[path] - 1):
                rows.append(middle.copy())
                rows[-1][axis] = value
        return np.array(rows)
