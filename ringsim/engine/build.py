"""From a scene to a model that is ready to be integrated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.boom import add_boom
from ringsim.engine.cables import CableDrive
from ringsim.engine.faults import Faults
from ringsim.engine.joints import add_friction, add_stops
from ringsim.engine.loads import add_loads
from ringsim.engine.net import add_net
from ringsim.engine.pantograph_ring import RingModel, build_ring
from ringsim.engine.ring_path import ring_path
from ringsim.engine.rods import Formulation
from ringsim.engine.rods_ancf import Ancf
from ringsim.engine.rods_geometrically_exact import GeometricallyExact
from ringsim.parts.rods.ancf import AncfRods
from ringsim.parts.rods.geometrically_exact import GeometricallyExactRods
from ringsim.scene import Scene

Array = NDArray[np.float64]

FORMULATIONS: dict[type, Formulation] = {
    GeometricallyExactRods: GeometricallyExact(),
    AncfRods: Ancf(),
}


@dataclass(frozen=True)
class Built:
    """A ring model with its optional parts.

    Attributes
    ----------
    hub
        Node of the net's hub; None without a net.
    forces
        Loads along z on the V-joints, shape (2, sections), N.
    stops
        Stop connectors, [plane][section]; empty without stops.
    cables
        The driving cables, if the scene has any.
    faults
        What breaks during the run.

    """

    ring: RingModel
    hub: Any
    forces: Array
    stops: list[list[Any]]
    cables: CableDrive | None
    faults: Faults


def build(scene: Scene) -> Built:
    """Build every part that the scene names, and nothing else."""
    ring = build_ring(scene, FORMULATIONS[type(scene.rods)])
    add_boom(ring)
    hub = add_net(ring)
    forces = add_loads(ring)
    add_friction(ring)
    stops = add_stops(ring)
    cables = None
    if scene.cables is not None:
        cables = CableDrive(ring, scene.cables, ring_path(ring, scene.cables))
    faults = Faults(ring, cables)
    ring.assembly.finish()
    if cables is not None:
        cables.locate()
    return Built(ring, hub, forces, stops, cables, faults)
