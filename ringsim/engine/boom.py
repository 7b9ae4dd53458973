"""A flexible boom: a chain of elements, clamped at its top, with a body that slides along it."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.choice import kind_of
from ringsim.engine.assembly import Assembly
from ringsim.engine.model import Multibody
from ringsim.parts.boom.flexible import FlexibleBoom


def add_boom(model: Multibody) -> None:
    """The flexible boom, if there is one; a rigid one is part of its hinge assembly."""
    layout, assembly, system = model.layout, model.assembly, model.assembly.system
    if layout.boom is None:
        return
    boom = layout.boom.record
    if not isinstance(boom, FlexibleBoom):
        raise TypeError(f"no builder for a boom of kind {kind_of(boom)}")
    ends = layout.boom.top.body, layout.boom.low.body
    top, low = (layout.bodies[number].pose.place for number in ends)
    (top_body, top_node), (low_body, _) = (model.bodies[number] for number in ends)
    start = assembly.starts[int(top_node)]
    spin = 2.0 * start[4:7]
    nodes = []
    for drop in np.linspace(0.0, boom.length, boom.elements + 1):
        arm = np.array([0.0, 0.0, -drop])
        node = assembly.add_node(
            item.NodePointSlope1(referenceCoordinates=[*(top + arm), 0.0, 0.0, -1.0]),
            np.concatenate([start[:3] + np.cross(spin, arm), np.cross(spin, [0.0, 0.0, -1.0])]),
        )
        nodes.append(node)
    length = boom.length / boom.elements
    cables = [
        system.AddObject(
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
    _clamp(assembly, top_body, cables[0], 0.1 * length)
    _slide(assembly, low_body, cables, length, float(top[2] - low[2]))


def _clamp(assembly: Assembly, body: Any, cable: Any, reach: float) -> None:
    """Hold the boom's end on the upper hinge assembly at two points, ``reach`` apart.

    The element's nodes have a slope but no orientation, so the direction is held by a second
    spherical joint; the boom is inextensible between the two.
    """
    system = assembly.system
    for drop in (0.0, reach):
        place = item.MarkerBodyPosition(bodyNumber=cable, localPosition=[drop, 0.0, 0.0])
        markers = [assembly.body_marker(body, np.array([0.0, 0.0, -drop])), system.AddMarker(place)]
        system.AddObject(item.ObjectJointSpherical(markerNumbers=markers))


def _slide(assembly: Assembly, body: Any, cables: list[Any], length: float, place: float) -> None:
    """Let the lower hinge assembly slide along the chain of elements."""
    system = assembly.system
    markers = [system.AddMarker(item.MarkerBodyBeamShape(bodyNumber=c)) for c in cables]
    element = min(int(place / length), len(cables) - 1)
    data = system.AddNode(
        item.NodeGenericData(initialCoordinates=[element, place], numberOfDataCoordinates=2)
    )
    system.AddObject(
        item.ObjectJointSliding(
            markerNumbers=[assembly.body_marker(body, np.zeros(3)), markers[element]],
            slidingMarkerNumbers=markers,
            slidingMarkerOffsets=[k * length for k in range(len(cables))],
            nodeNumber=data,
            constrainRotations=[0, 0, 0],
            constrainTranslations=[1, 1, 1],
        )
    )
