"""The paths of a ring's cables: which points, on which nodes."""

from __future__ import annotations

import numpy as np

from ringsim.cable.cables import Cables
from ringsim.engine.cable_path import BlockStop, CablePath, FixedStop, Stop
from ringsim.engine.pantograph_ring import RingModel
from ringsim.engine.rods_ancf import Ancf
from ringsim.engine.slope_path import SlopePath


def ring_path(model: RingModel, cables: Cables) -> CablePath:
    """The paths of a ring's cables, each from its first winch."""
    paths: list[list[Stop]] = []
    for plane, cable in cables.present():
        path = _pulleys(model, plane, cable.block_offset)
        if cable.end == "last":
            path = path[::-1]
        path = [_winch(path[0], plane, cables.winch_distance), *path]
        if cable.end == "both":
            path.append(_winch(path[-1], plane, cables.winch_distance))
        paths.append(path)
    kind = SlopePath if isinstance(model.formulation, Ancf) else CablePath
    return kind(paths)


def _pulleys(model: RingModel, plane: int, offset: float) -> list[Stop]:
    """Points from the first hinge pulley of section 1 to the second one of the last section."""
    fold = model.fold
    sense = 1.0 if plane == 0 else -1.0
    nodes = [node for _, node in model.hinges[plane]]
    path: list[Stop] = []
    for section in range(model.geometry.sections):
        following = (section + 1) % len(nodes)
        left = fold.left[plane, section] - fold.corners[plane, section]
        right = fold.right[plane, section] - fold.corners[plane, following]
        vjoint = model.vjoints[plane][section]
        path.append(FixedStop(nodes[section], left))
        path.append(BlockStop(vjoint.gap[0], vjoint.gap[1], sense, offset))
        path.append(FixedStop(nodes[following], right))
    return path


def _winch(nearest: Stop, plane: int, distance: float) -> FixedStop:
    """The winch of the hinge pulley at an end of the path, a distance (m) inwards from it."""
    assert isinstance(nearest, FixedStop)
    inward = np.array([0.0, 0.0, -1.0 if plane == 0 else 1.0])
    return FixedStop(nearest.node, nearest.arm + distance * inward)
