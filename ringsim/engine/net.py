"""Net springs from the upper corners to a free hub.

The hub starts where its strings balance: from anywhere else it would swing for the whole run, next
to weightless as it is, with the energy of its first stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.pantograph_ring import RingModel
from ringsim.parts.persection import spread
from ringsim.theory.ideal_net import FreeHub

Array = NDArray[np.float64]
_ONSET = 1e-4
"""Stretch in m over which the damping of a spring comes in."""


@dataclass(frozen=True)
class HubNet:
    """The hub's node and the springs' constants.

    Attributes
    ----------
    hub
        Node of the hub.
    stiffness
        Spring rates, one per upper corner, N/m.

    """

    hub: Any
    stiffness: Array


def add_net(model: RingModel) -> HubNet | None:
    """The hub and its springs, if the scene has a net."""
    net = model.scene.net
    if net is None:
        return None
    assembly = model.assembly
    corners = model.fold.corners[0]
    hub = assembly.system.AddNode(
        item.NodePoint(
            referenceCoordinates=list(FreeHub(net, len(corners)).hub(corners)),
        )
    )
    starts = [assembly.starts[int(node)][:3] for _, node in model.hinges[0]]
    assembly.starts[int(hub)] = np.mean(starts, axis=0)
    body = assembly.system.AddObject(
        item.ObjectMassPoint(
            nodeNumber=hub,
            mass=net.hub_mass,
        )
    )
    assembly.bodies.append(body)
    middle = assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=hub))
    stiffness = spread(net.stiffness, len(corners))
    for rate, (_, node) in zip(stiffness, model.hinges[0], strict=True):
        settings: dict[str, Any] = {"stiffness": float(rate), "damping": net.damping}
        if not net.two_sided:
            settings["springForceUserFunction"] = assembly.symbolic(
                "net",
                _one_sided,
                "ObjectConnectorSpringDamper",
                "springForceUserFunction",
            )
        assembly.system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=[
                    middle,
                    assembly.system.AddMarker(item.MarkerNodePosition(nodeNumber=node)),
                ],
                referenceLength=net.neutral_length,
                **settings,
            )
        )
    return HubNet(hub, stiffness)


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
