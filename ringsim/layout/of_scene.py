"""The layout of a scene."""

from __future__ import annotations

from typing import Any

from ringsim.layout.layout import Layout
from ringsim.layout.pose import STEP


def layout_of(scene: Any, coordinate: float | None = None) -> Layout:
    """The layout of a scene's structure at a coordinate (rad), or as it starts.

    Examples
    --------
    >>> from ringsim.scene import load_scene
    >>> layout = layout_of(load_scene("truss2"))
    >>> len(layout.bodies), len(layout.rods), len(layout.joints)
    (6, 12, 23)
    """
    q = scene.structure.coordinate if coordinate is None else coordinate
    layout: Layout = scene.structure.layout(scene, q + 1j * STEP)
    return layout
