"""Requirements of a campaign: which values an antenna must keep to, how probably, how surely."""

import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from ringsim.analysis.quantities import quantities
from ringsim.outputs import VARIABLES
from ringsim.outputs.extremes import instead_of
from ringsim.refusal import InputError, explain, known_or_nearest, show
from ringsim.units import Model
from ringsim.variables import Fate

OUTCOME = "outcome"
_WORDS = [fate.word for fate in Fate if fate != Fate.NONE]


class Requirement(Model):
    """What one output must be, with which probability, shown with which confidence."""

    max: float | None = None
    """Largest value allowed, in the output's unit."""
    min: float | None = None
    """Smallest value allowed, in the output's unit."""
    is_: Annotated[str | None, Field(alias="is")] = None
    """What the antenna must do; of the outcome alone."""
    probability: Annotated[float, Field(gt=0.0, lt=1.0)]
    """Share of all antennas, at least, that must keep to it."""
    confidence: Annotated[float, Field(ge=0.5, lt=1.0)]
    """Probability, at least, with which an antenna that does not keep to it is found out."""

    def told(self, name: str) -> str:
        """The requirement in words, with units."""
        units = quantities()[name].units if name in quantities() else "1"
        unit = "" if units == "1" else f" {units}"
        bounds = {"<=": self.max, ">=": self.min, "is": self.is_}
        given = [
            f"{sign} {bound}" if isinstance(bound, str) else f"{sign} {bound:g}{unit}"
            for sign, bound in bounds.items() if bound is not None
        ]  # fmt: skip
        return f"{name} {' and '.join(given)}"


def _check(requirements: dict[str, Requirement]) -> dict[str, Requirement]:
    """Refuse outputs that do not exist, and what their requirements cannot hold."""
    known = [OUTCOME, *quantities()]
    for name, each in requirements.items():
        if name not in known:
            why = f"is no output that can be required ({known_or_nearest(name, known)})"
            if name in VARIABLES and VARIABLES[name].dims:
                senses = {"largest": each.max, "least": each.min}
                asked = [sense for sense, bound in senses.items() if bound is not None]
                raise ValueError(instead_of(name, *asked))
            raise ValueError(f"{name} {why}")
        if name == OUTCOME:
            if each.is_ not in _WORDS or each.max is not None or each.min is not None:
                wrong = f"is = {show(each.is_)}" if each.is_ is not None else "is"
                hint = known_or_nearest(str(each.is_), _WORDS)
                raise ValueError(
                    f'{name}.{wrong} must be a word for what the antenna does, as is = "deployed", '
                    f"without max and min ({hint})"
                )
        elif each.is_ is not None:
            raise ValueError(
                f"{name}.is = {show(each.is_)}: only the outcome is a word: give max or min"
            )
        elif each.max is None and each.min is None:
            unit = "" if (u := quantities()[name].units) == "1" else f", in {u}"
            raise ValueError(f"{name} needs a bound: give max or min{unit}")
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


def parse_requirements(texts: Iterable[str]) -> dict[str, Requirement]:
    """Requirements from texts of the command line.

    >>> parse_requirements(["asynchrony_max: max 10, probability 0.99, confidence 0.9"])
    {'asynchrony_max': Requirement(max=10.0, min=None, is_=None, probability=0.99, confidence=0.9)}
    """
    table: dict[str, dict[str, Any]] = {}
    for text in texts:
        name, found, rest = re.match(r"\s*(\w*)\s*([:=]?)(.*)", text, re.DOTALL).groups()  # type: ignore[union-attr]
        parts = [re.fullmatch(r"(\w+)[\s=]+(\S+)", part.strip()) for part in rest.split(",")]
        if not name or not found or None in parts:
            raise InputError(
                f"--require {show(text)}: must read NAME: KEY VALUE, KEY VALUE, ..., for example "
                '"asynchrony_max: max 10, probability 0.99, confidence 0.9" or "outcome: is '
                'deployed, probability 0.99, confidence 0.9"'
            )
        if name in table:
            raise InputError(f"--require {name} is given twice: leave out one of the two")
        table[name] = {part[1]: _value(part[2]) for part in parts if part}
    return read_requirements(table, "--require")


def _value(word: str) -> Any:
    try:
        return float(word)
    except ValueError:
        return word.strip("\"'")
