"""Annotated field types: SI unit and bounds of every quantity that a scene may hold, and whether
it is one value for all sections, or a list with one value for each.
"""

import functools
import operator
import typing
from collections.abc import Iterator
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


def unit_of(field: FieldInfo) -> str:
    """Symbol of the SI unit of a model's field, also of one in a list; "1" if it has none."""
    parts = (part for top in (*field.metadata, field.annotation) for part in nested_in(top))
    return next((part.symbol for part in parts if isinstance(part, Unit)), "1")


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
