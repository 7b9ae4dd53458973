"""Rods as chains of beam elements, in the formulation of the scene's kind of rods."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.exudyn.assembly import Array, Assembly, axes_of, spin
from ringsim.layout import bodies as parts
from ringsim.layout.bodies import Pose
from ringsim.parts.rods import AncfRods, GeometricallyExactRods, Rods


class BuiltRod(NamedTuple):
    """A chain of beam elements; its nodes' axes: x along the rod, z along the joints' axis."""

    nodes: list[Any]
    elements: list[Any]


class NodeFrames(NamedTuple):
    """Frames of n rod nodes: y and z axes (n, 3), rates about z (n,), rad/s."""

    y: Array
    z: Array
    spin: Array


class GeometricallyExact:
    """Geometrically exact beams of constant strain on nodes with Euler parameters."""

    has_strains = True
    """Whether exudyn reports strains, forces and moments of the elements."""
    constant_curvature = True

    def add_node(self, assembly: Assembly, pose: Pose, natural: Pose | None) -> Any:
        """A node at a pose; as for ``Assembly.add_rigid_node``."""
        return assembly.add_rigid_node(pose, natural)

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """Exudyn's ObjectBeamGeometricallyExact, and a damper if the section is damped.

        exudyn's element takes no damping and says nothing of it.  Its strains are constant, so
        damping C eps_dot is a damper C / L between its ends' frames moved to its middle, where
        they coincide (``ringsim.exudyn.assembly``).
        """
        damping = np.array(section.dampingMatrix) / length
        if damping.any():
            middle = np.array([0.5 * length, 0.0, 0.0])
            markers = [
                assembly.body_marker(assembly.add_body(node, 0.0, np.zeros((3, 3))), arm)
                for node, arm in zip(nodes, (middle, -middle), strict=True)
            ]
            tau = float(section.dampingMatrix[0][0] / section.stiffnessMatrix[0][0])
            assembly.dampers.add(markers, damping, tau)
        return assembly.system.AddObject(
            item.ObjectBeamGeometricallyExact(nodeNumbers=nodes, length=length, sectionData=section)
        )

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A body without inertia of its own: the beam lends the node its rotary inertia."""
        assembly.add_body(node, mass, np.zeros((3, 3)))

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """Frames of nodes from their total coordinates and rates, shape (n, 7)."""
        turned = coordinates[:, 3:7]
        axes, spins = axes_of(turned), spin(turned, rates[:, 3:7])
        z = axes[:, :, 2]
        return NodeFrames(axes[:, :, 1], z, np.sum(spins * z, axis=1))


class Ancf:
    """The papers' beams: absolute nodal coordinates, 9 a node with two slope vectors."""

    has_strains = False
    constant_curvature = False

    def add_node(self, assembly: Assembly, pose: Pose, natural: Pose | None) -> Any:
        """A node with position and the slope vectors along y and z."""
        assert natural is None, "rods of this kind cannot have a length error"
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
        matrix = np.diag([*[mass] * 3, *[0.0] * 6])
        body = item.ObjectGenericODE2(nodeNumbers=[node], massMatrix=matrix)
        assembly.bodies.append(assembly.system.AddObject(body))

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """The spin is that of the slope along y about the one along z; shape (n, 9)."""
        y, z = coordinates[:, 3:6], coordinates[:, 6:9]
        length = np.linalg.norm(y, axis=1)
        normal = z / np.linalg.norm(z, axis=1)[:, None]
        spin = np.sum(np.cross(y, rates[:, 3:6]) * normal, axis=1) / length**2
        return NodeFrames(y / length[:, None], normal, spin)


Formulation = GeometricallyExact | Ancf
FORMULATIONS: dict[type[Rods], Formulation] = {
    GeometricallyExactRods: GeometricallyExact(),
    AncfRods: Ancf(),
}


def beam_section(rods: Rods, part: parts.Rod, constant_over: float) -> Any:
    """Exudyn's section data: stiffness diag(EA, kGA, kGA, GJ, EI, EI) and inertia.

    An element of constant curvature misses the bending by the part of the moment that is linear
    along it: a cantilever of one element is a quarter too stiff.  Its residual flexibility
    L^2 / 12 EI belongs to the shear force alone, so it is given to the shear, 1 / kGA +
    L^2 / 12 EI; the nodes of a rod that is loaded at its nodes are then exact with any number of
    elements (MacNeal, A simple quadrilateral shell element, 1978).  ``constant_over`` is the length
    over which the curvature is constant, m; 0 for elements that bend by themselves.
    """
    young, area, second = part.young_modulus, part.tube.area, part.tube.second_moment
    shear, bending = young * rods.shear_modulus_ratio, young * second
    direct = part.tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + constant_over**2 / (12.0 * young * second))
    stiffness = np.diag([young * area, across, across, shear * 2.0 * second, bending, bending])
    section = exu.BeamSection()
    density = rods.density / (1.0 + part.strain)  # its mass is that of the length that is drawn
    section.massPerLength = density * area
    section.inertia = density * np.diag([2.0 * second, second, second])
    section.stiffnessMatrix = stiffness
    section.dampingMatrix = rods.damping * stiffness
    return section


def add_rod(
    assembly: Assembly, formulation: Formulation, part: parts.Rod, poses: Sequence[Pose], rods: Rods
) -> BuiltRod:
    """A rod of the layout with the poses of its nodes; as for ``Assembly.add_rigid_node``."""
    naturals = _natural(part) if part.nodes else [None] * len(poses)
    nodes = [
        formulation.add_node(assembly, pose, natural)
        for pose, natural in zip(poses, naturals, strict=True)
    ]
    elements = []
    for k, length in enumerate(part.natural_lengths.tolist()):
        section = beam_section(rods, part, length if formulation.constant_curvature else 0.0)
        elements.append(formulation.add_element(assembly, nodes[k : k + 2], length, section))
    assembly.bodies += elements
    return BuiltRod(nodes, elements)


def _natural(part: parts.Rod) -> list[Pose]:
    """Poses of a rod's nodes where nothing strains it."""
    start, along = part.start, part.start.axes[:, 0]
    stations = np.concatenate([[0.0], np.cumsum(part.natural_lengths)])
    return [replace(start, place=start.place + station * along) for station in stations]
