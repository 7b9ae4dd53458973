"""Net springs from the upper corners to a free hub.

The hub starts where its strings balance: from anywhere else it would swing for the whole run, next
to weightless as it is, with the energy of its first stretch.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.model import Model

Array = NDArray[np.float64]
_ONSET = 1e-4
"""Stretch in m over which the damping of a spring comes in."""


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
    for rate, node in zip(held.stiffness, nodes, strict=True):
        settings: dict[str, Any] = {"stiffness": float(rate), "damping": net.damping}
        if not net.two_sided:
            settings["springForceUserFunction"] = assembly.symbolic(
                "net",
                _one_sided,
                "ObjectConnectorSpringDamper",
                "springForceUserFunction",
            )
        end = assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=node))
        assembly.system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=[middle, end], referenceLength=net.neutral_length, **settings
            )
        )
    return hub


def _one_sided(
    mbs: Any, t: Any, itemNumber: Any, deltaL: Any, deltaL_t: Any,  # noqa: N803
    stiffness: Any, damping: Any, force: Any,
) -> Any:  # fmt: skip
    least, most = exu.symbolic.min, exu.symbolic.max
    stretch = most(deltaL, 0.0)
    return most(stiffness * stretch + damping * deltaL_t * least(stretch / _ONSET, 1.0), 0.0)


def net_forces(
    stretch: Array, rate: Array, stiffness: Array, damping: float, *, two_sided: bool
) -> tuple[Array, Array]:
    """Spring and damper parts of the tensions, N; the same law in numpy."""
    if two_sided:
        return stiffness * stretch, damping * rate
    taut = np.maximum(stretch, 0.0)
    spring = stiffness * taut
    damper = damping * rate * np.minimum(taut / _ONSET, 1.0)
    return spring, np.maximum(damper, -spring)
