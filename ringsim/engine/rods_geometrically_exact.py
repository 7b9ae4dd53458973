"""Geometrically exact beams on nodes with Euler parameters."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine import quaternions
from ringsim.engine.assembly import Assembly, Frame
from ringsim.engine.rods import NodeFrames

Array = NDArray[np.float64]


class GeometricallyExact:
    """Formulation of ``GeometricallyExactRods``."""

    has_strains = True

    def add_node(self, assembly: Assembly, frame: Frame) -> Any:
        """A node with position and Euler parameters."""
        return assembly.add_rigid_node(frame)

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """Exudyn's ObjectBeamGeometricallyExact."""
        return assembly.system.AddObject(
            item.ObjectBeamGeometricallyExact(
                nodeNumbers=nodes,
                length=length,
                sectionData=section,
            )
        )

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A body without inertia of its own: the beam lends the node its rotary inertia."""
        assembly.add_body(node, mass, np.zeros((3, 3)))

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """See ``Formulation``."""
        turned = coordinates[:, 3:7]
        axes = quaternions.axes_of(turned)
        spin = quaternions.angular_velocity(turned, rates[:, 3:7])
        z = axes[:, :, 2]
        return NodeFrames(coordinates[:, :3], axes[:, :, 1], z, np.sum(spin * z, axis=1))
