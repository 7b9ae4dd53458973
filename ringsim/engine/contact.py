"""One-sided contact of a body with a plane."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item

from ringsim.engine.assembly import Assembly

_ONSET = 1e-5
"""Depth in metre over which the damping of the rest comes in, so that contact starts smoothly."""


def add_contact(assembly: Assembly, node: Any, axis: int, law: Any, away: float) -> None:
    """A contact that begins when a node has come ``away`` (m) closer along an axis."""
    system = assembly.system
    ground = system.AddNode(item.NodePointGround())
    markers = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=end, coordinate=axis))
        for end in (ground, node)
    ]
    function = assembly.symbolic(
        ("contact", away),
        _law(law, away),
        "ObjectConnectorCoordinateSpringDamper",
        "springForceUserFunction",
    )
    system.AddObject(
        item.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=markers, springForceUserFunction=function
        )
    )


def contact_force(law: Any, depth: float, rate: float) -> tuple[float, float]:
    """The same law in numpy: whole push and its elastic part, N.

    Parameters
    ----------
    depth, rate
        Of the contact, m, and rate at which the body leaves it, m/s.
    """
    inside = max(depth, 0.0)
    spring = law.stiffness * inside
    return max(spring - law.damping * rate * min(inside / _ONSET, 1.0), 0.0), spring


def _law(law: Any, away: float) -> Any:
    k, d = law.stiffness, law.damping

    def push(
        mbs: Any, t: Any, itemNumber: Any, displacement: Any, velocity: Any,  # noqa: N803
        stiffness: Any, damping: Any, offset: Any,
    ) -> Any:  # fmt: skip
        least, most = exu.symbolic.min, exu.symbolic.max
        depth = most(-away - displacement, 0.0)
        return -most(k * depth - d * velocity * least(depth / _ONSET, 1.0), 0.0)

    return push
