"""Building rods: one function a formulation, found by the kind of the scene's rods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly, Frame
from ringsim.parts.rods.family import Rods
from ringsim.parts.tube import Tube

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rod:
    """A chain of beam elements.

    Attributes
    ----------
    nodes
        From start to end; their frames have x along the rod and z along the section's normal.
    elements
        Objects, one fewer than nodes.
    axes
        Initial frame, columns in global coordinates, shape (3, 3).
    tube
        Cross-section.
    lengths
        Of the elements, m.
    young_modulus
        Pa.

    """

    nodes: list[Any]
    elements: list[Any]
    axes: Array
    tube: Tube
    lengths: Array
    young_modulus: float


class NodeFrames(NamedTuple):
    """Frames of n rod nodes: positions (n, 3), y and z axes (n, 3), rates about z (n,)."""

    position: Array
    y: Array
    z: Array
    spin: Array


class Formulation(Protocol):
    """What a rod formulation must offer.

    ``has_strains`` says whether exudyn reports strains, forces and moments of its elements.
    """

    has_strains: bool
    constant_curvature: bool
    """Whether the curvature is constant in an element."""

    def add_node(self, assembly: Assembly, frame: Frame) -> Any:
        """A node of this formulation."""

    def add_element(self, assembly: Assembly, nodes: list[Any], length: float, section: Any) -> Any:
        """An element between two nodes."""

    def add_mass(self, assembly: Assembly, node: Any, mass: float) -> None:
        """A point mass at a node."""

    def read(self, coordinates: Array, rates: Array) -> NodeFrames:
        """Frames of nodes from their total coordinates and rates, shape (n, coordinates)."""


def beam_section(rods: Rods, tube: Tube, young_modulus: float, constant_over: float = 0.0) -> Any:
    """Exudyn's section data: stiffness diag(EA, kGA, kGA, GJ, EI, EI) and inertia.

    An element of constant curvature misses the bending by the part of the moment that is linear
    along it: a cantilever of one element is a quarter too stiff.  Its residual flexibility
    L^2 / 12 EI belongs to the shear force alone, so it is given to the shear, 1 / kGA +
    L^2 / 12 EI; the nodes of a rod that is loaded at its nodes are then exact with any number of
    elements (MacNeal, A simple quadrilateral shell element, 1978).

    Parameters
    ----------
    young_modulus
        Pa.
    constant_over
        Length over which the curvature is constant, m; 0 for elements that bend by themselves.
    """
    area, second = tube.area, tube.second_moment
    shear = young_modulus * rods.shear_modulus_ratio
    direct = tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + constant_over**2 / (12.0 * young_modulus * second))
    stiffness = np.diag(
        [
            young_modulus * area,
            across,
            across,
            shear * 2.0 * second,
            young_modulus * second,
            young_modulus * second,
        ]
    )
    section = exu.BeamSection()
    section.massPerLength = rods.density * area
    section.inertia = rods.density * np.diag([2.0 * second, second, second])
    section.stiffnessMatrix = stiffness
    section.dampingMatrix = rods.damping * stiffness
    return section


def add_rod(
    assembly: Assembly,
    formulation: Formulation,
    ends: tuple[Frame, Frame],
    stations: Sequence[float],
    rods: Rods,
    tube: Tube,
    young_modulus: float,
) -> Rod:
    """A straight rod between two frames that share their axes; motion is interpolated.

    Parameters
    ----------
    stations
        Shares of its length at which it has nodes, from 0 to 1.
    """
    first, last = ends
    lengths = np.diff(stations) * float(np.linalg.norm(last.position - first.position))
    frames = [
        Frame(
            (1 - share) * first.position + share * last.position,
            first.axes,
            (1 - share) * first.acceleration + share * last.acceleration,
            first.turn,
        )
        for share in stations
    ]
    nodes = [formulation.add_node(assembly, frame) for frame in frames]
    sections = {
        length: beam_section(
            rods, tube, young_modulus, length if formulation.constant_curvature else 0.0
        )
        for length in set(lengths.tolist())
    }
    objects = [
        formulation.add_element(assembly, nodes[k : k + 2], length, sections[length])
        for k, length in enumerate(lengths.tolist())
    ]
    assembly.bodies += objects
    return Rod(nodes, objects, first.axes, tube, lengths, young_modulus)
