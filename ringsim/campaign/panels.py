"""What a stability map varies: panels of two axes, on a user's scene.

``PATH=LOW..HIGH`` is an axis, ``cables.*.axial_stiffness`` that of all cables.  Where no axes are
given, panels are chosen from what the scene holds, around its own values.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ringsim.overrides import field_at
from ringsim.refusal import InputError
from ringsim.sampling.table import refuse_fixed
from ringsim.scene import Scene
from ringsim.simulation import why_not_frame
from ringsim.units import unit_at
from ringsim.variables import PLANES

_DECADE = 10.0
"""HIGH over LOW from which on values are spaced geometrically."""
_DEFAULTS = (
    (("cables.*.axial_stiffness", "net.stiffness", "net.axial_stiffness"),
     ("cables.*.friction.coefficient", "joints.vjoint.viscous", "structure.spring.damping")),
    (("rods.damping",), ("solver.step",)),
    (("cables.*.winch.winding.speed", "loads.force"),
     ("stop.stiffness", "structure.rest.stiffness")),
)  # fmt: skip
"""Panels where none are asked for: for each axis the first path at which the scene has a number
other than zero.  A panel without one of its axes is left out."""
_FACTOR, _STEP_FACTOR = 10.0, 5.0
"""Ends of a default axis over the scene's own value, and below it; less for solver.step, because
the cost of a run grows with 1 / step."""
_SPREADS = (1.0, 0.3)
"""Exponents on that factor, tried in turn: a bound of the field may be near."""


@dataclass(frozen=True)
class Sweep:
    """One axis of a panel: values in rising order that all ``paths`` of a scene get."""

    label: str
    units: str
    paths: tuple[str, ...]
    values: tuple[float, ...]

    def at(self, value: float) -> dict[str, float]:
        """A value by scene path."""
        return dict.fromkeys(self.paths, value)

    def shapes(self, scene: Scene) -> bool:
        """Whether the values change the shape of a result, so that each is a campaign."""
        try:
            for path in self.paths:
                refuse_fixed(scene, path)
        except InputError:
            return True
        return False


@dataclass(frozen=True)
class Panel:
    """All pairs of the values of two axes, on one scene, by an engine; ``name`` is that of its
    folder.
    """

    name: str
    title: str
    scene: Scene
    x: Sweep
    y: Sweep
    fidelity: str = "full"

    def cells(self) -> Iterator[tuple[float, float]]:
        """Values of both axes for each cell."""
        return itertools.product(self.x.values, self.y.values)


def by_engines(panels: Sequence[Panel], fidelity: str) -> list[Panel]:
    """Panels by the engine "full" or "frame", or by "both" side by side with their error bars.

    The full engine takes those that the frame engine cannot represent; InputError if it is to take
    all.
    """
    reasons = [why_not_frame(panel.scene) if fidelity != "full" else "" for panel in panels]
    if all(reasons):
        raise InputError(f"--fidelity {fidelity}: {reasons[0]}")
    found = []
    for panel, refused in zip(panels, reasons, strict=True):
        if fidelity == "full" or refused:
            found.append(panel)
            continue
        both = fidelity == "both"
        values = {"solver.error_bars": True} if both else {}  # by which cells are told apart
        own = replace(panel, scene=panel.scene.with_values(values))
        name, title = f"{panel.name}-frame", f"{panel.title}, frame engine"
        found += [own] if both else []
        found.append(replace(own, name=name, title=title, fidelity="frame"))
    return found


def panels_over(scene: Scene, over: Sequence[str], points: int) -> list[Panel]:
    """Panels for axes ``PATH=LOW..HIGH``, default ones if none; InputError if one is refused."""
    if len(over) % 2:
        raise InputError(
            f"--over {over[-1]}: a panel needs two axes: give one more --over PATH=LOW..HIGH, or "
            "leave this one out"
        )
    asked = [sweep_of(scene, text, points) for text in over]
    pairs = list(zip(asked[::2], asked[1::2], strict=True)) or [
        (x, y)
        for one, other in _DEFAULTS
        if (x := _around(scene, one, points)) and (y := _around(scene, other, points))
    ]
    if not pairs:
        raise InputError(
            f"--over is missing: {scene.name} has none of the default pairs of axes: give two "
            "--over PATH=LOW..HIGH"
        )
    found = []
    for number, (x, y) in enumerate(pairs, 1):
        if twice := set(x.paths) & set(y.paths):
            raise InputError(
                f"--over {x.label}, --over {y.label}: both axes of panel {number} vary "
                f"{min(twice)}: choose another path for one of them"
            )
        found.append(Panel(f"panel-{number}", f"panel {number}", scene, x, y))
        for one, other in found[-1].cells():
            try:
                scene.with_values(x.at(one) | y.at(other))
            except InputError as error:
                raise InputError(
                    f"--over {x.label} = {one:g} with --over {y.label} = {other:g}: {error}"
                ) from None
    return found


def sweep_of(scene: Scene, text: str, points: int) -> Sweep:
    """The axis ``PATH=LOW..HIGH``, geometric from a decade on; InputError if it is refused."""
    path, _, extent = (part.strip() for part in text.partition("="))
    try:
        low, high = (float(end) for end in extent.split(".."))
    except ValueError:
        raise InputError(
            f"--over {text}: must read PATH=LOW..HIGH with two numbers, for example "
            "solver.step=0.01..0.2"
        ) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(
            f"--over {text}: LOW = {low:g} must be below HIGH = {high:g}, and both finite: "
            "exchange them, or give other bounds"
        )
    try:
        return _sweep(scene, path, low, high, points)
    except InputError as error:
        raise InputError(f"--over {text}: {error}") from None


def _sweep(
    scene: Scene, path: str, low: float, high: float, points: int, ratio: float = _DECADE
) -> Sweep:
    """An axis; its values are equally far apart in their logarithm from a ``ratio`` of both ends
    on.
    """
    paths = _expanded(scene, path)
    least, most = sorted((abs(low), abs(high)))
    spaced = np.geomspace if low * high > 0.0 and most >= ratio * least else np.linspace
    values = spaced(low, high, points)
    values[1:-1] = [float(f"{value:.6g}") for value in values[1:-1]]
    if type(_own_value(scene, paths[0])) is int:
        if not (low.is_integer() and high.is_integer()):
            raise InputError(
                f"{path} takes whole numbers only: give LOW and HIGH without fractions"
            )
        values = np.unique(np.rint(values).astype(int))
    ends = [scene.with_values(dict.fromkeys(paths, end)) for end in values[[0, -1]].tolist()]
    return Sweep(path, unit_at(ends[0], paths[0]), paths, tuple(values.tolist()))


def _expanded(scene: Scene, path: str) -> tuple[str, ...]:
    """A path, or for ``cables.*.name`` one for each cable that the scene has."""
    head, star, tail = path.partition(".*.")
    if not star:
        return (path,)
    present = [name for name in PLANES if getattr(scene.cables, name, None) is not None]
    if head != "cables" or not present:
        raise InputError(f"* stands for every cable, and {scene.name} has none: name a path")
    return tuple(f"{head}.{name}.{tail}" for name in present)


def _own_value(scene: Scene, path: str) -> object:
    """What a scene has at a path; None if it does not have it."""
    try:
        return field_at(scene, path)
    except (AttributeError, IndexError):
        return None


def _around(scene: Scene, alternatives: Sequence[str], points: int) -> Sweep | None:
    """An axis around the scene's own value at the first of some paths that it has."""
    for path, spread in itertools.product(alternatives, _SPREADS):
        try:
            own = _own_value(scene, _expanded(scene, path)[0])
            if isinstance(own, float) and own != 0.0:  # loads that fold are negative
                factor = (_STEP_FACTOR if path == "solver.step" else _FACTOR) ** spread
                # Digits enough that the scene's own value is the one in the middle.
                low, high = sorted(float(f"{end:.6g}") for end in (own / factor, own * factor))
                return _sweep(scene, path, low, high, points, ratio=1.0)
        except InputError:
            continue
    return None
