"""From a scene to a model that is ready to be integrated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.engine.boom import add_boom
from ringsim.engine.cable_path import CablePath
from ringsim.engine.cables import CableDrive
from ringsim.engine.connectors import Reacting, Stops, connect
from ringsim.engine.faults import Faults
from ringsim.engine.model import Multibody
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


class Built(NamedTuple):
    """A model with its optional parts.

    Attributes
    ----------
    connectors
        What pushes, pulls and brakes, for the energy balance.
    stops, cables
        Those of the scene, if it has any.
    faults
        What breaks during the run.
    """

    model: Multibody
    connectors: list[Reacting]
    stops: Stops | None
    cables: CableDrive | None
    faults: Faults


def build(scene: Scene) -> Built:
    """Build every part that the scene names, and nothing else."""
    model = Multibody(scene, FORMULATIONS[type(scene.rods)])
    add_boom(model)
    connectors, stops, cables = connect(model), None, None
    if scene.stop is not None:
        stops = Stops(model, scene.stop)
        connectors.append(stops.reaction)
    if scene.cables is not None:
        paths = [[_on_nodes(model, sheave) for sheave in path] for path in model.layout.paths]
        path = CablePath(paths, slopes=isinstance(model.formulation, Ancf))
        cables = CableDrive(model.assembly, scene.cables, path, len(scene.faults))
    faults = Faults(model, cables)
    connectors += [joint.reaction for joint in faults.joints]
    model.assembly.finish()
    return Built(model, connectors, stops, cables, faults)


def _on_nodes(model: Multibody, sheave: Sheave) -> Sheave:
    """A sheave of the layout on the nodes that carry it."""
    if isinstance(sheave, BlockSheave):
        nodes = tuple(model.side_of(mount)[0] for mount in sheave.nodes)
        return BlockSheave(nodes, sheave.sense, sheave.offset)
    node, arm = model.side_of(sheave.node)
    axes = sheave.node.axes if isinstance(sheave.node, OnBody) else np.eye(3)
    return FixedSheave(node, arm + axes @ sheave.arm)
