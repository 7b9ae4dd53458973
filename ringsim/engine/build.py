"""From a scene to a model that is ready to be integrated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.engine.boom import add_boom
from ringsim.engine.cable_path import CablePath
from ringsim.engine.cables import CableDrive
from ringsim.engine.faults import Faults
from ringsim.engine.joints import add_friction, add_stops
from ringsim.engine.model import Model, assemble, side_of
from ringsim.engine.net import add_net
from ringsim.engine.rods import Formulation
from ringsim.engine.rods_ancf import Ancf
from ringsim.engine.rods_geometrically_exact import GeometricallyExact
from ringsim.layout.bodies import OnBody
from ringsim.parts.rods.ancf import AncfRods
from ringsim.parts.rods.geometrically_exact import GeometricallyExactRods
from ringsim.scene import Scene

FORMULATIONS: dict[type, Formulation] = {
    GeometricallyExactRods: GeometricallyExact(),
    AncfRods: Ancf(),
}


@dataclass(frozen=True)
class Built:
    """A model with its optional parts.

    Attributes
    ----------
    hub
        Node of the net's hub; None without a net.
    stops
        Stop connectors, [plane][section]; empty without stops.
    cables
        The driving cables, if the scene has any.
    faults
        What breaks during the run.

    """

    model: Model
    hub: Any
    stops: list[list[Any]]
    cables: CableDrive | None
    faults: Faults


def build(scene: Scene) -> Built:
    """Build every part that the scene names, and nothing else."""
    model = assemble(scene, FORMULATIONS[type(scene.rods)])
    add_boom(model)
    hub = add_net(model)
    add_friction(model)
    stops = add_stops(model)
    cables = None
    if scene.cables is not None:
        paths = [[_on_nodes(model, sheave) for sheave in path] for path in model.layout.paths]
        path = CablePath(paths, slopes=isinstance(model.formulation, Ancf))
        cables = CableDrive(model, scene.cables, path)
    faults = Faults(model, cables)
    model.assembly.finish()
    if cables is not None:
        cables.locate()
    return Built(model, hub, stops, cables, faults)


def _on_nodes(model: Model, sheave: Sheave) -> Sheave:
    """A sheave of the layout on the nodes that carry it."""
    if isinstance(sheave, BlockSheave):
        left, right = (side_of(model, mount)[0] for mount in (sheave.left, sheave.right))
        return BlockSheave(left, right, sheave.sense, sheave.offset)
    node, arm = side_of(model, sheave.node)
    axes = sheave.node.axes if isinstance(sheave.node, OnBody) else np.eye(3)
    return FixedSheave(node, arm + axes @ sheave.arm)
