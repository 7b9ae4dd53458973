"""The family of outputs, and what all of them together declare."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.cable.winding.motor import MotorWinding
from ringsim.choice import kind_of
from ringsim.outputs.peaks import Peak, SpanNames, Values
from ringsim.outputs.series import Reading, Run, Series, output_times
from ringsim.parts.net.boundary import BoundaryNet
from ringsim.scene import Scene
from ringsim.scene.substituted import strained
from ringsim.stepping.instant import Array
from ringsim.variables import ErrorBar, Variable

__all__ = [
    "Array",
    "ErrorBar",
    "Output",
    "Reading",
    "Run",
    "Series",
    "SpanNames",
    "Values",
    "Variable",
]


OUTPUTS: "list[type[Output]]" = []
"""All outputs, those of the smallest rank first."""

VARIABLES: dict[str, Variable] = {}
"""What all outputs declare, with the error bars of those that have one."""

COORDINATES = {
    "plane": Variable("plane", ("plane",), "1", "plane of the structure", "str"),
    "section": Variable("section", ("section",), "1", "section number, from 1", "i4"),
    "time": Variable("time", ("time",), "s", "time since the start of the run"),
    "span": Variable("span", ("span",), "1", "span of a cable, counted from its winch", "i4"),
    "pulley": Variable(
        "pulley", ("pulley",), "1", "pulley of a cable, at the end of the span of its number",
        "i4",
    ),
    "winch": Variable("winch", ("winch",), "1", "winch: 1 where a path begins, 2 at its end", "i4"),
    "axis": Variable("axis", ("axis",), "1", "axis of space; z points upwards", "str"),
}  # fmt: skip
"""Dimensions of the variables; an output may declare more."""

SPAN_NAME = Variable("span_name", ("plane", "span"), "1", "ends of the span", "str")
"""Coordinate of every result that has spans; empty where a plane's cable has fewer."""


class Output:
    """An output, or a few that are computed together; every run that needs it has its own."""

    variables: ClassVar[tuple[Variable, ...]]
    coordinates: ClassVar[tuple[Variable, ...]] = ()
    """Dimensions that no other output has; an engine gives their values to its ``Recorder``."""
    needs: ClassVar[tuple[str, ...]] = ()
    """What a scene must hold for it, see ``Variable``."""
    peak: ClassVar[Peak | None] = None
    """Variables that tell when and where the value in its summary was."""
    limit: ClassVar[str] = ""
    """Field of ``ringsim.parts.limits.Limits`` that its largest reading must not pass."""
    of_antenna: ClassVar[bool] = True
    """Whether it tells of the antenna, so that engines are compared by it, not of the run."""
    rank: ClassVar[int] = 50
    """Place among the outputs in files and summaries; the smaller the earlier."""

    def __init_subclass__(cls) -> None:
        """Make it known to all that handle results."""
        twice = sorted(_declared(cls).keys() & (VARIABLES.keys() | COORDINATES.keys()))
        if twice:
            raise ValueError(f"{cls.__module__}: there is an output {twice[0]} already: rename it")
        COORDINATES.update({variable.name: variable for variable in cls.coordinates})
        OUTPUTS.append(cls)
        OUTPUTS.sort(key=lambda output: output.rank)
        VARIABLES.clear()
        for output in OUTPUTS:
            VARIABLES.update(_declared(output))

    def read(self, now: Reading) -> Array | float | None:
        """What to keep of the state after an accepted step; None if this run does not tell it."""
        return np.empty(0)

    def reduce(self, run: Run, series: Series) -> Values:
        """Values of its variables, from what ``read`` gave at all instants of a run.

        Unless said otherwise the first variable is the reading, interpolated in time, and the
        second of two the largest magnitude of a reading.
        """
        values: Values = {self.variables[0].name: series.on_grid()}
        if len(self.variables) == 2:
            values[self.variables[1].name] = np.abs(series.values).max()
        return values

    def told(self, values: Values, span_names: SpanNames) -> str:
        """When and where the value in its summary was, in words; empty if that is not known."""
        return "" if self.peak is None else self.peak.told(values, span_names)


def _declared(output: type[Output]) -> dict[str, Variable]:
    """Variables of an output and their error bars ``NAME_error``.

    The bar of a function of time alone is one, too; any other is a number.
    """
    found = {v.name: replace(v, needs=output.needs) for v in output.variables}
    for one in output.variables:
        if one.error_bar is not None:
            name, words = f"{one.name}_error", f"numerical error bar of the {one.error_bar.words}"
            dims = one.dims if one.dims == ("time",) else ()
            words += " at any time up to then" if dims else ""
            needs = ("error bars", *output.needs)
            found[name] = Variable(name, dims, one.units, words, needs=needs)
    return found


def in_all_planes(values: Array, planes: Sequence[str]) -> Array:
    """Values by plane and corner with rows of NaN for planes that have no corners of their own."""
    found = np.full((len(planes), *values.shape[1:]), np.nan)
    found[: len(values)] = values
    return found


def holds(scene: Scene) -> set[str]:
    """Everything that a variable may need and the scene has."""
    held = {name: getattr(scene, name) is not None for name in type(scene).parts()}
    held |= {
        kind_of(scene.structure): True,
        "stress": scene.record.stress,
        "positions": scene.record.positions,
        "accelerations": scene.record.accelerations,
        "error bars": scene.solver.error_bars,
        "gauge": bool(scene.structure.gauge),
        "motors": any(
            isinstance(winch.winding, MotorWinding)
            for cable in _cables(scene)
            for winch in cable.winches
        ),
        "reactions": scene.record.reactions,
        "shape": scene.record.shape,
        "prestress": bool(strained(scene)),
        "base": scene.boom is not None or scene.structure.supported,
        "latches": scene.stop is not None and scene.stop.latch and scene.structure.locks,
        "boundary net": isinstance(scene.net, BoundaryNet),
        "held base": scene.held or scene.spacecraft is not None,
    }
    return {name for name, present in held.items() if present}


def axes(scene: Scene) -> dict[str, NDArray[Any]]:
    """Values of the dimensions that a scene tells before it runs."""
    most = max((len(cable.winches) for cable in _cables(scene)), default=0)
    return {
        "plane": np.array(scene.structure.planes),
        "section": np.arange(1, scene.structure.sections + 1),
        "time": output_times(scene),
        "span": np.arange(1, scene.spans + 1),
        "pulley": np.arange(1, scene.spans),
        "winch": np.arange(1, most + 1),
        "axis": np.array(["x", "y", "z"]),
    }


def _cables(scene: Scene) -> list[Cable]:
    return [] if scene.cables is None else [cable for _, cable in scene.cables.present()]


def span_names(scene: Scene) -> NDArray[Any]:
    """Values of ``SPAN_NAME``, shape (planes, spans)."""
    rows = ([*names, *[""] * (scene.spans - len(names))] for names in scene.span_names.values())
    return np.array(list(rows), dtype=str)
