"""Annotated field types: SI unit and bounds of every quantity that a scene may hold, and whether
it is one value for all sections, or a list with one value for each.
"""

import functools
import math
import operator
import re
import typing
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo

LEFT_OUT = "none"
"""The word that leaves out a part which would be there by default: ``stop = "none"``."""

ListIn = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
"""TOML arrays arrive as lists; a frozen record keeps tuples."""


@dataclass(frozen=True)
class Unit:
    """The SI unit of a field, shown in error messages and documents."""

    symbol: str


@dataclass(frozen=True)
class UnitOf:
    """Marks a field in the unit of what its table is named by, as bounds of an output."""

    symbol: Callable[[str], str]


def unit_of(field: FieldInfo, table: str = "") -> str:
    """Symbol of the SI unit of a model's field, also of one in a list; "1" if it has none.

    ``table`` is the name of the table that holds the field, where the unit depends on it.
    """
    parts = [part for top in (*field.metadata, field.annotation) for part in nested_in(top)]
    told = (part.symbol(table) for part in parts if table and isinstance(part, UnitOf))
    return next((part.symbol for part in parts if isinstance(part, Unit)), next(told, "1"))


def unit_at(record: BaseModel, path: str) -> str:
    """Symbol of the SI unit of the field at a dotted path, ``name[k]`` included; "1" if none."""
    inner, _, last = path.partition("[")[0].rpartition(".")
    owner = operator.attrgetter(inner)(record) if inner else record
    field = getattr(type(owner), "model_fields", {}).get(last)
    return "1" if field is None else unit_of(field)


def nested_in(annotation: Any) -> Iterator[Any]:
    """An annotation, then all that it is made of: types, units and other marks."""
    yield annotation
    for part in typing.get_args(annotation):
        yield from nested_in(part)


_ATOMS = {
    "1": (1.0, ""), "%": (1e-2, ""), "m": (1.0, "m"), "s": (1.0, "s"), "min": (60.0, "s"),
    "h": (3600.0, "s"), "kg": (1.0, "kg"), "g": (1e-3, "kg"), "N": (1.0, "N"),
    "Pa": (1.0, "N m^-2"), "K": (1.0, "K"), "A": (1.0, "A"), "W": (1.0, "N m s^-1"),
    "J": (1.0, "N m"), "Nm": (1.0, "N m"), "rad": (1.0, "rad"), "deg": (math.pi / 180.0, "rad"),
    "rev": (math.tau, "rad"), "rpm": (math.tau / 60.0, "rad s^-1"),
}  # fmt: skip
"""Units that people write: the factor, and the product of powers that it is in."""
_PREFIXES = {"k": 1e3, "M": 1e6, "G": 1e9, "c": 1e-2, "m": 1e-3, "u": 1e-6, "\N{MICRO SIGN}": 1e-6}


def in_unit(number: float, written: str, wanted: str) -> float | None:
    """A number of one unit in another; None if either is not known or they are not alike.

    >>> in_unit(100.0, "MPa", "Pa"), in_unit(60.0, "rpm", "rad/s"), in_unit(1.0, "kN", "m")
    (100000000.0, 6.283185307179586, None)
    """
    own, other = _powers(written), _powers(wanted)
    if own is None or other is None or own[1] != other[1]:
        return None
    return number * own[0] / other[0]


def _powers(unit: str) -> tuple[float, dict[str, int]] | None:
    """Factor and powers of a unit as it is written: ``N m/rad``, ``m/s^2``."""
    factor, powers = 1.0, Counter[str]()
    for side, text in enumerate(unit.split("/")):
        for atom in text.split():
            symbol, _, power = atom.partition("^")
            prefix = 1.0
            if symbol not in _ATOMS:
                prefix, symbol = _PREFIXES.get(symbol[:1], 0.0), symbol[1:]
            if not prefix or symbol not in _ATOMS or not re.fullmatch(r"(-?\d)?", power):
                return None
            sign = (-1 if side else 1) * int(power or 1)
            factor *= (prefix * _ATOMS[symbol][0]) ** sign
            for part in _ATOMS[symbol][1].split():
                name, _, own = part.partition("^")
                powers[name] += sign * int(own or 1)
    return factor, {name: power for name, power in powers.items() if power}


class Model(BaseModel):
    """A frozen record that refuses unknown keys, wrong types, NaN and infinity."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True
    )

    @model_validator(mode="before")
    @classmethod
    def _leave_out(cls, table: Any) -> Any:
        """Read the word "none" as nothing, where nothing is allowed."""
        if not isinstance(table, dict):
            return table
        left_out = {
            k for k in cls.parts() if isinstance(table.get(k), str) and table[k] == LEFT_OUT
        }
        return table | dict.fromkeys(left_out)

    def require_below(self, path: str, limit: str, why: str = "") -> None:
        """Refuse a field at a dotted path that is not below another one of the same unit."""
        value, most = operator.attrgetter(path, limit)(self)
        if value >= most:
            unit, because = unit_at(self, path), f": {why}" if why else ""
            raise ValueError(
                f"{path} = {value} {unit} must be below {limit} = {most} {unit}{because}"
            )

    @model_serializer(mode="wrap")
    def _write_nothing(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Skip parts that are left out; say "none" where reading would put a default back."""
        table: dict[str, Any] = write(self)
        if "kind" in table:
            table = {"kind": table.pop("kind"), **table}
        for name in self.parts():
            if table.get(name) is None:
                table.pop(name, None)
                if type(self).model_fields[name].default is not None:
                    table[name] = LEFT_OUT
        return table

    @classmethod
    @functools.cache
    def parts(cls) -> frozenset[str]:
        """Names of the fields that may be left out."""
        return frozenset(
            name
            for name, field in cls.model_fields.items()
            if type(None) in typing.get_args(field.annotation)
        )


Metre = Annotated[float, Field(ge=1e-6, le=1e3), Unit("m")]
MetreOrZero = Annotated[float, Field(ge=0.0, le=1e3), Unit("m")]
Kilogram = Annotated[float, Field(ge=1e-9, le=1e4), Unit("kg")]
KilogramOrZero = Annotated[float, Field(ge=0.0, le=1e4), Unit("kg")]
Newton = Annotated[float, Field(ge=-1e6, le=1e6), Unit("N")]
Second = Annotated[float, Field(ge=1e-9, le=1e6), Unit("s")]
SecondOrZero = Annotated[float, Field(ge=0.0, le=1e6), Unit("s")]
Pascal = Annotated[float, Field(ge=1e5, le=1e15), Unit("Pa")]
Density = Annotated[float, Field(ge=1e-3, le=3e4), Unit("kg/m^3")]
PoissonRatio = Annotated[float, Field(ge=0.0, le=0.5), Unit("1")]
Degree = Annotated[float, Field(gt=0.0, le=180.0), Unit("deg")]
DegreeOrZero = Annotated[float, Field(ge=0.0, lt=180.0), Unit("deg")]
Ratio = Annotated[float, Field(gt=0.0, le=1.0), Unit("1")]
SpringRate = Annotated[float, Field(ge=0.0, le=1e9), Unit("N/m")]
DampingRate = Annotated[float, Field(ge=0.0, le=1e6), Unit("N s/m")]
TorsionRate = Annotated[float, Field(gt=0.0, le=1e7), Unit("N m/rad")]
TorsionDamping = Annotated[float, Field(ge=0.0, le=1e5), Unit("N m s/rad")]
Torque = Annotated[float, Field(ge=0.0, le=1e5), Unit("N m")]
PositiveTorque = Annotated[float, Field(gt=0.0, le=1e5), Unit("N m")]
TorqueConstant = Annotated[float, Field(gt=0.0, le=1e3), Unit("N m/A")]
Ampere = Annotated[float, Field(gt=0.0, le=1e4), Unit("A")]
RotorInertia = Annotated[float, Field(gt=0.0, le=1e3), Unit("kg m^2")]
MotorSpeed = Annotated[float, Field(gt=0.0, le=1e5), Unit("rad/s")]
GearRatio = Annotated[float, Field(gt=0.0, le=1e6), Unit("1")]
AngularRate = Annotated[float, Field(gt=0.0, le=1e3), Unit("rad/s")]
SignedMetre = Annotated[float, Field(ge=-1e3, le=1e3), Unit("m")]
AxialStiffness = Annotated[float, Field(ge=1.0, le=1e10), Unit("N")]
Tension = Annotated[float, Field(gt=0.0, le=1e6), Unit("N")]
Stress = Annotated[float, Field(gt=0.0, le=1e12), Unit("Pa")]
Speed = Annotated[float, Field(ge=-1e2, le=1e2), Unit("m/s")]
SpeedOrZero = Annotated[float, Field(ge=0.0, le=1e2), Unit("m/s")]
PositiveSpeed = Annotated[float, Field(gt=0.0, le=1e2), Unit("m/s")]
FrictionCoefficient = Annotated[float, Field(ge=0.0, le=10.0), Unit("1")]
ControlGain = Annotated[float, Field(gt=0.0, le=1e3), Unit("m/(N s)")]


# Quantities that are one value for all sections, or a list with one value for each.


_T = TypeVar("_T")
_Record = TypeVar("_Record", bound=Model)

ONE, EACH = "one value", "a value each"


def _one_or_each(value: Any) -> str:
    return EACH if isinstance(value, (list, tuple)) else ONE


PerSection = Annotated[
    Union[Annotated[_T, Tag(ONE)], Annotated[tuple[_T, ...], Tag(EACH)]],  # noqa: UP007
    Discriminator(_one_or_each),
    ListIn,
]
"""One value for all sections, or a list (TOML array) with one value for each."""
PerPulley = PerSection[_T]
"""The same of the pulleys of a cable, in order from its winch."""


def at_section(record: _Record, where: int | NDArray[np.int64]) -> _Record:
    """A record whose lists hold the values of one section (floats), or of several (arrays)."""
    return record.model_copy(
        update={
            name: each[where] if isinstance(where, int) else np.asarray(each)[where]
            for name, each in record
            if isinstance(each, tuple)
        }
    )


def spread(value: float | tuple[float, ...], sections: int) -> NDArray[np.float64]:
    """One value per section, shape (sections,)."""
    return np.broadcast_to(np.asarray(value, dtype=float), (sections,)).copy()
