"""Geometrically exact beams on nodes with Euler parameters."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly
from ringsim.engine.rods import NodeFrames
from ringsim.engine.rotations import axes_of, spin
from ringsim.layout.pose import Pose

Array = NDArray[np.float64]


class GeometricallyExact:
    """Formulation of ``GeometricallyExactRods``."""

    has_strains = True
    constant_curvature = True

    def add_node(self, assembly: Assembly, pose: Pose) -> Any:
        """A node with position and Euler parameters."""
        return assembly.add_rigid_node(pose)

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """Exudyn's ObjectBeamGeometricallyExact, and a damper if the section is damped.

        exudyn's element takes no damping and says nothing of it.  Its strains are constant, so
        damping C eps_dot is a damper C / L between its ends' frames moved to its middle, where
        they coincide (``ringsim.engine.rod_dampers``).
        """
        damping = np.array(section.dampingMatrix) / length
        if damping.any():
            middle = np.array([0.5 * length, 0.0, 0.0])
            markers = [
                assembly.body_marker(assembly.add_body(node, 0.0, np.zeros((3, 3))), arm)
                for node, arm in zip(nodes, (middle, -middle), strict=True)
            ]
            tau = float(section.dampingMatrix[0][0] / section.stiffnessMatrix[0][0])
            number = assembly.dampers.add(assembly.system, markers, damping, tau)
        element = assembly.system.AddObject(
            item.ObjectBeamGeometricallyExact(nodeNumbers=nodes, length=length, sectionData=section)
        )
        if damping.any():
            assembly.dampers.numbers[int(element)] = number
        return element

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A body without inertia of its own: the beam lends the node its rotary inertia."""
        assembly.add_body(node, mass, np.zeros((3, 3)))

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """See ``Formulation``."""
        turned = coordinates[:, 3:7]
        axes, spins = axes_of(turned), spin(turned, rates[:, 3:7])
        z = axes[:, :, 2]
        return NodeFrames(axes[:, :, 1], z, np.sum(spins * z, axis=1))
