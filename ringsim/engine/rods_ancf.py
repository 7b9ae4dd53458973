"""The papers' beams: absolute nodal coordinates with two slope vectors a node."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly
from ringsim.engine.rods import NodeFrames
from ringsim.layout.pose import Pose

Array = NDArray[np.float64]


class Ancf:
    """Formulation of ``AncfRods``: 9 coordinates a node, 18 an element."""

    has_strains = False
    constant_curvature = False

    def add_node(self, assembly: Assembly, pose: Pose) -> Any:
        """A node with position and the slope vectors along y and z."""
        y, z = pose.axes[:, 1], pose.axes[:, 2]
        return assembly.add_node(
            item.NodePointSlope23(referenceCoordinates=[*pose.place, *y, *z]),
            np.concatenate([pose.rate, np.cross(pose.turn, y), np.cross(pose.turn, z)]),
        )

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """Exudyn's ObjectANCFBeam."""
        return assembly.system.AddObject(
            item.ObjectANCFBeam(nodeNumbers=nodes, length=length, sectionData=section)
        )

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A mass matrix that acts on the node's position alone."""
        matrix = np.zeros((9, 9))
        matrix[:3, :3] = mass * np.eye(3)
        body = item.ObjectGenericODE2(nodeNumbers=[node], massMatrix=matrix)
        assembly.bodies.append(assembly.system.AddObject(body))

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """See ``Formulation``; the spin is that of the slope along y about the one along z."""
        y, z = coordinates[:, 3:6], coordinates[:, 6:9]
        length = np.linalg.norm(y, axis=1)
        normal = z / np.linalg.norm(z, axis=1)[:, None]
        spin = np.sum(np.cross(y, rates[:, 3:6]) * normal, axis=1) / length**2
        return NodeFrames(y / length[:, None], normal, spin)
