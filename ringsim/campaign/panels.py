"""What a stability map varies: panels of two axes, on a user's scene.

``PATH=LOW..HIGH`` is an axis, ``cables.*.axial_stiffness`` that of all cables.  Where no axes are
given, panels are chosen from what the scene holds, around its own values.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ringsim.refusal import InputError
from ringsim.sampling.paths import field_at, unit_at
from ringsim.scene import Scene
from ringsim.variables import PLANES

DECADE = 10.0
"""HIGH over LOW from which on values are spaced geometrically."""

_SPREADS = (1.0, 0.3, 0.0)
"""Exponents on the factors of a default axis, tried in turn until the scene accepts the value."""
_DEFAULTS = (
    (
        ("cables.*.axial_stiffness", "net.stiffness"),
        ("cables.*.friction.coefficient", "joints.vjoint.viscous", "structure.spring.damping"),
    ),
    (("rods.damping",), ("solver.step",)),
    (
        ("cables.*.winch.winding.speed", "loads.force"),
        ("stop.stiffness", "structure.rest.stiffness"),
    ),
)
"""Panels where none are asked for: for each axis the first path at which the scene has a positive
number.  A panel without one of its axes is left out."""
_FACTORS = {"solver.step": (0.2, 5.0)}
"""Ends of a default axis over the scene's own value, where not a decade to each side: the cost of
a run grows with 1 / step."""


@dataclass(frozen=True)
class Sweep:
    """One axis of a panel.

    Attributes
    ----------
    label, units
        On the map; the values are in these units.
    paths
        Scene paths that all get the value.
    values
        In rising order.
    """

    label: str
    units: str
    paths: tuple[str, ...]
    values: tuple[float, ...]

    def at(self, value: float) -> dict[str, float]:
        """A value by scene path."""
        return dict.fromkeys(self.paths, value)


@dataclass(frozen=True)
class Panel:
    """All pairs of the values of two axes, on one scene.

    Attributes
    ----------
    name
        Of its folder.
    title
        On the map.
    scene
        What all cells vary.
    x, y
        The axes.
    """

    name: str
    title: str
    scene: Scene
    x: Sweep
    y: Sweep

    def cells(self) -> Iterator[tuple[float, float]]:
        """Values of both axes for each cell."""
        return itertools.product(self.x.values, self.y.values)


def panels_over(scene: Scene, over: Sequence[str], points: int) -> list[Panel]:
    """Panels for the axes that a user asks for, two to a panel; default ones if there are none.

    Parameters
    ----------
    scene
        What the cells vary.
    over
        Texts ``PATH=LOW..HIGH``.
    points
        Values of each axis; fewer where whole numbers in the range are fewer.

    Raises
    ------
    InputError
        If a text, a path, a bound or any pair of values is refused.
    """
    if len(over) % 2:
        raise InputError(
            f"--over {over[-1]}: has no partner, and a panel has two axes: give one more --over "
            "PATH=LOW..HIGH, or leave this one out"
        )
    pairs = _defaults(scene, points)
    if over:
        axes = [sweep_of(scene, text, points) for text in over]
        pairs = list(zip(axes[::2], axes[1::2], strict=True))
    if not pairs:
        raise InputError(
            f"--over is missing: {scene.name} holds none of the default pairs of axes: give two "
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
    """The axis ``PATH=LOW..HIGH``: geometric from a decade on, else linear; whole numbers stay so.

    Raises
    ------
    InputError
        If the text, the path or one of the bounds is refused.
    """
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


def _sweep(scene: Scene, path: str, low: float, high: float, points: int) -> Sweep:
    paths = _expanded(scene, path)
    values = np.linspace(low, high, points)
    if low > 0.0 and high >= DECADE * low:
        values = np.geomspace(low, high, points)
    values[1:-1] = [float(f"{value:.6g}") for value in values[1:-1]]
    whole = all(_is_whole(_own_value(scene, each)) for each in paths)
    if whole:
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
        raise InputError(
            f"* stands for each cable of a scene, and {scene.name} has none: name a path"
        )
    return tuple(f"{head}.{name}.{tail}" for name in present)


def _own_value(scene: Scene, path: str) -> Any:
    """What a scene has at a path; None if it does not have it."""
    try:
        return field_at(scene, path)
    except (AttributeError, IndexError):
        return None


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _defaults(scene: Scene, points: int) -> list[tuple[Sweep, Sweep]]:
    pairs = []
    for alternatives in _DEFAULTS:
        found = [_first(scene, paths, points) for paths in alternatives]
        x, y = found
        if x is not None and y is not None:
            pairs.append((x, y))
    return pairs


def _first(scene: Scene, alternatives: Sequence[str], points: int) -> Sweep | None:
    """An axis around the scene's own value at the first of some paths that it has."""
    for path in alternatives:
        try:
            paths = _expanded(scene, path)
        except InputError:
            continue
        own = _own_value(scene, paths[0])
        if isinstance(own, float) and own > 0.0:
            factors = _FACTORS.get(path, (1.0 / DECADE, DECADE))
            low, high = (_accepted(scene, paths, own, factor) for factor in factors)
            if low < high:
                return _sweep(scene, path, low, high, points)
    return None


def _accepted(scene: Scene, paths: tuple[str, ...], own: float, factor: float) -> float:
    """The scene's own value times a factor, or less of it where that is refused."""
    for spread in _SPREADS:
        value = float(f"{own * factor**spread:.3g}")
        try:
            scene.with_values(dict.fromkeys(paths, value))
        except InputError:
            continue
        return value
    return own
