"""How the samples of a campaign were placed, and what was read of them."""

from __future__ import annotations

import functools
import hashlib
import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis import intervals
from ringsim.analysis.derived import known_from
from ringsim.analysis.intervals import NONE, NOTHING, Interval, good, numbers, standard_error, used
from ringsim.choice import kind_of, kinds_of
from ringsim.files import DESIGN, MERGED, campaign_cure
from ringsim.outputs import VARIABLES
from ringsim.refusal import InputError
from ringsim.sampling.columns import BLOCK_ROW, partners
from ringsim.sampling.designs import Design
from ringsim.sampling.designs.blocks import Saltelli, block_size, stretches
from ringsim.stepping.instant import Array
from ringsim.variables import GOALS, NO_CODE, Cause, Code, Fate, Status

if TYPE_CHECKING:
    import xarray as xr

# The blocks of runs that designs for Sobol' indices and for screening are made of.


@dataclass(frozen=True)
class Blocks:
    """What every sample is within its block."""

    rows: NDArray[np.str_]
    """Shape (blocks, size): "A", "AB: GROUP", "B"; of trajectories "start", "up: GROUP", ..."""

    @property
    def size(self) -> int:
        """Samples of a block."""
        return int(self.rows.shape[1])

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that move, in the order of the first block."""
        names = (row.partition(": ")[2] for row in self.rows[0].tolist())
        return tuple(dict.fromkeys(name for name in names if name))

    @property
    def of_indices(self) -> bool:
        """Whether they are for Sobol' indices; else they are trajectories."""
        return bool(self.rows[0, 0] == "A")


def blocks_of(campaign: xr.Dataset) -> Blocks | None:
    """The blocks of a whole campaign; None if it has none, or is a selection of its samples."""
    if BLOCK_ROW not in campaign or not campaign.sizes["sample"]:
        return None
    rows = campaign[BLOCK_ROW].to_numpy().astype(str)
    whole = np.array_equal(campaign["sample"].to_numpy(), np.arange(len(rows)))
    starts = np.flatnonzero(rows == rows[0])
    size = int(starts[1]) if len(starts) > 1 else len(rows)
    if not whole or len(rows) % size or (starts != np.arange(0, len(rows), size)).any():
        return None
    return Blocks(rows.reshape(-1, size))


def population_of(campaign: xr.Dataset) -> xr.Dataset:
    """The samples that stand for the population: of blocks for Sobol' indices those of A and B.

    The other runs of a block repeat most of their values; in statistics they would count as if they
    were more antennas.
    """
    if BLOCK_ROW not in campaign:
        return campaign
    rows = campaign[BLOCK_ROW].to_numpy().astype(str)  # also those of a part of a block
    drawn = np.isin(rows, ["A", "B"])
    of_indices = drawn | np.char.startswith(rows, "AB: ") | np.char.startswith(rows, "BA: ")
    return campaign.isel(sample=np.flatnonzero(drawn)) if of_indices.all() else campaign


# How the samples of a campaign were placed, as far as it decides which statistics they allow.


@dataclass(frozen=True)
class Placement:
    """What a design says about its samples."""

    kind: str
    population: bool
    """Whether the samples stand for the distributions of the inputs."""
    independent: bool
    """Whether each sample is drawn apart from the others."""
    replicates: int = 1
    """Independent replicates; sample, or block, i belongs to replicate i modulo this."""
    block: int = 1
    """Successive samples that belong together."""

    @property
    def has_intervals(self) -> bool:
        """Whether the scatter of independent parts tells how certain an estimate is."""
        return self.population and (self.independent or self.replicates > 1)

    def replicate_of(self, samples: NDArray[np.int64]) -> NDArray[np.int64] | None:
        """The replicate of each sample; None if all samples are independent."""
        return None if self.independent else samples // self.block % self.replicates

    def interval(
        self, values: Array, samples: NDArray[np.int64], of: Callable[..., Any] | float
    ) -> Interval:
        """Interval of 95 % of these samples' mean or ``spread``, or of a quantile if ``of`` is its
        probability, as the design allows it; shapes (n,).
        """
        if not self.has_intervals or len(values) < 2:
            return NONE
        replicate = self.replicate_of(samples)
        ends: tuple[Any, Any]
        if callable(of):
            ends = (
                intervals.of_independent(values, of)
                if replicate is None
                else intervals.of_replicates(values, replicate, of)
            )
        elif replicate is None:
            ends = intervals.quantile_of_independent(values, of)
        else:
            ends = intervals.quantile_of_replicates(values, replicate, of)
        return float(ends[0]), float(ends[1])

    def error_of_mean(self, values: Array, samples: NDArray[np.int64]) -> float:
        """Standard error of the mean of these samples' values, in their unit, shapes (n,); NaN
        where their scatter does not tell it.
        """
        if not self.has_intervals or not len(values):
            return float("nan")
        return float(standard_error(values, self.replicate_of(samples))[0])

    @property
    def told(self) -> str:
        """What the intervals are from, or why there are none and how to get some."""
        if not self.kind:
            return (
                "the design of this campaign is not known, so only the least and the largest "
                "values are given: analyse a campaign that ringsim campaign has run, or set the "
                "attribute design"
            )
        if not self.population:
            return (
                f"samples of a {self.kind} design do not represent a population, so only the "
                'least and the largest values are given: use design = { kind = "random", samples '
                "= N } for means, quantiles and probabilities"
            )
        if self.independent:
            return (
                "95 % intervals: bootstrap for means and standard deviations, order statistics "
                "for quantiles, Clopper-Pearson for shares"
            )
        of = "statistics use only the samples A and B of each block: " * (self.block > 1)
        if self.replicates > 1:
            return of + (
                f"95 % intervals from {self.replicates} independent replicates of the "
                f"{self.kind} design (Student's t); for shares of fewer than 10 samples "
                "Clopper-Pearson, as for independent samples"
            )
        return of + (
            f"no intervals: samples of one {self.kind} design are not independent, so their "
            "scatter does not show the error; set design.replicates = 8 (independent "
            'replicates), or kind = "random"; bounds of requirements are calculated as for '
            "independent samples"
        )


def placement_of(design: Design) -> Placement:
    """The placement of a design that no sample has been drawn from yet."""
    replicates = getattr(design, "replicates", 1)
    return Placement(kind_of(design), design.population, design.independent, replicates)


def placement(campaign: xr.Dataset) -> Placement:
    """The placement that a merged campaign tells, or one of no population."""
    table = json.loads(campaign.attrs.get("design", "{}"))
    kind = kinds_of(Design).get(str(table.get("kind")))
    if kind is None or not issubclass(kind, Design):
        return Placement("", population=False, independent=False)
    given = table.get("replicates", getattr(kind.model_fields.get("replicates"), "default", 1))
    block = 1
    if issubclass(kind, Saltelli) and BLOCK_ROW in campaign:
        block = block_size(campaign[BLOCK_ROW].to_numpy(), campaign["sample"].to_numpy())
    return Placement(str(table["kind"]), kind.population, kind.independent, int(given), block)


# What became of each, and which one stands for many.


NUMERICAL = ("energy_error", "constraint_error")
"""Main numbers that tell about the solution, not about the antenna."""
_EFFORT = ("wall_time",)


LOST = "failed: "
"""How the words begin for what became of a run whose numbers do not hold."""
FAILED_RUNS = "failed runs"
"""Name of all of these together."""
UNKNOWN, NOT_RUN = "unknown", "not run"
REACHED = tuple(fate.words for fate in GOALS)
"""What became of those that reached their goal."""


def endings(campaign: xr.Dataset) -> NDArray[np.str_]:
    """What became of each sample in words: an outcome, or why its numbers do not hold; (sample,).

    >>> import xarray as xr
    >>> codes = {"status": ("sample", [0, 0, 7, -1]), "outcome": ("sample", [1, 3, 0, -1])}
    >>> endings(xr.Dataset(codes)).tolist()
    ['deployed', 'stalled', 'failed: memory', 'not run']
    """
    status = campaign["status"].to_numpy()
    fates = campaign["outcome"].to_numpy() if "outcome" in campaign else np.zeros_like(status)
    return endings_of(status, fates)


def endings_of(status: NDArray[Any], fates: NDArray[Any]) -> NDArray[np.str_]:
    """The same from the codes of samples, shape (sample,)."""
    fates = np.where(np.isin(fates, [int(fate) for fate in Fate]), fates, Fate.NONE)
    return np.array([_word(*codes) for codes in zip(status.tolist(), fates.tolist(), strict=True)])


@functools.cache
def _word(code: int, fate: int) -> str:
    if code < 0:
        return NOT_RUN
    if Status(code).failed:
        return f"{LOST}{Status(code).words}"
    return UNKNOWN if fate == Fate.NONE else Fate(fate).words


def kinds_of_ends(words: NDArray[np.str_]) -> list[str]:
    """The different words, outcomes before losses, without what has not run."""
    every = [Fate.NONE, *Fate], [*Status]
    order = [_word(0, fate) for fate in every[0]] + [_word(code, 0) for code in every[1]]
    return [word for word in dict.fromkeys(order) if word != NOT_RUN and (words == word).any()]


def short_of_goal(words: NDArray[np.str_]) -> list[str]:
    """The outcomes among words that fall short of the goal."""
    known = kinds_of_ends(words)
    return [w for w in known if w not in (*REACHED, UNKNOWN) and not w.startswith(LOST)]


def told(campaign: xr.Dataset, counted: int) -> str:
    """How many samples a statement counts, and what became of those that it does not.

    ``counted`` are samples that are ``used`` and have the value in question.
    """
    words = endings(campaign)
    ok = good(campaign)
    left = [f"{count} {word}" for word, count in Counter(words[~ok].tolist()).items()]
    if without := int(ok.sum()) - counted:
        left.append(f"{without} without a value")
    lost = f"; left out: {', '.join(left)}" if left else "; no run failed"
    return f"{counted} of {len(words)} samples{lost}"


def scalars(campaign: xr.Dataset) -> list[str]:
    """Main numbers of the antenna that some sample has, in the order of summaries; none that is
    round-off in all samples.
    """
    ok, found = good(campaign), list[str]()
    for name, variable in VARIABLES.items():
        if variable.summary is None or variable.dtype != "f8" or name not in campaign:
            continue
        values = np.abs(numbers(campaign, name)[ok])
        known = np.isfinite(values).any() and not values[~np.isnan(values)].max() < NOTHING
        if known and name not in (*NUMERICAL, *_EFFORT):
            found.append(name)
    return found


def values_of(campaign: xr.Dataset, name: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Samples that are used and have a finite value, and these values."""
    values = numbers(campaign, name)
    known = good(campaign) & np.isfinite(values)
    return campaign["sample"].to_numpy()[known], values[known]


def judged_by(campaign: xr.Dataset) -> str:
    """The number by which samples are ordered: asynchrony, or the time if there is none; ""."""
    names = scalars(campaign)
    return next((n for n in ("asynchrony_max", "deployment_time") if n in names), "")


def worst_is_largest(analysis: xr.Dataset, name: str) -> bool:
    """Whether the worst sample of an output, by itself or by what is required of it, is the one
    with the largest value.
    """
    worst, ends = int(analysis[f"{name}_worst_sample"]), analysis[f"{name}_end_sample"].values
    return bool(worst >= 0 and worst == ends[1] != ends[0])


def median_and_worst(campaign: xr.Dataset) -> tuple[int, int] | None:
    """The samples in the middle and at the worst end of that order; None if no sample is used."""
    if not (name := judged_by(campaign)):
        samples = used(campaign)["sample"].to_numpy()
        return (int(samples[0]), int(samples[0])) if len(samples) else None
    samples, values = values_of(campaign, name)
    order = np.argsort(VARIABLES[name].badness * values, kind="stable")
    return int(samples[order[(len(order) - 1) // 2]]), int(samples[order[-1]])


BARS = "solver.error_bars"
"""Path of the setting that ``error_bars_every`` of a campaign's file makes."""


def inputs(campaign: xr.Dataset) -> list[str]:
    """A variable for each drawn input: the first of those that share its values.

    Which samples have error bars is no input: ``error_bars_every`` says it, and no law.
    """
    found: dict[str, str] = {}
    for name, variable in campaign.variables.items():  # an array of each would take a third of ms
        says = variable.attrs
        if says.get("role") == "input" and says.get("path") != BARS:
            found.setdefault(called(campaign[name]), str(name))
    return [*found.values()]


def called(variable: xr.DataArray) -> str:
    """The campaign file's own name of an input, which is its path where it has no other."""
    says = variable.attrs
    return str(says.get("input") or says.get("path") or variable.name)


def paths_of(variable: xr.DataArray) -> list[str]:
    """The scene's paths that take the values of an input: one, all that share it, or none."""
    path = str(variable.attrs.get("path", variable.name))
    return distribution_of(variable).get("shared") or ([path] if path else [])


def by_path(campaign: xr.Dataset) -> dict[str, str]:
    """The variable with the values of each scene path that varies, also of those that follow an
    input by a table.
    """
    each = {
        str(n): v.attrs for n, v in campaign.variables.items() if v.attrs.get("role") == "input"
    }
    found = {path: name for name in each for path in paths_of(campaign[name])}
    found |= {str(says.get("path", name)): name for name, says in each.items()}
    return {path: name for path, name in found.items() if path not in ("", BARS)}


def campaign_file(campaign: xr.Dataset) -> dict[str, Any]:
    """The tables of the campaign's file, which the dataset keeps as text."""
    return tomllib.loads(str(campaign.attrs.get("campaign", "")))


def correlated(campaign: xr.Dataset) -> dict[str, str]:
    """By input another one that it is correlated with."""
    drawn = [called(campaign[name]) for name in inputs(campaign)]
    scene = tomllib.loads(str(campaign.attrs.get("scene", "")))
    return partners(campaign_file(campaign).get("correlations", []), scene, drawn)


def distribution_of(variable: xr.DataArray) -> dict[str, Any]:
    """A drawn input's distribution; {"text": ...} where it came out of a list."""
    text = str(variable.attrs.get("distribution", ""))
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    return found if isinstance(found, dict) else {"text": text}


def learnt_lines(campaign: xr.Dataset) -> list[str]:
    """Which inputs are drawn from what a test has told, a line a test."""
    found: dict[str, list[str]] = {}
    for name in inputs(campaign):
        says = distribution_of(campaign[name])
        if "remaining_scatter" in says:
            found.setdefault(str(says.get("data", "")), []).append(called(campaign[name]))
    return [
        f"learnt from the test {test}: {', '.join(dict.fromkeys(names))}"
        for test, names in found.items()
    ]


# The drawn inputs of a campaign as columns of numbers: by mean, quarter, place, by word, and by how
# far the two planes are apart.


_MOST_WORDS = 12
"""Different words of an input up to which each is a column of its own."""
_LEAST_QUARTERED = 8
"""Places of an input from which on each quarter of them has a mean of its own."""
DIFFERENCE = "difference of "
"""How the names of columns begin that tell how far inputs of the two planes are apart."""
_LEAST_ARM = 0.1
"""Share of the samples in which either plane has the larger value, below which there is no
difference: a V of which one arm is shorter is a line, which the inputs tell one by one."""


@dataclass(frozen=True)
class Drawn:
    """Columns of inputs, shape (samples, columns), those that are alike in all samples left out."""

    names: tuple[str, ...]
    values: Array
    level: tuple[str, ...]
    """Of each column: "input"; of one that has many places "mean", "quarter" and "place"; of both
    planes' inputs "difference"."""
    input: tuple[str, ...]
    """Of each column the name of its input; of a difference its own."""
    span: tuple[tuple[int, int], ...]
    """Of each column the first of its places and the one behind the last; 0, 0 without places."""


def drawn(campaign: xr.Dataset) -> Drawn:
    """All drawn inputs by the names that the campaign's file gives them: one that several paths
    share is one column; inputs of other names that are alike in all samples are one, too, which has
    both names, since nothing tells them apart.

    What both planes have adds its absolute difference, of many places that of their means: an
    output that grows as the planes part goes with neither input alone.
    """
    found: dict[str, tuple[Array, str, str, tuple[int, int]]] = {}
    for variable in (campaign[name] for name in inputs(campaign)):
        own, values = called(variable), variable.to_numpy()
        if values.dtype.kind in "OUS":
            words, counts = np.unique(values.astype(str), return_counts=True)
            if values.ndim == 1 and len(words) <= _MOST_WORDS:
                # Of two the rarer one: "faults = none" says less than the fault.
                for word in [words[counts.argmin()]] if len(words) == 2 else words:
                    is_so = (values.astype(str) == word).astype(float)
                    found[f"{own} = {word}"] = is_so, "input", own, (0, 0)
        elif values.ndim == 1:
            found[own] = values.astype(float), "input", own, (0, 0)
        else:
            numbers = values.astype(float)
            count = numbers.shape[1]
            found[f"mean of {own}"] = numbers.mean(axis=1), "mean", own, (0, count)
            for low, high in stretches(count, 4) if count >= _LEAST_QUARTERED else ():
                mean = numbers[:, low:high].mean(axis=1)
                name = f"{place_called(variable)}s {low + 1} to {high} of {own}"
                found[name] = mean, "quarter", own, (low, high)
            for k, place in enumerate(place_names(variable)):
                found[f"{place} of {own}"] = numbers[:, k], "place", own, (k, k + 1)
    for name, (_, apart) in planes_apart(campaign).items():
        found[name] = apart, "difference", name, (0, 0)
    kept: dict[bytes, tuple[list[str], Array, str, tuple[int, int], list[str]]] = {}
    for name, (column, level, own, span) in found.items():
        if np.ptp(column) > 0:
            key = hashlib.blake2b(column.tobytes()).digest()
            names, *_, owners = kept.setdefault(key, ([], column, level, span, []))
            if own not in owners:  # the mean of one place is that place
                names.append(name)
                owners.append(own)
    count = campaign.sizes["sample"]
    values = np.array([column for _, column, *_ in kept.values()]).reshape(-1, count).T
    return Drawn(
        tuple(" and ".join(names) for names, *_ in kept.values()), values,
        tuple(level for _, _, level, *_ in kept.values()),
        tuple(owners[0] for *_, owners in kept.values()),
        tuple(span for _, _, _, span, _ in kept.values()),
    )  # fmt: skip


def planes_apart(campaign: xr.Dataset) -> dict[str, tuple[xr.DataArray, Array]]:
    """Absolute differences of the numbers drawn for the upper plane and for the lower one, whose
    paths differ in these words alone, shape (samples,), of many places those of their means; each
    with the upper variable, by a name as "difference of cables.upper/lower.winch.winding.speed".
    """
    variables = [campaign[name] for name in inputs(campaign) if campaign[name].dtype.kind in "fiu"]
    by_paths = {tuple(paths_of(each)): each for each in variables}
    found: dict[str, tuple[xr.DataArray, Array]] = {}
    for paths, upper in by_paths.items():
        lower = by_paths.get(tuple(_UPPER.sub("lower", path) for path in paths), upper)
        alike = upper.dims == lower.dims and upper.attrs.get("units") == lower.attrs.get("units")
        if lower is upper or not alike:
            continue
        high, low = (
            each.to_numpy().astype(float).reshape(len(each), -1).mean(axis=1)
            for each in (upper, lower)
        )
        # Where one never changes the difference is a V in the other alone, as its own index sees.
        arm = min(np.mean(high > low), np.mean(high < low)) if np.ptp(high) and np.ptp(low) else 0
        if arm >= _LEAST_ARM:
            names = called(upper), called(lower)
            both = _UPPER.sub("upper/lower", names[0])
            both = both if _UPPER.sub("lower", names[0]) == names[1] else " and ".join(names)
            name = f"{DIFFERENCE}{'the means of ' * (upper.ndim > 1)}{both}"
            found[name] = upper, np.abs(high - low)
    return found


_UPPER = re.compile(r"(?<![a-z])upper(?![a-z])")


def place_called(variable: xr.DataArray) -> str:
    """What a place of an input is, as "pulley": of "pulley_of_two_winches", too."""
    return str(variable.dims[1]).partition("_")[0]


def place_names(variable: xr.DataArray) -> list[str]:
    """Names of the places of an input: those of its coordinate if it has one, else "section 3"."""
    (dim,) = variable.dims[1:]
    for name, coordinate in variable.coords.items():
        if coordinate.dims == (dim,) and str(name).endswith("_name"):
            return [str(each) for each in coordinate.values]
    return [f"{place_called(variable)} {k + 1}" for k in range(variable.sizes[dim])]


# Opening what ringsim has stored: campaigns and runs, by folder or by file.


_MOST_ENTRIES = 10**9
"""Of a dimension: a file may claim to have more, and memory would be asked for all of them."""


def _require_codes(found: xr.Dataset, file: Path) -> None:
    """Refuse (InputError) statuses and outcomes that there are not."""
    kinds: dict[str, type[Code]] = {"status": Status, "outcome": Fate, "cause": Cause}
    kinds |= {f"{name}_checked": kind for name, kind in kinds.items()}
    for name, kind in kinds.items():
        if name not in found or found[name].dtype.kind not in "iuf":
            continue
        values = found[name].to_numpy().ravel()
        known = [NO_CODE, *(int(each) for each in kind)]
        wrong = values[np.isfinite(values) & ~np.isin(values, known)]
        if len(wrong):
            found.close()
            raise InputError(
                f"{file}: {name} holds {wrong[0]:g}, which is not a valid code (known: "
                f"{', '.join(map(str, known))}): the file is damaged, or another version of "
                "ringsim wrote it: merge the campaign, or run the scene, again"
            )


def open_stored(path: Path) -> xr.Dataset:
    """The dataset in a file, or of the campaign in a folder, loaded only as far as it is used.

    What has one value a sample is in memory at once, for it is used again and again; series stay
    in the file.
    InputError if there is none, or it is not merged yet; close it, or use it in ``with``.
    """
    file = path
    if path.is_dir():
        file = path / MERGED
        if not file.exists():
            inside = (path / DESIGN).exists()
            cure = f"there is no campaign in it: {campaign_cure(path)}"
            if inside and any(path.glob("journals/*")):
                cure = f"its results are not merged yet: run ringsim merge {path} first"
            elif inside:
                cure = "no sample has run yet: run ringsim campaign with the same file again"
            raise InputError(f"{path}: this folder holds no {MERGED}: {cure}")
    # Here, as in other files that runs load: it takes most of a second.
    from ringsim.dataset import in_order, open_lazily

    try:
        found = in_order(open_lazily(file))
        if (most := max(found.sizes.values(), default=0)) > _MOST_ENTRIES:
            found.close()
            raise InputError(
                f"{file}: a dimension has {most:,} entries, must be at most {_MOST_ENTRIES:,}: "
                "the file is damaged, or ringsim did not write it: merge the campaign, or run "
                "the scene, again"
            )
        for variable in found.variables.values():
            if len(variable.dims) < 2:
                variable.load()
    except FileNotFoundError:
        cure = "there is no such file or folder: check its name, and the folder that you are in"
        if file.name == MERGED and (file.parent / DESIGN).exists():
            cure = (
                f"not merged yet: run ringsim merge {file.parent} first (this also works while "
                "the campaign runs)"
            )
        raise InputError(f"{file}: {cure}") from None
    except (InputError, UnicodeEncodeError):  # the latter of the file's name, see ringsim.cli
        raise
    except (OSError, ValueError, RuntimeError) as error:
        if file.suffix == ".toml":
            raise InputError(
                f"{file}: this is an input file without results: give the folder that ringsim "
                "campaign has written (runs/NAME by default), or the file of ringsim run"
            ) from None
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{file}: cannot be read as a netCDF file: {reason}; give a file that ringsim has "
            "written"
        ) from None
    _require_codes(found, file)
    known_from(found.attrs)
    return found
