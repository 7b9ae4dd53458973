"""From a scene to a model that is ready to be integrated."""

from typing import NamedTuple

import numpy as np

from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.engine.boom import Boom
from ringsim.engine.cable_path import CablePath
from ringsim.engine.cables import CableDrive
from ringsim.engine.connectors import Reacting, Springs, Stops, connect
from ringsim.engine.edge import EdgeCables
from ringsim.engine.faults import Faults
from ringsim.engine.model import Multibody
from ringsim.engine.rods import Ancf
from ringsim.engine.weight import Weight
from ringsim.layout.bodies import OnBody
from ringsim.scene import Scene


class Built(NamedTuple):
    """A model with what pushes, pulls and brakes in it, and those parts that a scene may lack."""

    model: Multibody
    connectors: list[Reacting]
    stops: Stops | None
    cables: CableDrive | None
    faults: Faults
    weight: Weight | None
    edge: EdgeCables | None
    boom: Boom | None


def build(scene: Scene) -> Built:
    """Build every part that the scene names, and nothing else.

    Raises
    ------
    InputError
        If the structure has no joint for a friction law, the stop or a fault.
    """
    model, stops, springs, cables = Multibody(scene), None, None, None
    gravity = model.layout.gravity
    weight = None if gravity is None else Weight(model, gravity)
    beam = model.layout.boom
    boom = None if beam is None else Boom(model, beam, weight)
    connectors = connect(model, weight)
    edge = None if model.layout.edge is None else EdgeCables(model, model.layout.edge)
    if edge is not None:
        connectors.append(edge.reaction)
    if scene.stop is not None:
        stops = Stops(model, scene.stop)
        connectors.append(stops.reaction)
    if scene.hinge_spring is not None:
        springs = Springs(model, "hinge_spring", scene.hinge_spring)
        connectors.append(springs.reaction)
    if scene.latch is not None and scene.latch.pushes:
        connectors.append(Springs(model, "latch", scene.latch).reaction)
    if scene.cables is not None:
        paths = [[_on_nodes(model, sheave) for sheave in path] for path in model.layout.paths]
        path = CablePath(paths, slopes=isinstance(model.formulation, Ancf))
        cables = CableDrive(model.assembly, scene.cables, path, len(scene.faults))
    faults = Faults(model, cables, springs)
    connectors += [joint.reaction for joint in faults.joints]
    model.assembly.finish()
    return Built(model, connectors, stops, cables, faults, weight, edge, boom)


def _on_nodes(model: Multibody, sheave: Sheave) -> Sheave:
    """A sheave of the layout on the nodes that carry it."""
    if isinstance(sheave, BlockSheave):
        nodes = tuple(model.side_of(mount)[0] for mount in sheave.nodes)
        return BlockSheave(nodes, sheave.sense, sheave.offset)
    node, arm = model.side_of(sheave.node)
    axes = sheave.node.axes if isinstance(sheave.node, OnBody) else np.eye(3)
    return FixedSheave(node, arm + axes @ sheave.arm)
