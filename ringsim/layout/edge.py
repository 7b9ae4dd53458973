"""Cables along the edge of a net: which corners they join, and how long they are."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ringsim.layout.layout import EdgeNet, Layout, layout_at_opening
from ringsim.layout.pose import Array
from ringsim.parts.net.boundary import BoundaryNet

if TYPE_CHECKING:
    from ringsim.layout.draft import Draft


def along_edges(draft: "Draft") -> EdgeNet | None:
    """The cables of a scene's net, if it has such."""
    law = draft.scene.net
    if not isinstance(law, BoundaryNet):
        return None
    planes = {"upper": (0,), "lower": (1,), "both": (0, 1)}[law.planes]
    draft.require_corners("net", planes[-1] + 1)
    sections, count = draft.scene.structure.sections, len(draft.corners[0])
    bodies = np.full((len(draft.scene.structure.planes), sections, 2), -1)
    for plane in planes:
        row = np.array([ref.number for ref in draft.corners[plane]])
        ahead = np.arange(1, sections + 1) % count
        bodies[plane] = np.stack([row[:sections], row[ahead]], axis=-1)
    return EdgeNet(law, bodies)


def natural_lengths(scene: Any, edge: EdgeNet) -> Array:
    """Of the cables, from the layout with all V-joints at 180 deg, m, shape (planes, sections);
    NaN in planes without.
    """
    plain = scene.model_copy(update={"net": None})
    deployed = distances(layout_at_opening(plain, math.pi), edge)
    return edge.law.natural(deployed)


def distances(layout: Layout, edge: EdgeNet) -> Array:
    """Of the corners that cables join, in a layout, m, shape (planes, sections)."""
    places = np.array([body.pose.place for body in layout.bodies])
    found = np.full(edge.present.shape, np.nan)
    found[edge.present] = np.linalg.norm(np.diff(places[edge.pairs], axis=1)[:, 0], axis=1)
    return found
