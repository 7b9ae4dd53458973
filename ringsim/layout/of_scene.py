"""The layout of a scene."""

from __future__ import annotations

from typing import Any

from ringsim.layout.layout import Layout
from ringsim.layout.pose import STEP


def layout_of(scene: Any, coordinate: float | None = None) -> Layout:
    """The layout of a scene's structure at a coordinate (rad), or as it starts.

    >>> from ringsim.scene import load_scene
    >>> layout = layout_of(load_scene("truss2"))
    >>> len(layout.bodies), len(layout.rods), len(layout.joints)
    (6, 12, 24)
    """
    q = scene.structure.coordinate if coordinate is None else coordinate
    layout: Layout = scene.structure.layout(scene, q + 1j * STEP)
    return layout


def layout_at_opening(scene: Any, opening: float) -> Layout:
    """The layout at which the mean opening angle has a value (rad), by Newton's method.

    Raises
    ------
    ValueError
        If the structure never opens so far.
    """
    q = float(scene.structure.coordinate)
    for _ in range(30):
        layout = layout_of(scene, q)
        angles, rates = layout.opening_angles()
        missing = opening - float(angles.mean())
        if abs(missing) < 1e-12:
            return layout
        q += missing / float(rates.mean())
    raise ValueError(f"no state of the structure has a mean opening angle of {opening:.4g} rad")
