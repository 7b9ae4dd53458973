"""Building rods: one function a formulation, found by the kind of the scene's rods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly
from ringsim.layout import bodies as parts
from ringsim.layout.pose import Pose
from ringsim.parts.rods.family import Rods

Array = NDArray[np.float64]


class BuiltRod(NamedTuple):
    """A chain of beam elements, one fewer than nodes, from start to end.

    The nodes' frames have x along the rod and z along the section's normal.
    """

    nodes: list[Any]
    elements: list[Any]


class NodeFrames(NamedTuple):
    """Frames of n rod nodes: y and z axes (n, 3), rates about z (n,), rad/s."""

    y: Array
    z: Array
    spin: Array


class Formulation(Protocol):
    """What a rod formulation must offer."""

    has_strains: bool
    """Whether exudyn reports strains, forces and moments of its elements."""
    constant_curvature: bool
    """Whether the curvature is constant in an element."""

    def add_node(self, assembly: Assembly, pose: Pose) -> Any:
        """A node of this formulation; as for ``Assembly.add_rigid_node``."""

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """An element between two nodes."""

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A point mass at a node."""

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """Frames of nodes from their total coordinates and rates, shape (n, coordinates)."""


def beam_section(rods: Rods, part: parts.Rod, constant_over: float) -> Any:
    """Exudyn's section data: stiffness diag(EA, kGA, kGA, GJ, EI, EI) and inertia.

    An element of constant curvature misses the bending by the part of the moment that is linear
    along it: a cantilever of one element is a quarter too stiff.  Its residual flexibility
    L^2 / 12 EI belongs to the shear force alone, so it is given to the shear, 1 / kGA +
    L^2 / 12 EI; the nodes of a rod that is loaded at its nodes are then exact with any number of
    elements (MacNeal, A simple quadrilateral shell element, 1978).

    Parameters
    ----------
    constant_over
        Length over which the curvature is constant, m; 0 for elements that bend by themselves.
    """
    young, area, second = part.young_modulus, part.tube.area, part.tube.second_moment
    shear = young * rods.shear_modulus_ratio
    direct = part.tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + constant_over**2 / (12.0 * young * second))
    bending = young * second
    stiffness = np.diag([young * area, across, across, shear * 2.0 * second, bending, bending])
    section = exu.BeamSection()
    section.massPerLength = rods.density * area
    section.inertia = rods.density * np.diag([2.0 * second, second, second])
    section.stiffnessMatrix = stiffness
    section.dampingMatrix = rods.damping * stiffness
    return section


def add_rod(
    assembly: Assembly,
    formulation: Formulation,
    part: parts.Rod,
    poses: Sequence[Pose],
    rods: Rods,
) -> BuiltRod:
    """A rod of the layout with the poses of its nodes; as for ``Assembly.add_rigid_node``."""
    nodes = [formulation.add_node(assembly, pose) for pose in poses]
    elements = []
    for k, length in enumerate(part.lengths.tolist()):
        section = beam_section(rods, part, length if formulation.constant_curvature else 0.0)
        elements.append(formulation.add_element(assembly, nodes[k : k + 2], length, section))
    assembly.bodies += elements
    return BuiltRod(nodes, elements)
