"""Net springs from the upper corners to a free hub.

The hub starts where its strings balance: from anywhere else it would swing for the whole run, next
to weightless as it is, with the energy of its first stretch.
"""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.assembly import Assembly
from ringsim.engine.laws import SYMBOLIC, symbolic_law
from ringsim.engine.model import Model
from ringsim.parts.net import Net
from ringsim.parts.persection import at_section


def add_net(model: Model) -> Any:
    """Build hub and springs of a layout with a net; returns the hub's node, None without."""
    net, held = model.scene.net, model.layout.net
    if net is None or held is None:
        return None
    assembly = model.assembly
    hub = assembly.system.AddNode(item.NodePoint(referenceCoordinates=list(held.hub)))
    nodes = [model.bodies[number][1] for number in held.bodies]
    starts = [assembly.starts[int(node)][:3] for node in nodes]
    assembly.starts[int(hub)] = np.mean(starts, axis=0)
    body = assembly.system.AddObject(item.ObjectMassPoint(nodeNumber=hub, mass=held.mass))
    assembly.bodies.append(body)
    middle = assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=hub))
    for corner, node in enumerate(nodes):
        far = assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=node))
        assembly.system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=[middle, far],
                referenceLength=net.neutral_length,
                **_string(assembly, at_section(net, corner)),
            )
        )
    return hub


def _string(assembly: Assembly, net: Net) -> dict[str, Any]:
    linear = {"stiffness": net.stiffness, "damping": net.damping}
    if net.two_sided:
        return linear
    return linear | symbolic_law(
        assembly,
        "ObjectConnectorSpringDamper",
        net,
        lambda stretch, rate, _: net.tension(stretch, rate, SYMBOLIC).total,
    )
