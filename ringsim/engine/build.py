"""From a scene to a model that is ready to be integrated."""

from typing import Any, NamedTuple

import exudyn.itemInterface as item
import numpy as np

from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.choice import kind_of
from ringsim.engine.cable_path import CablePath
from ringsim.engine.cables import CableDrive
from ringsim.engine.connectors import Reacting, Springs, Stops, connect
from ringsim.engine.edge import EdgeCables
from ringsim.engine.faults import Faults
from ringsim.engine.model import Multibody
from ringsim.engine.rods import Ancf
from ringsim.engine.weight import Weight
from ringsim.layout.bodies import OnBody
from ringsim.layout.layout import BoomBeam
from ringsim.layout.points import BOOM_TIP
from ringsim.parts.boom.flexible import FlexibleBoom
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
    if model.layout.boom is not None:
        _add_boom(model, model.layout.boom, weight)
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
    return Built(model, connectors, stops, cables, faults, weight, edge)


def _on_nodes(model: Multibody, sheave: Sheave) -> Sheave:
    """A sheave of the layout on the nodes that carry it."""
    if isinstance(sheave, BlockSheave):
        nodes = tuple(model.side_of(mount)[0] for mount in sheave.nodes)
        return BlockSheave(nodes, sheave.sense, sheave.offset)
    node, arm = model.side_of(sheave.node)
    axes = sheave.node.axes if isinstance(sheave.node, OnBody) else np.eye(3)
    return FixedSheave(node, arm + axes @ sheave.arm)


def _add_boom(model: Multibody, beam: BoomBeam, weight: Weight | None) -> None:
    """A flexible boom: a chain of elements, clamped at its top, with a body that slides along it.

    A rigid one is part of its hinge assembly.
    """
    assembly, boom = model.assembly, beam.record
    if not isinstance(boom, FlexibleBoom):
        raise TypeError(f"no builder for a boom of kind {kind_of(boom)}")
    ends = beam.top.body, beam.low.body
    top, low = (model.layout.bodies[number].pose.place for number in ends)
    (top_body, top_node), (low_body, _) = (model.bodies[number] for number in ends)
    start = assembly.starts[int(top_node)]
    spin, down, nodes = 2.0 * start[4:7], np.array([0.0, 0.0, -1.0]), []
    for drop in np.linspace(0.0, boom.length, boom.elements + 1):
        arm = drop * down
        point = item.NodePointSlope1(referenceCoordinates=[*(top + arm), *down])
        start_of = [start[:3] + np.cross(spin, arm), np.cross(spin, down)]
        nodes.append(assembly.add_node(point, np.concatenate(start_of)))
    model.loose[BOOM_TIP] = nodes[-1]
    length = boom.length / boom.elements
    cables = [
        assembly.system.AddObject(
            item.ObjectANCFCable(
                nodeNumbers=nodes[k : k + 2],
                length=length,
                massPerLength=boom.density * boom.tube.area,
                bendingStiffness=boom.young_modulus * boom.tube.second_moment,
                axialStiffness=boom.young_modulus * boom.tube.area,
            )
        )
        for k in range(boom.elements)
    ]
    assembly.bodies += cables
    assembly.beams += cables
    if weight is not None:
        weight.add_beam(cables, nodes, boom.mass / boom.elements, length)
    # The elements' nodes have a slope but no orientation: a second spherical joint holds the
    # direction, and the boom is inextensible between the two.
    for drop in (0.0, 0.1 * length):
        place = item.MarkerBodyPosition(bodyNumber=cables[0], localPosition=[drop, 0.0, 0.0])
        clamp = [assembly.body_marker(top_body, drop * down), assembly.system.AddMarker(place)]
        assembly.system.AddObject(item.ObjectJointSpherical(markerNumbers=clamp))
    _slide(model, low_body, cables, length, float(top[2] - low[2]))


def _slide(model: Multibody, body: Any, cables: list[Any], length: float, place: float) -> None:
    """Let the lower hinge assembly slide along elements of a length, from a place (m) on them."""
    system = model.assembly.system
    markers = [system.AddMarker(item.MarkerBodyBeamShape(bodyNumber=c)) for c in cables]
    element = min(int(place / length), len(cables) - 1)
    data = system.AddNode(
        item.NodeGenericData(initialCoordinates=[element, place], numberOfDataCoordinates=2)
    )
    system.AddObject(
        item.ObjectJointSliding(
            markerNumbers=[model.assembly.body_marker(body, np.zeros(3)), markers[element]],
            slidingMarkerNumbers=markers,
            slidingMarkerOffsets=[k * length for k in range(len(cables))],
            nodeNumber=data,
            constrainRotations=[0, 0, 0],
            constrainTranslations=[1, 1, 1],
        )
    )
