"""Temperatures of parts, and what they change."""

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ringsim.units import ListIn, Model, PerSection, Unit

if TYPE_CHECKING:
    from ringsim.scene import Scene

Kelvin = Annotated[float, Field(ge=1.0, le=2000.0), Unit("K")]
Expansion = Annotated[float, Field(ge=-1e-3, le=1e-3), Unit("1/K")]
PartFactor = Annotated[float, Field(gt=0.0, le=1e4), Unit("1")]
Values = float | tuple[float, ...]


def _kelvin(value: float, first: float, last: float) -> str:
    """A hint where a temperature would do if it were in C."""
    kelvin = value + 273.15
    return f"{value:g} C are {kelvin:g} K; or " if first <= kelvin <= last else ""


class FactorTable(Model):
    """Factors on a property at temperatures, joined by lines."""

    temperatures: Annotated[tuple[Kelvin, ...], ListIn, Field(min_length=2, max_length=50)]
    """Temperatures, increasing; one outside of them is refused."""
    factors: Annotated[tuple[PartFactor, ...], ListIn]
    """What the property that the scene names is multiplied by there."""

    @model_validator(mode="after")
    def _usable(self) -> Self:
        if len(self.factors) != len(self.temperatures):
            raise ValueError(
                f"factors has {len(self.factors)} values, but temperatures has "
                f"{len(self.temperatures)}: give one factor for each temperature"
            )
        late = [b for a, b in pairwise(self.temperatures) if b <= a]
        if late:
            raise ValueError(f"temperatures = ... {late[0]:g} K must be above the one before it")
        return self

    def require_covers(self, part: str, field: str, value: Values) -> None:
        """Raise a ValueError if a temperature (K) of a part lies outside of its table ``field``."""
        first, last = self.temperatures[0], self.temperatures[-1]
        out = [one for one in np.ravel(value).tolist() if not first <= one <= last]
        if out:
            raise ValueError(
                f"temperature.{part}.value = {out[0]:g} K must lie within {first:g} .. {last:g} K, "
                f"for which it has factors: {_kelvin(out[0], first, last)}extend "
                f"temperature.{part}.{field}.temperatures"
            )

    def at(self, value: Values) -> Values:
        """Factors at temperatures (K), one or one a section."""
        found = np.interp(np.ravel(value), self.temperatures, self.factors).tolist()
        return tuple(found) if isinstance(value, tuple) else float(found[0])


class RodTemperature(Model):
    """The temperature of a group of rods."""

    value: PerSection[Kelvin] = 293.15
    """Temperature of the rods, or of those of each section."""
    expansion: Expansion = 0.0
    """Thermal expansion: rods become longer by this times their temperature less ``reference``."""
    stiffness: FactorTable | None = None
    """Factors on ``rods.young_modulus``; left out, it is the same at all temperatures."""


class HingeTemperature(Model):
    """The temperature of all hinge assemblies."""

    value: PerSection[Kelvin] = 293.15
    """Temperature of the hinge assemblies at both ends of all sections, or of each section."""
    expansion: Expansion = 0.0
    """Thermal expansion: pins stand off by ``structure.hinge_offset``, with its errors, times this
    and their temperature less ``reference`` more."""


class JointTemperature(Model):
    """The temperature of all joints."""

    value: PerSection[Kelvin] = 293.15
    """Temperature of the joints, or of those of each section."""
    friction: FactorTable
    """Factors on viscous and dry friction of all joints."""


class PulleyTemperature(Model):
    """The temperature of all pulleys."""

    value: Kelvin = 293.15
    """Temperature of the pulleys."""
    friction: FactorTable
    """Factors on ``friction.coefficient`` of all cables."""


class Temperature(Model):
    """Temperatures of groups of parts, uniform in each and constant in time.

    A run is that of the scene with other lengths, stiffnesses and friction in place of this part:
    see ``ringsim.scene.substituted``.  Length errors e become (1 + e) (1 + a (T - reference)) - 1;
    ropes and the boom keep their sizes.
    """

    reference: Kelvin = 293.15
    """Temperature at which rods are as long as the scene says."""
    diagonal: RodTemperature | None = None
    """Of the diagonals; left out, they are at ``reference``."""
    bar: RodTemperature | None = None
    """Of the folding bars; left out, they are at ``reference``."""
    hinge: HingeTemperature | None = None
    """Of the hinge assemblies; left out, they are at ``reference``."""
    joint: JointTemperature | None = None
    """Of the joints; left out, their friction is as given."""
    pulley: PulleyTemperature | None = None
    """Of the pulleys; left out, their friction is as given."""

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError where a table does not reach, or has nothing to act on."""
        tables = [(name, group, group.stiffness) for name, group in self.rods()]
        for name, group, table in tables:
            if table is not None:
                table.require_covers(name, "stiffness", group.value)
        if self.joint is not None:
            self.joint.friction.require_covers("joint", "friction", self.joint.value)
            if not scene.joints.present():
                raise ValueError(
                    "temperature.joint: no joint has friction: add one, as [joints.hinge], or "
                    "leave it out"
                )
        if self.pulley is not None:
            self.pulley.friction.require_covers("pulley", "friction", self.pulley.value)
            if scene.cables is None:
                raise ValueError(
                    "temperature.pulley: there is no cable: add [cables.upper], or leave it out"
                )

    @property
    def expands(self) -> bool:
        """Whether any part changes its size."""
        groups = (self.diagonal, self.bar, self.hinge)
        return any(group is not None and group.expansion != 0.0 for group in groups)

    def rods(self) -> list[tuple[str, RodTemperature]]:
        """Groups of rods that have a temperature of their own, by name."""
        groups = ("diagonal", self.diagonal), ("bar", self.bar)
        return [(name, group) for name, group in groups if group is not None]
