"""The paths of a ring's cables: which points, on which nodes."""

from __future__ import annotations

import numpy as np

from ringsim.cable.bracket.bar_half import BarHalfBracket
from ringsim.cable.cables import Cables
from ringsim.cable.records import Cable
from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.engine.cable_path import CablePath
from ringsim.engine.pantograph_ring import RingModel
from ringsim.engine.rods_ancf import Ancf


def ring_path(model: RingModel, cables: Cables) -> CablePath:
    """The paths of a ring's cables, each from its first winch."""
    paths: list[list[Sheave]] = []
    for plane, cable in cables.present():
        path = _pulleys(model, plane, cable)
        if cable.end == "last":
            path = path[::-1]
        path = [_winch(path[0], plane, cables.winch_distance), *path]
        if cable.end == "both":
            path.append(_winch(path[-1], plane, cables.winch_distance))
        paths.append(path)
    return CablePath(paths, slopes=isinstance(model.formulation, Ancf))


def _pulleys(model: RingModel, plane: int, cable: Cable) -> list[Sheave]:
    """Points from the first hinge pulley of section 1 to the second one of the last section."""
    fold = model.fold
    nodes = [node for _, node in model.hinges[plane]]
    path: list[Sheave] = []
    for section in range(model.geometry.sections):
        following = (section + 1) % len(nodes)
        left = fold.left[plane, section] - fold.corners[plane, section]
        right = fold.right[plane, section] - fold.corners[plane, following]
        path.append(FixedSheave(nodes[section], left))
        path.append(_v_pulley(model, plane, section, cable))
        path.append(FixedSheave(nodes[following], right))
    return path


def _v_pulley(model: RingModel, plane: int, section: int, cable: Cable) -> Sheave:
    """The pulley beside a V-joint: on the bisector, or fixed on the node of a bar half."""
    joint, sense = model.vjoints[plane][section], 1.0 if plane == 0 else -1.0
    bracket = cable.bracket
    if not isinstance(bracket, BarHalfBracket):
        return BlockSheave(joint.gap[0], joint.gap[1], sense, cable.block_offset)
    aside, inwards = bracket.place(model.scene.structure.initial_phi, cable.block_offset)
    place = aside * model.geometry.directions[section] - sense * inwards * np.array([0.0, 0.0, 1.0])
    side, node = ("left", joint.gap[0]) if bracket.half == "first" else ("right", joint.gap[1])
    axes = model.rods[f"bar_{('upper', 'lower')[plane]}_{side}"][section].axes
    return FixedSheave(node, axes.T @ place)


def _winch(nearest: Sheave, plane: int, distance: float) -> FixedSheave:
    """The winch of the hinge pulley at an end of the path, a distance (m) inwards from it."""
    assert isinstance(nearest, FixedSheave)
    inward = np.array([0.0, 0.0, -1.0 if plane == 0 else 1.0])
    return FixedSheave(nearest.node, nearest.arm + distance * inward)
