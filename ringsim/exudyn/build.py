"""From a scene to a model that is ready to be integrated: boom, connectors, cables."""

from typing import Any, NamedTuple

import exudyn.itemInterface as item
import numpy as np

from ringsim.cable.records import BlockSheave, FixedSheave, Sheave
from ringsim.exudyn.cable_path import CablePath
from ringsim.exudyn.cables import CableDrive
from ringsim.exudyn.laws import AngleForces, Reacting, Weight, connect
from ringsim.exudyn.model import Multibody
from ringsim.exudyn.rods import Ancf
from ringsim.layout.bodies import OnBody
from ringsim.layout.layout import BoomBeam
from ringsim.layout.points import BOOM_TIP
from ringsim.scene import Scene

# A flexible boom: a chain of elements, clamped at its top, with a body that slides along it.
#
# A rigid one is part of its hinge assembly.


_DOWN = np.array([0.0, 0.0, -1.0])
"""Along the boom, in the axes of the body at its top."""


class Boom:
    """The elements of a boom in a model before it is assembled, with the joint that slides on them.

    One unknown of exudyn's sliding joint is how far the body slides in a step, d, and the equation
    that finds it is t . f = 0 (slope of the boom, force of the joint).  exudyn takes each unknown
    times the gradient of its equation for a force: that is d f S'(s) on the boom, S its shape
    functions, besides the joint's own f S(s).  It has no resultant but a moment d t x f that
    nothing answers, of the first order in the step, which turned free structures.  It vanishes with
    d, which exudyn adds to the place on the boom that the joint remembers after a step only;
    ``settle`` does so before every residual, so that Newton's method ends where d = 0.
    """

    def __init__(self, model: Multibody, beam: BoomBeam, weight: Weight | None) -> None:
        assembly, boom = model.assembly, beam.record
        self._data, self._unknown = assembly.system.systemData, -1
        top, pose = model.bodies[beam.top.body][0], model.layout.pose(beam.top)
        down, spin = pose.axes @ _DOWN, model.moving.turning(pose.turn)
        nodes = []
        for drop in np.linspace(0.0, boom.length, boom.elements + 1):
            place, rate = pose.at(drop * _DOWN)
            point = item.NodePointSlope1(referenceCoordinates=[*place, *down])
            start = [model.moving.at(place, rate), np.cross(spin, down)]
            nodes.append(assembly.add_node(point, np.concatenate(start)))
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
        for drop in (0.0, 0.001 * length):
            place = item.MarkerBodyPosition(bodyNumber=cables[0], localPosition=[drop, 0.0, 0.0])
            clamp = [assembly.body_marker(top, drop * _DOWN), assembly.system.AddMarker(place)]
            assembly.system.AddObject(item.ObjectJointSpherical(markerNumbers=clamp))
        low = model.layout.pose(beam.low).place
        self._slide(model, beam.low.body, cables, length, float((low - pose.place) @ down))

    def settle(self) -> None:
        """Due before every residual."""
        if self._unknown < 0:
            self._unknown = self._data.GetObjectLTGAE(self._joint)[0]
            self._place = self._data.GetNodeLTGData(self._node)[1]
        now = self._data.GetSystemStateDict(reference=True)
        now["dataCoords"][self._place] += now["AECoords"][self._unknown]
        now["AECoords"][self._unknown] = 0.0

    def _slide(
        self, model: Multibody, body: int, cables: list[Any], length: float, place: float
    ) -> None:
        """Let a body slide along elements of a length, from a place (m) on them."""
        system = model.assembly.system
        markers = [system.AddMarker(item.MarkerBodyBeamShape(bodyNumber=c)) for c in cables]
        element = min(int(place / length), len(cables) - 1)
        self._node = system.AddNode(
            item.NodeGenericData(initialCoordinates=[element, place], numberOfDataCoordinates=2)
        )
        sliding = model.assembly.body_marker(model.bodies[body][0], np.zeros(3))
        self._joint = system.AddObject(
            item.ObjectJointSliding(
                markerNumbers=[sliding, markers[element]],
                slidingMarkerNumbers=markers,
                slidingMarkerOffsets=[k * length for k in range(len(cables))],
                nodeNumber=self._node,
                constrainRotations=[0, 0, 0],
                constrainTranslations=[1, 1, 1],
            )
        )


# From a scene to a model that is ready to be integrated.


class Built(NamedTuple):
    """A model with what pushes, pulls and brakes in it, and those parts that a scene may lack."""

    model: Multibody
    connectors: list[Reacting]
    angles: AngleForces
    cables: CableDrive | None
    weight: Weight | None
    boom: Boom | None


def build(scene: Scene) -> Built:
    """Build every part that the scene names, and nothing else.

    Raises
    ------
    InputError
        If the structure has no joint for a friction law, the stop or a fault.
    """
    model, cables = Multibody(scene), None
    gravity = model.layout.gravity
    weight = None if gravity is None else Weight(model, gravity)
    beam = model.layout.boom
    boom = None if beam is None else Boom(model, beam, weight)
    connectors = connect(model, weight)
    angles = AngleForces(model)
    connectors += [angles.reaction(number) for number in range(len(angles.switches.laws))]
    if scene.cables is not None:
        paths = [[_on_nodes(model, sheave) for sheave in path] for path in model.layout.paths]
        path = CablePath(paths, slopes=isinstance(model.formulation, Ancf))
        cables = CableDrive(model.assembly, scene.cables, path, len(scene.faults))
    model.assembly.finish()
    return Built(model, connectors, angles, cables, weight, boom)


def _on_nodes(model: Multibody, sheave: Sheave) -> Sheave:
    """A sheave of the layout on the nodes that carry it."""
    if isinstance(sheave, BlockSheave):
        nodes = tuple(model.side_of(mount)[0] for mount in sheave.nodes)
        return BlockSheave(nodes, sheave.sense, sheave.offset)
    node, arm = model.side_of(sheave.node)
    axes = sheave.node.axes if isinstance(sheave.node, OnBody) else np.eye(3)
    return FixedSheave(node, arm + axes @ sheave.arm)
