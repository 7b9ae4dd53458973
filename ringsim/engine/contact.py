"""One-sided contact of a body with a plane."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item

from ringsim.engine.assembly import Assembly
from ringsim.engine.laws import SYMBOLIC, symbolic_law

_KIND = "ObjectConnectorCoordinateSpringDamper"


def add_contact(assembly: Assembly, node: Any, axis: int, law: Any, away: float) -> None:
    """A contact that begins when a node has come ``away`` (m) closer along an axis of space."""
    system = assembly.system
    ground = system.AddNode(item.NodePointGround())
    markers = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=end, coordinate=axis))
        for end in (ground, node)
    ]
    settings = symbolic_law(
        assembly,
        _KIND,
        ("contact", away),
        lambda moved, rate, _: -law.push(-away - moved, -rate, SYMBOLIC).total,
    )
    system.AddObject(item.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers, **settings))
