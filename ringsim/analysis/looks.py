"""When a campaign may stop: the conditions, the looks at them, and how looks share an error.

A bound that is computed again and again until it pleases holds less often than it says.  What a
requirement allows for error, one minus its confidence, is therefore shared by all looks at it: the
j-th gets its part 1 / (j (j + 1)), and all of them together no more than the whole.
"""

import json
import math
from collections.abc import Iterator, Mapping
from itertools import takewhile
from typing import Annotated, Any

from pydantic import Field, model_validator

from ringsim.analysis.quantities import quantities
from ringsim.analysis.requirements import Requirement
from ringsim.outputs import VARIABLES
from ringsim.outputs.extremes import instead_of
from ringsim.refusal import known_or_nearest
from ringsim.units import Model

Levels = tuple[float, float]
"""Confidence of the lower and of the upper bound of a probability."""


class Condition(Model):
    """A requirement on which the samples decide, or an output that is known precisely enough."""

    requirement: str | None = None
    """Name under [requirements]: holds once that is met, or not met."""
    of: str | None = None
    """Output whose mean, or ``quantile``, is to have an interval of 95 % of ``half_width``."""
    quantile: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Probability below the quantile; the mean without it."""
    half_width: Annotated[float, Field(gt=0.0)] | None = None
    """Half the length of the interval, at most, in the output's unit."""

    @model_validator(mode="after")
    def _one_of_two(self) -> "Condition":
        if (self.requirement is None) == (self.of is None):
            raise ValueError(
                "needs either requirement, as { requirement = NAME }, or of, as { of = NAME, "
                "half_width = VALUE }"
            )
        if self.of is None and (self.quantile is not None or self.half_width is not None):
            raise ValueError(
                "quantile and half_width belong to of = NAME, and a requirement has its own "
                "confidence: leave them out"
            )
        if self.of is not None and self.half_width is None:
            raise ValueError(f"of = {self.of} needs half_width, in the unit of that output")
        if self.of in VARIABLES and VARIABLES[self.of].dims:
            raise ValueError(f"of = {instead_of(self.of)}")
        if self.of is not None and self.of not in quantities():
            hint = known_or_nearest(self.of, quantities())
            raise ValueError(f"of = {self.of} is no output with an interval ({hint})")
        return self

    @property
    def what(self) -> str:
        """What is to be known precisely, in words."""
        return f"mean of {self.of}" if self.quantile is None else f"{self.quantile} of {self.of}"


class Looks(Model):
    """After how many samples the conditions are judged: numbers that depend on nothing else."""

    first: Annotated[int, Field(ge=8, le=10_000_000)] = 64
    """Samples at the first look."""
    growth: Annotated[float, Field(ge=1.1, le=10.0)] = 1.5
    """Samples at a look over those at the one before."""

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
    """All conditions, which must hold at the same look, and the looks."""

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
        from ringsim.analysis.binomial import samples_needed  # scipy.stats takes half a second

        needed = samples_needed(0, wanted.probability, wanted.confidence)
        # A campaign that ends between two looks has the part of the one to come.
        upper = [*self.numbers(samples, replicates), samples]
        lower = [count for count in upper[:-1] if count >= needed] + [samples]
        return _part(wanted.confidence, len(lower)), _part(wanted.confidence, len(upper))

    def further_samples(
        self, name: str, wanted: Requirement, samples: int, violations: int, replicates: int = 1
    ) -> int:
        """How many samples without a violation after so many would show it at a look."""
        from ringsim.analysis.binomial import samples_needed

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
