"""Requirements of a campaign: which values an antenna must keep to, how probably, how surely; and
when its samples are enough.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, Field, TypeAdapter, ValidationError, model_validator

from ringsim.analysis.intervals import (
    Mask,
    Twins,
    good,
    numbers,
    quantities,
    samples_needed,
    tells_of,
)
from ringsim.outputs import VARIABLES
from ringsim.outputs.balance import instead_of
from ringsim.refusal import InputError, explain, known_or_nearest, show
from ringsim.stepping.instant import Array
from ringsim.tables import counted, unit_text, with_unit
from ringsim.units import Model, UnitOf, in_unit
from ringsim.variables import Fate

if TYPE_CHECKING:
    import xarray as xr

    from ringsim.analysis.design import Placement

OUTCOME = "outcome"
_WORDS = [fate.word for fate in Fate if fate != Fate.NONE]


@dataclass(frozen=True)
class Kind:
    """A way of keeping to a bound, which is a field of ``Requirement``."""

    key: str
    """What campaign files call it."""
    sign: str
    beyond: Callable[[Array, Any], Array]
    """How far values are beyond a bound, shape (samples,): they violate it above 0."""
    of_words: bool = False
    """Whether the bound is a word, and the value the outcome."""


KINDS = (
    Kind("max", "<=", lambda values, bound: values - bound),
    Kind("min", ">=", lambda values, bound: bound - values),
    Kind("is", "is", lambda codes, word: 1.0 * (codes != Fate[word.upper()]), of_words=True),
)
"""A further one is a record here, and a field of ``Requirement``."""


def _unit_of_output(name: str) -> str:
    return unit_text(quantities()[name].units) or "1" if name in quantities() else "1"


_OF_OUTPUT = UnitOf(_unit_of_output)


class Requirement(Model):
    """What one output must be, with which probability, shown with which confidence."""

    usual: ClassVar = ("max", "probability", "confidence")
    max: Annotated[float | None, _OF_OUTPUT] = None
    """Largest value allowed, in the output's unit."""
    min: Annotated[float | None, _OF_OUTPUT] = None
    """Smallest value allowed, in the output's unit."""
    is_: Annotated[str | None, Field(alias="is")] = None
    """What the antenna must do; of the outcome alone."""
    probability: Annotated[float, Field(gt=0.0, lt=1.0)]
    """Share of all antennas, at least, that must keep to it."""
    confidence: Annotated[float, Field(ge=0.5, lt=1.0)]
    """Confidence of each one-sided bound of the probability: of a design that falls short of it at
    most 1 - confidence of all campaigns find it met."""

    @property
    def given(self) -> list[tuple[Kind, Any]]:
        """The bounds that it has, each with its kind."""
        fields = {field.alias or name: name for name, field in type(self).model_fields.items()}
        each = ((kind, getattr(self, fields[kind.key])) for kind in KINDS)
        return [(kind, bound) for kind, bound in each if bound is not None]

    @property
    def limits(self) -> list[tuple[str, float]]:
        """Bounds that are numbers by what files call them, the least first."""
        known = [(kind.key, float(bound)) for kind, bound in self.given if not kind.of_words]
        return sorted(known, key=lambda each: each[1])

    def told(self, name: str) -> str:
        """The requirement in words, with units."""
        units = quantities()[name].units if name in quantities() else "1"
        return f"{name} " + " and ".join(
            f"{kind.sign} {bound if kind.of_words else with_unit(f'{bound:g}', units)}"
            for kind, bound in self.given
        )

    def beyond(self, values: Array) -> Array:
        """How far values are beyond what is allowed, in their unit; NaN without a value."""
        each = [kind.beyond(values, bound) for kind, bound in self.given]
        return np.asarray(np.maximum.reduce(each))


def badness_of(name: str, *wanted: Mapping[str, Requirement]) -> int:
    """What values of an output are multiplied by so that the worst is the largest, 0 if neither end
    is worse: as the output says, or else by the one side on which something is required of it.

    >>> badness_of("prestress_energy"), badness_of("peak_tension")
    (0, 1)
    >>> low = Requirement(min=2.0, probability=0.9, confidence=0.9)
    >>> badness_of("prestress_energy", {"prestress_energy": low})
    -1
    """
    output = VARIABLES[name]
    sides = {key for each in wanted if name in each for key, _ in each[name].limits}
    if output.worse or len(sides) != 1:
        return output.badness
    return 1 if sides == {"max"} else -1


def doubt_of(name: str, keys: Sequence[str]) -> str:
    """Why bounds of an output are on the side on which nothing is wrong; empty if they are not."""
    worse = quantities()[name].worse if name in quantities() else ""
    meant = {("larger", "min"): "max", ("smaller", "max"): "min"}
    if len(keys) != 1 or (worse, keys[0]) not in meant:
        return ""
    return f"doubtful: {worse} values are the worse ones: is {meant[worse, keys[0]]} meant?"


def _check(requirements: dict[str, Requirement]) -> dict[str, Requirement]:
    """Refuse outputs that do not exist, and what their requirements cannot hold."""
    known = [OUTCOME, *quantities()]
    for name, each in requirements.items():
        if name not in known:
            why = f"is not an output that can have a requirement ({known_or_nearest(name, known)})"
            if name in VARIABLES and VARIABLES[name].dims:
                senses = {"max": "largest", "min": "least"}
                asked = [senses[key] for key, _ in each.limits if key in senses]
                raise ValueError(instead_of(name, *asked))
            raise ValueError(f"{name} {why}")
        if name == OUTCOME:
            if each.is_ not in _WORDS or each.limits:
                wrong = f"is = {show(each.is_)}" if each.is_ is not None else "is"
                hint = known_or_nearest(str(each.is_), _WORDS)
                raise ValueError(
                    f'{name}.{wrong} must be an outcome, for example is = "deployed", without '
                    f"max and min ({hint})"
                )
        elif each.is_ is not None:
            raise ValueError(
                f"{name}.is = {show(each.is_)}: only the requirement on outcome takes is; use "
                "max or min"
            )
        elif not each.given:
            unit = unit_text(quantities()[name].units)
            told = f", in {unit}" if unit else ""
            raise ValueError(f"{name} needs a bound: give max or min{told}")
        elif each.max is not None and each.min is not None and each.min >= each.max:
            raise ValueError(f"{name}.min = {each.min:g} must be below max = {each.max:g}")
    return requirements


Requirements = Annotated[dict[str, Requirement], AfterValidator(_check)]
"""Requirement by name of the output."""


class _Holder(Model):
    requirements: Requirements


def to_json(requirements: dict[str, Requirement]) -> str:
    """The text that files hold."""
    adapter = TypeAdapter(dict[str, Requirement])
    return adapter.dump_json(requirements, by_alias=True, exclude_none=True).decode()


def read_requirements(table: Mapping[str, Any], source: str) -> dict[str, Requirement]:
    """Requirements from a plain table; an InputError begins with ``source``."""
    try:
        return _Holder.model_validate({"requirements": dict(table)}).requirements
    except ValidationError as error:
        raise InputError(explain(error, _Holder, source)) from None


def required_by(attributes: Mapping[Any, Any]) -> dict[str, Requirement]:
    """The requirements that a design or a merged campaign keeps; none without any."""
    return read_requirements(json.loads(attributes.get("requirements", "{}")), "requirements")


def without_twins(
    campaign: xr.Dataset, names: Iterable[str], wanted: Collection[str] = ()
) -> list[str]:
    """Outputs of which none repeats another one in all samples, unless it is ``wanted`` or required
    by the campaign; of two those are left, or else those that are in summaries.
    """
    wanted, names = {*required_by(campaign.attrs), *wanted}, [*names]
    twins, held, known = Twins(), good(campaign), quantities()
    order = sorted(names, key=lambda name: (name not in wanted, known[name].summary is None))
    again = {name for name in order if twins.of(name, numbers(campaign, name)[held])}
    return [name for name in names if name not in again - wanted]


def parse_requirements(texts: Iterable[str]) -> dict[str, Requirement]:
    """Requirements from texts of the command line.

    >>> parse_requirements(["asynchrony_max: max 10, probability 0.99, confidence 0.9"])
    {'asynchrony_max': Requirement(max=10.0, min=None, is_=None, probability=0.99, confidence=0.9)}
    """
    table: dict[str, dict[str, Any]] = {}
    for text in texts:
        name, place, found, rest = re.match(_HEAD, text, re.DOTALL).groups()  # type: ignore[union-attr]
        parts = [re.fullmatch(_BOUND, part.strip()) for part in rest.split(",")]
        if not name or not found or None in parts:
            raise InputError(
                f"--require {show(text)}: must read NAME: KEY VALUE, KEY VALUE, ..., for example "
                '"asynchrony_max: max 10, probability 0.99, confidence 0.9" or "outcome: is '
                'deployed, probability 0.99, confidence 0.9"'
            )
        if name in table:
            raise InputError(f"--require {name} is given twice: leave out one of the two")
        # First of what may be wrong: with another output other bounds make sense.
        if (many := bool(name in VARIABLES and VARIABLES[name].dims)) or place:
            cure = instead_of(name) if many else f"a sample has one value: leave out {place}"
            raise InputError(f"--require {name}{place or ''}: {cure}")
        keys = [part[1] for part in parts if part]
        for key in keys:
            if keys.count(key) > 1:
                raise InputError(
                    f"--require {name}: {key} is given twice: leave out one of the two"
                )
        table[name] = {part[1]: _told(name, part[1], part[2], part[3]) for part in parts if part}
    return read_requirements(table, "--require")


_HEAD = r"\s*(\w*)(\[[^\]]*\])?\s*([:=]?)(.*)"
"""The name of an output, perhaps a place in it, and what is required."""
_BOUND = r"(\w+)(?:\s*=\s*|\s+)(\S+)(?:\s+(\S.*))?"
"""A key, its value, and for a bound perhaps its unit."""


def _told(name: str, key: str, word: str, unit: str | None) -> Any:
    """A value in the output's unit, from one in any unit of its kind; InputError for another."""
    value = _value(word)
    if unit is None or name not in quantities():
        return value
    own, unit = quantities()[name].units, " ".join(unit.split())
    written, wanted = (re.sub(r"\bdegrees?\b", "deg", each) for each in (unit, own))
    if key in ("max", "min") and isinstance(value, float):
        found = value if written == wanted else in_unit(value, written, wanted)
        if found is not None:
            return found
    cure = f"in {own}" if unit_text(own) else "as a number without a unit"
    cure = cure if key in ("max", "min") else "without a unit"
    raise InputError(f"--require {name}: {key} = {word} {unit}: give it {cure}")


def _value(word: str) -> Any:
    try:
        return float(word)
    except ValueError:
        return word.strip("\"'")


COUNTS = ("locked_joints", "latched_joints")
"""Outputs that count the V-joints of an antenna."""
MARGINS = tuple(f"least_{of}_margin{end}" for of in ("drive", "plane") for end in ("", "_started"))
"""Outputs that are static margins of a rigid ring."""


def beyond_joints(name: str, wanted: Requirement, joints: int) -> str:
    """What is wrong with a requirement that asks for more V-joints than there are; or empty."""
    if name not in COUNTS or wanted.min is None or wanted.min <= joints:
        return ""
    return (
        f"{name}.min = {wanted.min:g}: must be at most {joints}, the V-joints of this scene: no "
        "sample could keep to it"
    )


def violations(campaign: xr.Dataset, name: str, wanted: Requirement) -> Mask:
    """Which samples violate a requirement, of those that have numbers that hold.

    One without a value violates it: an antenna that never deploys has no deployment time.
    """
    return np.asarray(good(campaign) & ~(wanted.beyond(numbers(campaign, name)) <= 0.0))


def require_values(campaign: xr.Dataset, name: str, wanted: Requirement) -> None:
    """Refuse (InputError) an output that the runs do not compute, and more V-joints than they have:
    the requirement would seem violated.
    """
    if name not in campaign and not good(campaign).any():
        raise InputError(f"requirement on {name}: no sample has numbers that hold yet")
    if name not in campaign:
        known = [OUTCOME, *(each for each in quantities() if each in campaign)]
        raise InputError(
            f"requirement on {name}: the file has no such output ({known_or_nearest(name, known)})"
        )
    none = np.flatnonzero(good(campaign) & ~tells_of(campaign, name))
    if name != OUTCOME and len(none):
        raise InputError(
            f"requirement on {name}: {counted(len(none), 'sample')} reached the goal without a "
            f"value of it, first sample {campaign['sample'].to_numpy()[none[0]]}: this fidelity "
            'does not compute it; set the requirement on another output, or use fidelity = "full"'
        )
    joints = campaign.sizes.get("plane", 0) * campaign.sizes.get("section", 0)
    if joints and (wrong := beyond_joints(name, wanted, joints)):
        raise InputError(f"requirement on {wrong}")


# When a campaign may stop: the conditions, the looks at them, and how looks share an error.
#
# A bound that is computed again and again until it pleases holds less often than it says.  What a
# requirement allows for error, one minus its confidence, is therefore shared by all looks at it:
# the j-th gets its part 1 / (j (j + 1)), and all of them together no more than the whole.


Levels = tuple[float, float]
"""Confidence of the lower and of the upper bound of a probability."""


class Condition(Model):
    """A requirement whose verdict is certain, or an output whose interval is short enough."""

    requirement: str | None = None
    """Name under [requirements]: holds once its verdict is met or not met."""
    of: str | None = None
    """Output whose mean, or ``quantile``, is to have an interval of 95 % of ``half_width``."""
    quantile: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Probability below the quantile; the mean without it."""
    half_width: Annotated[float, Field(gt=0.0)] | None = None
    """Half the length of the interval, at most, in the output's unit."""

    @model_validator(mode="after")
    def _one_of_two(self) -> Condition:
        if (self.requirement is None) == (self.of is None):
            raise ValueError(
                "needs either { requirement = NAME } or { of = NAME, half_width = VALUE }"
            )
        if self.of is None and (self.quantile is not None or self.half_width is not None):
            raise ValueError(
                "quantile and half_width go with of = NAME, not with requirement, which has its "
                "own confidence: leave them out"
            )
        if self.of is not None and self.half_width is None:
            raise ValueError(f"of = {self.of} needs half_width, in the unit of that output")
        if self.of in VARIABLES and VARIABLES[self.of].dims:
            raise ValueError(f"of = {instead_of(self.of)}")
        if self.of is not None and self.of not in quantities():
            hint = known_or_nearest(self.of, quantities())
            raise ValueError(f"of = {self.of} is not an output with an interval ({hint})")
        return self

    @property
    def what(self) -> str:
        """What is to be known precisely, in words."""
        return f"mean of {self.of}" if self.quantile is None else f"{self.quantile} of {self.of}"


class Looks(Model):
    """Numbers of samples after which the conditions are checked, fixed in advance."""

    first: Annotated[int, Field(ge=8, le=10_000_000)] = 64
    """Samples at the first check."""
    growth: Annotated[float, Field(ge=1.1, le=10.0)] = 1.5
    """Samples at a check over those at the one before."""

    def numbers(self, replicates: int = 1) -> Iterator[int]:
        """Samples at each look, without end; whole replicates of a design.

        >>> numbers = Looks().numbers()
        >>> [next(numbers) for _ in range(5)]
        [64, 96, 144, 216, 324]
        """
        count = self.first
        while True:
            yield -(-count // replicates) * replicates
            count = max(math.ceil(count * self.growth), count + replicates)


def as_list(given: Any) -> Any:
    """A list of what may be given alone."""
    return [given] if isinstance(given, dict) else given


class Rule(Model):
    """All conditions, which must hold at the same check, and when they are checked."""

    conditions: list[Condition]
    looks: Looks = Looks()

    def numbers(self, most: int, replicates: int = 1) -> list[int]:
        """Samples at all looks before the last sample of ``most``."""
        return list(takewhile(lambda count: count < most, self.looks.numbers(replicates)))

    def judges(self, name: str) -> bool:
        """Whether a requirement is among the conditions."""
        return name in [each.requirement for each in self.conditions]

    def levels(self, name: str, wanted: Requirement, samples: int, replicates: int = 1) -> Levels:
        """Confidence of both bounds of a requirement after so many samples.

        A part of the error goes to each look at which a verdict is possible: not to those with
        fewer samples than "met" takes without a violation.  Those of one look without the rule.
        """
        if not self.judges(name):
            return wanted.confidence, wanted.confidence
        needed = samples_needed(0, wanted.probability, wanted.confidence)
        # A campaign that ends between two looks has the part of the one to come.
        upper = [*self.numbers(samples, replicates), samples]
        lower = [count for count in upper[:-1] if count >= needed] + [samples]
        return _part(wanted.confidence, len(lower)), _part(wanted.confidence, len(upper))

    def further_samples(
        self, name: str, wanted: Requirement, samples: int, violations: int, replicates: int = 1
    ) -> int:
        """How many samples without a violation after so many would show it at a look."""
        least = samples_needed(violations, wanted.probability, wanted.confidence)
        for count in self.looks.numbers(replicates):
            if count > samples and count >= least:
                confidence = self.levels(name, wanted, count, replicates)[0]
                if count >= samples_needed(violations, wanted.probability, confidence):
                    return count - samples
        raise AssertionError("looks have no end")


def _part(confidence: float, number: int) -> float:
    """The confidence left of one when the error of the looks' sum is that of another.

    >>> _part(0.9, 1), round(_part(0.9, 2), 4)
    (0.95, 0.9833)
    """
    return 1.0 - (1.0 - confidence) / (number * (number + 1))


def rule_of(attributes: Mapping[Any, Any]) -> Rule | None:
    """The rule that a design or a merged campaign keeps as ``stop_when``; None without one."""
    stored = json.loads(str(attributes.get("stop_when", "null")))
    return None if stored is None else Rule.model_validate(stored)


# What became of the rule by which a campaign may end early.


def half_width(condition: Condition, campaign: xr.Dataset, placed: Placement) -> float:
    """Half the length of the interval of a mean or a quantile; NaN if there is none."""
    values = numbers(campaign, str(condition.of))
    known = good(campaign) & np.isfinite(values)
    of = np.mean if condition.quantile is None else condition.quantile
    low, high = placed.interval(values[known], campaign["sample"].to_numpy()[known], of)
    return (high - low) / 2


def _samples_of(campaign: xr.Dataset) -> int:
    """Samples of the whole merged campaign, of which there may be a selection."""
    says = campaign.attrs
    every = says.get("stopped_after", says.get("planned_samples", campaign.sizes["sample"]))
    return int(every)


def looked_at(campaign: xr.Dataset) -> int:
    """Samples up to which a campaign's rule has looked: those that have run, and of a selection
    those of the whole campaign.
    """
    every, run = _samples_of(campaign), int((campaign["status"].to_numpy() >= 0).sum())
    return every if campaign.sizes["sample"] < every else run


def stopping_lines(campaign: xr.Dataset, placed: Placement) -> list[str]:
    """What became of the rule of a merged campaign, a line; none if it has none."""
    says = campaign.attrs
    if (rule := rule_of(says)) is None:
        return []
    count, most = _samples_of(campaign), int(says.get("planned_samples", 0))
    if "stopped_after" in says:
        taken = [*rule.numbers(count, placed.replicates), count]
        first = f"stop_when ended the campaign after {count} of at most {most} samples, because "
        first += str(says["stop_reason"])
    else:
        taken = rule.numbers(count, placed.replicates)
        first = f"stop_when did not end the campaign of {count} samples"
    looks = f"{counted(len(taken), 'look')}: {', '.join(map(str, taken))}" if taken else "no look"
    kept = []
    if any(each.requirement for each in rule.conditions):
        kept.append("the bounds of its requirements allow for these repeated checks")
    kept.append("the other intervals do not")
    return [f"{first} ({looks}); {', '.join(kept)}"]
