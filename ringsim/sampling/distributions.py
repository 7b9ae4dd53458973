"""Distributions of inputs, and their values in arrays and in words."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.choice import OneOf, kind_of
from ringsim.overrides import section_of
from ringsim.refusal import InputError, show
from ringsim.scene import Scene
from ringsim.tables import number_text
from ringsim.units import ListIn, Model

# Values of inputs: numbers, words, whole tables and lists of them, in arrays and in words.


Values = NDArray[Any]
"""Numbers, words, true and false; of dtype object where they are mixed, tables or lists."""

_ICE = 273.15
"""0 C in K."""
_WORD = re.compile(r"(?!(true|false|inf|nan)$)[^\W\d_][\w .:/+-]*(?<! )")
"""Texts that need no quotes in a label: others might read as several values, or as a number."""

_ALIKE: tuple[tuple[type, ...], ...] = ((bool,), (int,), (int, float), (str,))


def array_of(values: Sequence[Any]) -> Values:
    """One entry for each value, of the narrowest type that holds them unchanged.

    >>> array_of([1, 2.5]).tolist(), array_of([5.0, "none"]).tolist()
    ([1.0, 2.5], [5.0, 'none'])
    """
    if any(all(type(value) in kinds for value in values) for kinds in _ALIKE):
        return np.array(values)
    # Entry by entry: numpy would take lists apart and turn numbers beside words into words.
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def plain(entry: Any) -> Any:
    """An entry or row of an array as TOML would give it."""
    return entry.tolist() if isinstance(entry, (np.generic, np.ndarray)) else entry


def label_of(value: Any) -> str:
    """A value in a few words, the same ones for equal values and others for others.

    Lists of tables, as of faults, have no brackets: no field takes both a table and a list of one,
    and an empty list is what "none" gives.

    >>> label_of([{"kind": "stall", "max_tension": 20.0}]), label_of([]), label_of([5.0, "x"])
    ('stall(max_tension=20.0)', 'none', '[5.0, x]')
    """
    match value:
        case list() | tuple() if value and all(isinstance(each, dict) for each in value):
            return ", ".join(map(_part, value))
        case list() | tuple() if not value:
            return "none"
        case _:
            return _part(value)


def _part(value: Any) -> str:
    match value:
        case dict():
            parts = {key: _part(value[key]) for key in sorted(value)}
            kind = parts.pop("kind", "")
            return f"{kind}({', '.join(f'{_part(key)}={part}' for key, part in parts.items())})"
        case list() | tuple():
            return f"[{', '.join(map(_part, value))}]"
        case bool():
            return str(value).lower()
        case str() if not _WORD.fullmatch(value):
            return json.dumps(value)
        case _:
            return str(value)


def labels_of(values: Values) -> Values:
    """The labels of all values, same shape."""
    labels: Values = np.array([label_of(plain(each)) for each in values.ravel()], dtype=str)
    return labels.reshape(values.shape)


def extremes_of(values: Values) -> set[int]:
    """Samples, along the first axis, with the least and the greatest number and each other value.

    >>> sorted(extremes_of(array_of([2.0, "none", 3.0, 1.0, "none"])))
    [1, 2, 3]
    """
    width, flat = values[0].size if values.ndim > 1 else 1, values.ravel()
    if flat.dtype.kind in "iuf":
        return {int(flat.argmin()) // width, int(flat.argmax()) // width}
    # Beside words numbers are many, and only their ends tell anything.
    numbers = [float(v) if type(v) in (int, float) else np.nan for v in map(plain, flat)]
    words = np.flatnonzero(~np.isfinite(numbers))
    found = set(words[np.unique(labels_of(flat[words]), return_index=True)[1]].tolist())
    if np.isfinite(numbers).any():
        found |= {int(np.nanargmin(numbers)), int(np.nanargmax(numbers))}
    return {int(k) // width for k in found}


def is_label(name: str) -> bool:
    """Whether a column of that name can only tell samples apart, as no scene has such a field."""
    return "." not in name and section_of(name)[0] not in Scene.model_fields


# The family of distributions: each one maps probabilities to values of an input.


Array = NDArray[np.float64]


class Distribution(Model):
    """Distribution of one scene field, in the field's own unit."""

    each_section: bool = False
    """Draw one independent value for every section instead of one for all."""
    shared: Annotated[tuple[str, ...], ListIn] = ()
    """Scene paths that all take the value drawn; the key of the input is then only its name."""
    unit: Annotated[str, Field(pattern=r"^\S(.{0,20}\S)?$")] | None = None
    """Unit of an input that is no scene path, as others follow it: the scene knows the others'."""

    @property
    def follows(self) -> str:
        """The input that decides about its values; empty if they are drawn."""
        return ""

    def quantile(self, probability: Array) -> Values:
        """Values at cumulative probabilities in the open interval (0, 1), same shape."""
        raise NotImplementedError

    def values_at(self, name: str, given: Values) -> Array:
        """Values of an input ``name`` that follows another, at the values of that one."""
        raise NotImplementedError

    def levels(self, count: int) -> Array:
        """Probabilities of ``count`` grid points: middles of intervals of equal probability."""
        return (np.arange(count) + 0.5) / count

    def log_density(self, values: Values) -> Array:
        """Logarithm of the density, or of the probability of each value; -inf where there is none.

        TypeError for what is no value of this kind of distribution, InputError if it is not known.
        """
        raise InputError(_LACKS.format(show(kind_of(self)), "log_density(values)"))

    def probability(self, value: float) -> float:
        """Cumulative probability of ``value``; InputError if there is none, or it is not known."""
        raise InputError(_LACKS.format(show(kind_of(self)), "probability(value)"))


_LACKS = "kind {} has no {}, which this needs: write it in its class, derived from Continuous"


class Ranged(Distribution):
    """A distribution over an interval of real numbers, cut off or not."""

    def of_normal(self, normal: Array) -> Values:
        """Values at the same probabilities as those of a standard normal variable, same shape."""
        return self.quantile(inside(scipy.special.ndtr(normal)))

    def to_normal(self, values: Array) -> Array:
        """The standard normal variable at the same probabilities as values, same shape."""
        shares = np.array([self.probability(float(value)) for value in np.ravel(values)])
        return np.asarray(scipy.special.ndtri(inside(shares)).reshape(np.shape(values)))


class Continuous(Ranged):
    """A distribution over an interval of real numbers as it is."""


def inside(probability: Array) -> Array:
    """Probabilities moved off the ends 0 and 1, where quantiles may be infinite."""
    return np.clip(probability, 2.0**-54, 1.0 - 2.0**-53)


class Discrete(Distribution):
    """Each of the values with its probability; all alike if none are given.

    >>> rods = Discrete(values=("soft", "stiff"), probabilities=(0.3, 0.7))
    >>> rods.quantile(np.array([0.2, 0.4])).tolist()
    ['soft', 'stiff']
    """

    kind: Literal["discrete"] = "discrete"
    values: Annotated[tuple[Any, ...], ListIn]
    """Numbers, words, true and false, whole tables or lists of them, mixed as the field allows."""
    probabilities: Annotated[tuple[Annotated[float, Field(gt=0.0)], ...] | None, ListIn] = None
    """One for each value, which add up to 1; left out, all alike."""

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        if not self.values:
            raise ValueError("values must hold at least one value")
        for number, value in enumerate(self.values, 1):
            try:
                json.dumps(value, allow_nan=False)  # as files will hold it
            except (TypeError, ValueError):
                raise ValueError(
                    f"values[{number}] = {show(value)} must be a finite number, text, true or "
                    "false, a table, or a list of these"
                ) from None
        if len(set(labels_of(array_of(self.values)).tolist())) < len(self.values):
            raise ValueError(f"values = {show(self.values)} must differ from each other")
        if self.probabilities is not None:
            if len(self.probabilities) != len(self.values):
                raise ValueError(
                    f"probabilities has {len(self.probabilities)} entries and must have "
                    f"{len(self.values)}, one for each of the values"
                )
            if abs(sum(self.probabilities) - 1.0) > 1e-9:
                raise ValueError(
                    f"probabilities add up to {sum(self.probabilities):g} and must add up to 1"
                )
        return self

    @property
    def shares(self) -> tuple[float, ...]:
        """The probability of each of the values."""
        return self.probabilities or (1.0 / len(self.values),) * len(self.values)

    def quantile(self, probability: Array) -> Values:
        """The value whose interval of cumulative probability holds the given one."""
        chosen = np.searchsorted(np.cumsum(self.shares)[:-1], probability, side="right")
        return np.asarray(array_of(self.values)[chosen])

    def log_density(self, values: Values) -> Array:
        """Logarithm of the probability of each value; of words and tables also by their labels."""
        known: dict[Any, float] = {}
        for value, share in zip(self.values, self.shares, strict=True):
            number = type(value) in (int, float)
            known |= {label_of(value): share, str(value): share}
            known |= {float(value): share} if number else {}
        plainly = (plain(each) for each in np.ravel(values))
        keys = (float(v) if type(v) in (int, float) else v for v in plainly)
        found = [known.get(k if isinstance(k, (str, float)) else label_of(k), 0.0) for k in keys]
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(np.array(found)).reshape(np.shape(values)))

    def levels(self, count: int) -> Array:
        """One probability for each value, whatever ``count`` is: the middle of its interval."""
        upper = np.cumsum(self.shares)
        return np.asarray(0.5 * (upper + np.concatenate([[0.0], upper[:-1]])))


class Normal(Continuous):
    """Density exp(-(x - mean)^2 / (2 s^2)) / (s sqrt(2 pi)), s the standard deviation.

    >>> Normal(mean=120e9, standard_deviation=6e9).quantile([0.5]).tolist()
    [120000000000.0]
    """

    kind: Literal["normal"] = "normal"
    mean: float
    """Mean of the values, in the unit of the input."""
    standard_deviation: Annotated[float, Field(gt=0.0)]
    """Standard deviation, in the unit of the input."""

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution."""
        return self.of_normal(scipy.special.ndtri(probability))

    def of_normal(self, normal: Array) -> Array:
        """Also far out in the tails, where no probability tells values apart."""
        return np.asarray(self.mean + self.standard_deviation * normal)

    def to_normal(self, values: Array) -> Array:
        """The same, backwards."""
        return (np.asarray(values, dtype=float) - self.mean) / self.standard_deviation

    def log_density(self, values: Values) -> Array:
        """Logarithm of the density above."""
        scaled = (np.asarray(values, dtype=float) - self.mean) / self.standard_deviation
        return np.asarray(
            -0.5 * scaled**2 - math.log(self.standard_deviation * math.sqrt(2 * math.pi))
        )

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return float(scipy.special.ndtr((value - self.mean) / self.standard_deviation))


class Lognormal(Continuous):
    """ln x is normal; mean and standard deviation are those of x itself.

    Variance of ln x: ln(1 + (s / mean)^2); mean of ln x: ln(mean) minus half of that.

    >>> Lognormal(mean=1.0, standard_deviation=0.2).quantile([0.5]).round(4).tolist()
    [0.9806]
    """

    kind: Literal["lognormal"] = "lognormal"
    mean: Annotated[float, Field(gt=0.0)]
    """Mean of the values themselves, in the unit of the input."""
    standard_deviation: Annotated[float, Field(gt=0.0)]
    """Standard deviation of the values themselves, in the unit of the input."""

    @property
    def _logarithm(self) -> Normal:
        # ln(1 + x) = ln(x) to the last digit where x, a square, may overflow.
        ratio = math.log(self.standard_deviation) - math.log(self.mean)
        if ratio < 20.0:
            deviation = math.sqrt(math.log1p((self.standard_deviation / self.mean) ** 2))
        else:
            deviation = math.sqrt(2.0 * ratio)
        mean = math.log(self.mean) - 0.5 * deviation**2
        return Normal.model_construct(mean=mean, standard_deviation=deviation)

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution."""
        return np.exp(self._logarithm.quantile(probability))

    def of_normal(self, normal: Array) -> Array:
        """Also far out in the tails, where no probability tells values apart."""
        return np.exp(self._logarithm.of_normal(normal))

    def to_normal(self, values: Array) -> Array:
        """The same, backwards; -infinity for what is not above 0."""
        known = np.asarray(values, dtype=float)
        with np.errstate(divide="ignore"):
            return self._logarithm.to_normal(np.log(np.maximum(known, 0.0)))

    def log_density(self, values: Values) -> Array:
        """That of ln x, less ln x."""
        known = np.asarray(values, dtype=float)
        logarithm = np.log(np.where(known > 0.0, known, 1.0))
        found = self._logarithm.log_density(logarithm) - logarithm
        return np.where(known > 0.0, found, -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return self._logarithm.probability(math.log(value)) if value > 0.0 else 0.0


LEAST_MASS = 1e-6
"""Probability between the bounds, at least: less is a mistake in the bounds."""


class Truncated(Ranged):
    """The distribution ``of``, given that its value lies between ``low`` and ``high``.

    >>> from ringsim.sampling.distributions import Normal
    >>> force = Truncated(of=Normal(mean=0.015, standard_deviation=0.002), low=0.015)
    >>> force.quantile(np.array([0.0])).tolist()
    [0.015]
    """

    kind: Literal["truncated"] = "truncated"
    of: Annotated[Continuous, OneOf()]
    """Distribution that is cut off."""
    low: float | None = None
    """Smallest value; left out, no lower bound."""
    high: float | None = None
    """Largest value; left out, no upper bound."""

    @model_validator(mode="after")
    def _some_mass(self) -> Self:
        if self.low is None and self.high is None:
            raise ValueError("truncated needs low, high or both; without them use the kind in of")
        for name in ("each_section", "shared"):
            if getattr(self.of, name):
                raise ValueError(f"of.{name} must be given beside kind, not inside of")
        below, above = self._ends()
        if above < below:
            raise ValueError(f"low = {self.low} must be below high = {self.high}")
        if above - below < LEAST_MASS:
            mass = f"a probability of {above - below:.1e}, must be at least {LEAST_MASS:g}"
            ends = f"low = {self.low}, high = {self.high}"
            raise ValueError(f"{ends} keep only {mass}: widen the bounds or move the mean")
        return self

    def _ends(self) -> tuple[float, float]:
        below = 0.0 if self.low is None else self.of.probability(self.low)
        above = 1.0 if self.high is None else self.of.probability(self.high)
        return below, above

    def log_density(self, values: Values) -> Array:
        """That of the whole distribution over what the bounds keep of it."""
        below, above = self._ends()
        low = -np.inf if self.low is None else self.low
        high = np.inf if self.high is None else self.high
        found = self.of.log_density(values) - np.log(above - below)
        return np.where((values >= low) & (values <= high), found, -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative probability of ``value``."""
        below, above = self._ends()
        return float(np.clip((self.of.probability(value) - below) / (above - below), 0.0, 1.0))

    def quantile(self, probability: Array) -> Values:
        """Inverse of the cumulative distribution, inside the bounds to the bit."""
        below, above = self._ends()
        values = self.of.quantile(below + (above - below) * probability)
        return np.asarray(np.clip(values, self.low, self.high))


class Calibrated(Distribution):
    """A distribution moved and narrowed by measured data, as ``ringsim calibrate`` finds it.

    With F that of ``of``: x = F^-1(Phi(shift + remaining_scatter u)) of a standard normal u.

    >>> force = Calibrated(of=Normal(mean=2.0, standard_deviation=1.0), shift=0.5,
    ...                    remaining_scatter=0.1)
    >>> force.quantile(np.array([0.5])).round(9).tolist()
    [2.5]
    """

    kind: Literal["calibrated"] = "calibrated"
    of: Annotated[Ranged, OneOf()]
    """Distribution before the data: the prior."""
    shift: Annotated[float, Field(ge=-1e6, le=1e6)]
    """Of the underlying standard normal variable: how many standard deviations it has moved."""
    remaining_scatter: Annotated[float, Field(gt=0.0, le=100.0)]
    """Of the same: what is left of the scatter, 1 where the data say nothing."""
    data: str = ""
    """The test that it was learnt from."""

    @model_validator(mode="after")
    def _bare(self) -> Self:
        if self.of.each_section or self.of.shared:
            raise ValueError("of: give each_section and shared beside kind, not inside of")
        return self

    def quantile(self, probability: Array) -> Values:
        """Inverse of the cumulative distribution."""
        return self.of_normal(scipy.special.ndtri(probability))

    def of_normal(self, normal: Array) -> Values:
        """Values where a standard normal variable is, same shape."""
        return self.of.of_normal(self.shift + self.remaining_scatter * normal)

    def log_density(self, values: Values) -> Array:
        """That of ``of``, times the ratio of both normal densities at the value's place."""
        at = self.of.to_normal(values)
        scaled = (at - self.shift) / self.remaining_scatter
        ratio = 0.5 * (at**2 - scaled**2) - math.log(self.remaining_scatter)
        return np.asarray(self.of.log_density(values) + ratio)

    def probability(self, value: float) -> float:
        """Cumulative probability of ``value``."""
        at = self.of.to_normal(np.array(value))
        return float(scipy.special.ndtr((at - self.shift) / self.remaining_scatter))


class Uniform(Continuous):
    """Constant density between low and high.

    >>> Uniform(low=1.0, high=3.0).quantile(np.array([0.0, 0.25, 1.0])).tolist()
    [1.0, 1.5, 3.0]
    """

    kind: Literal["uniform"] = "uniform"
    low: float
    """Smallest value."""
    high: float
    """Largest value."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"low = {self.low} must be below high = {self.high}")
        return self

    def quantile(self, probability: Array) -> Array:
        """Inverse of the cumulative distribution; its ends are low and high to the bit."""
        return self.low * (1.0 - probability) + self.high * probability

    def levels(self, count: int) -> Array:
        """From end to end: both are values that can occur."""
        return np.linspace(0.0, 1.0, count) if count > 1 else super().levels(count)

    def log_density(self, values: Values) -> Array:
        """Of a constant density."""
        within = (values >= self.low) & (values <= self.high)
        return np.where(within, -np.log(self.high - self.low), -np.inf)

    def probability(self, value: float) -> float:
        """Cumulative distribution."""
        return float(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0))


class Function(Distribution):
    """What another input decides: a motor's torque by its temperature, a friction by its lot.

    >>> lot = Function(input="lot", table=[["A", 0.1], ["B", 0.3]])
    >>> lot.values_at("friction", np.array(["B", "A"])).tolist()
    [0.3, 0.1]
    """

    kind: Literal["function"] = "function"
    input: str
    """The input that it follows: its path, or a name of yours that no path has."""
    table: Annotated[list[tuple[float | str, float]], Field(min_length=2)]
    """Pairs of a value of that input and the value here: linear between increasing numbers, or one
    for each word."""

    @model_validator(mode="before")
    @classmethod
    def _pairs(cls, given: Any) -> Any:
        if isinstance(given, dict) and isinstance(rows := given.get("table"), list):
            pairs = [tuple(row) if isinstance(row, list) else row for row in rows]
            return given | {"table": pairs}
        return given

    @model_validator(mode="after")
    def _usable(self) -> Self:
        keys = [key for key, _ in self.table]
        words = [isinstance(key, str) for key in keys]
        if any(words) != all(words):
            raise ValueError("table: values of the input must be all words, or all numbers")
        if all(words) and len(set(keys)) < len(keys):
            raise ValueError("table: a word stands there twice: leave out one of the rows")
        if not any(words) and (np.diff(np.array(keys, dtype=float)) <= 0.0).any():
            raise ValueError("table: values of the input must increase from row to row")
        if self.shared:
            raise ValueError("shared: give each path a function of its own")
        return self

    @property
    def follows(self) -> str:
        """The input."""
        return self.input

    def values_at(self, name: str, given: Values) -> Array:
        """By the table, same shape; InputError if it does not go so far."""
        keys, values = zip(*self.table, strict=True)
        if isinstance(keys[0], str) != (given.dtype.kind not in "iuf"):
            what = "words" if isinstance(keys[0], str) else "numbers"
            raise InputError(
                f"inputs: {name}: its table is of {what}, and {self.input} is not: give the values "
                "of that input in the first column"
            )
        if isinstance(keys[0], str):
            known = dict(self.table)
            unknown = sorted({str(word) for word in given.ravel()} - known.keys())
            if unknown:
                raise InputError(
                    f"inputs: {name}: its table has no row for {show(unknown[0])}, a value of "
                    f"{self.input}: add one"
                )
            found = [known[str(word)] for word in given.ravel()]
            return np.reshape(np.array(found, dtype=float), given.shape)
        low, high = float(keys[0]), float(keys[-1])
        if given.min() < low or given.max() > high:
            ends = float(given.min()), float(given.max())
            cure = "add rows, or truncate that input"
            if low <= ends[0] + _ICE and ends[1] + _ICE <= high:
                cure += f"; if that is in C, it is {ends[0] + _ICE:g} to {ends[1] + _ICE:g} K"
            raise InputError(
                f"inputs: {name}: {self.input} is drawn from {ends[0]:g} to {ends[1]:g}, and the "
                f"table goes from {low:g} to {high:g}: {cure}"
            )
        return np.asarray(np.interp(given, np.array(keys, dtype=float), values))


def law_text(says: Mapping[str, Any], most: int = 600) -> str:
    """A distribution in words: its kind, and its parameters without those that place it.

    >>> law_text({"kind": "uniform", "each_section": False, "low": 0.7, "high": 1.0})
    'uniform, low 0.7, high 1'
    >>> law_text({"kind": "truncated", "high": 5.0, "of": {"kind": "exponential", "mean": 2.0}})
    'truncated, high 5, of (exponential, mean 2)'
    >>> law_text({"kind": "calibrated", "of": {"kind": "normal", "mean": 2.0,
    ...           "standard_deviation": 1.0}, "shift": 0.5, "remaining_scatter": 0.1, "data": "A"})
    'median 2.5, 90 % in 2.336 .. 2.664 after A (before: normal, mean 2, standard deviation 1)'
    """
    own = {
        key: value for key, value in says.items() if key not in ("shared", "each_section", "unit")
    }
    if own.get("kind") == "calibrated":  # its numbers are those of a standard normal variable
        low, median, high = Calibrated.model_validate(own).quantile(np.array([0.05, 0.5, 0.95]))
        return (
            f"median {number_text(median)}, 90 % in {number_text(low)} .. {number_text(high)} "
            f"after {own.get('data') or 'a test'} (before: {law_text(own['of'])})"
        )
    kind = str(own.pop("kind", own.pop("text", "")))
    if kind == "function":
        pairs = (f"{y:g} at {x}" if isinstance(x, str) else f"{y:g} at {x:g}"
                 for x, y in own["table"])  # fmt: skip
        return f"follows {own['input']}: {', '.join(pairs)}"

    def told(value: Any) -> str:
        if isinstance(value, Mapping):
            return f"({law_text(value, most)})"
        # So many characters hold all of a few faults, of which a time may differ.
        return number_text(value, 5) if isinstance(value, float) else show(value, most)

    parts = (f"{key.replace('_', ' ')} {told(value)}" for key, value in own.items())
    return ", ".join([kind, *parts])
