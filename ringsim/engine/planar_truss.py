"""The multibody model of a planar truss: axis, beams, synchronising beam, strut, rest, cable.

Everything moves in the plane x (outward), y (along the fixed axis); joints turn about z.  The
beams are elastic; the axis, 40 times stiffer in bending than they, the synchronising beam and
the tubes of the strut are rigid bodies.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.sheaves import FixedSheave
from ringsim.engine.assembly import Assembly, Frame
from ringsim.engine.cable_path import CablePath
from ringsim.engine.cables import CableDrive
from ringsim.engine.rods import beam_section
from ringsim.engine.rods_geometrically_exact import GeometricallyExact
from ringsim.geometry.planar_truss import TrussPoints
from ringsim.parts.structure.planar_truss import PlanarTruss, Rest
from ringsim.parts.tube import Tube
from ringsim.scene import Scene

Array = NDArray[np.float64]
FORMULATION = GeometricallyExact()
_ONSET = 1e-5
"""Depth in metre over which the damping of the rest comes in, so that contact starts smoothly."""


@dataclass(frozen=True)
class Beam:
    """A chain of geometrically exact elements.

    ``places`` are the nodes' distances from the beam's joint on the axis, m.
    """

    nodes: list[Any]
    elements: list[Any]
    places: Array


@dataclass
class TrussModel:
    """What was built.

    Attributes
    ----------
    head
        Number of the upper beam's node that carries the strut.
    axis, bar, tubes
        Nodes of the fixed axis (at the lower joint), the synchronising beam (at the upper outer
        joint), and the strut's outer and inner tube (at its foot and head).
    """

    scene: Scene
    truss: PlanarTruss
    points: TrussPoints
    assembly: Assembly = field(default_factory=Assembly)
    upper: Beam = field(init=False)
    lower: Beam = field(init=False)
    head: int = field(init=False)
    axis: Any = field(init=False)
    bar: Any = field(init=False)
    tubes: tuple[Any, Any] = field(init=False)
    spring: Any = field(init=False)
    cable: CableDrive = field(init=False)


def build_truss(scene: Scene) -> TrussModel:
    """Build the truss at rest at its initial cable length; beams straight, spring pressed."""
    truss = scene.structure
    if not isinstance(truss, PlanarTruss) or scene.cables is None:
        raise TypeError(f"no planar truss with a cable: {scene.name}")
    model = TrussModel(scene, truss, truss.geometry().points(truss.initial_angle))
    axis = _add_axis(model)
    bar = _add_bar(model)
    _add_beams(model, axis, bar)
    _add_strut(model, axis)
    _add_rest(model, truss.rest)
    path = [
        FixedSheave(model.axis, np.array([0.0, scene.cables.winch_distance, 0.0])),
        FixedSheave(model.axis, np.zeros(3)),
        FixedSheave(model.bar, np.zeros(3)),
    ]
    model.cable = CableDrive(model, scene.cables, CablePath([path]))
    model.assembly.finish()
    model.cable.locate()
    return model


def _add_axis(model: TrussModel) -> Any:
    """The fixed axis, clamped at its lower joint; returns its body."""
    assembly, truss = model.assembly, model.truss
    model.axis = assembly.add_rigid_node(Frame(np.zeros(3), np.eye(3)))
    mass = model.scene.rods.density * truss.axis.area * truss.axis_length
    half = 0.5 * truss.axis_length
    body = _add_rod(model, model.axis, mass, truss.axis_length, np.array([0.0, half, 0.0]))
    clamp = assembly.ground_marker(np.zeros(3)), assembly.body_marker(body, np.zeros(3))
    assembly.generic_joint(*clamp, [1, 1, 1, 1, 1, 1])
    return body


def _add_bar(model: TrussModel) -> Any:
    """The synchronising beam, hanging from the upper outer joint; returns its body."""
    truss = model.truss
    model.bar = model.assembly.add_rigid_node(Frame(model.points.upper_end, np.eye(3)))
    mass = model.scene.rods.density * truss.bar_width * truss.bar_depth * truss.axis_length
    centre = np.array([0.0, -0.5 * truss.axis_length, 0.0])
    return _add_rod(model, model.bar, mass, truss.axis_length, centre)


def _add_rod(model: TrussModel, node: Any, mass: float, length: float, centre: Array) -> Any:
    """A slender rigid body whose node is at one end; inertia about its own line is small."""
    along = centre / np.linalg.norm(centre)
    across = np.eye(3) - np.outer(along, along)
    inertia = mass * (length**2 / 12.0 * across + centre @ centre * across)
    inertia += 1e-4 * mass * length**2 * np.outer(along, along)
    return model.assembly.add_body(node, mass, inertia, centre)


def _add_beams(model: TrussModel, axis: Any, bar: Any) -> None:
    truss, points, assembly = model.truss, model.points, model.assembly
    head = truss.strut_head / truss.beam_length
    count = 2 * model.scene.rods.elements
    inside = min(max(round(head * count), 1), count - 1)
    shares = np.concatenate(
        [np.linspace(0.0, head, inside + 1), np.linspace(head, 1.0, count - inside + 1)[1:]]
    )
    model.head = inside
    model.upper = _add_beam(model, points.upper, points.upper_end, shares)
    model.lower = _add_beam(model, points.lower, points.lower_end, np.linspace(0.0, 1.0, 3))
    height = np.array([0.0, truss.axis_length, 0.0])
    for body, place, node in (
        (axis, height, model.upper.nodes[0]),
        (axis, 0.0 * height, model.lower.nodes[0]),
        (bar, 0.0 * height, model.upper.nodes[-1]),
        (bar, -height, model.lower.nodes[-1]),
    ):
        assembly.revolute(assembly.body_marker(body, place), assembly.node_marker(node))


def _add_beam(model: TrussModel, start: Array, end: Array, shares: Array) -> Beam:
    assembly, rods = model.assembly, model.scene.rods
    young = float(np.max(rods.young_modulus))
    axes = _axes_along(end - start)
    nodes = [assembly.add_rigid_node(Frame(start + s * (end - start), axes)) for s in shares]
    places = shares * float(np.linalg.norm(end - start))
    elements = [
        FORMULATION.add_element(
            assembly,
            nodes[k : k + 2],
            float(length),
            beam_section(rods, rods.bar, young, constant_over=float(length)),
        )
        for k, length in enumerate(np.diff(places))
    ]
    assembly.bodies += elements
    return Beam(nodes, elements, places)


def _add_strut(model: TrussModel, axis: Any) -> None:
    """Two tubes that slide in each other, with the deploying spring between their joints."""
    assembly, truss, points = model.assembly, model.truss, model.points
    axes = _axes_along(points.head - points.foot)
    half = np.array([0.5 * truss.strut_tube_length, 0.0, 0.0])
    ends = ((points.foot, half, model.scene.rods.diagonal), (points.head, -half, truss.strut_inner))
    nodes, bodies = [], []
    for place, centre, tube in ends:
        nodes.append(assembly.add_rigid_node(Frame(place, axes)))
        mass = _tube_mass(model, tube)
        bodies.append(_add_rod(model, nodes[-1], mass, truss.strut_tube_length, centre))
    model.tubes = (nodes[0], nodes[1])
    markers = [assembly.body_marker(body, np.zeros(3)) for body in bodies]
    foot = assembly.body_marker(axis, points.foot)
    upright = assembly.body_marker(bodies[0], np.zeros(3), axes.T)
    assembly.revolute(foot, upright)
    assembly.revolute(assembly.node_marker(model.upper.nodes[model.head]), markers[1])
    assembly.system.AddObject(item.ObjectJointPrismaticX(markerNumbers=markers))
    model.spring = assembly.system.AddObject(
        item.ObjectConnectorSpringDamper(
            markerNumbers=markers,
            referenceLength=truss.spring.free_length,
            stiffness=truss.spring.stiffness,
            damping=truss.spring.damping,
        )
    )


def _tube_mass(model: TrussModel, tube: Tube) -> float:
    return model.scene.rods.density * tube.area * model.truss.strut_tube_length


def _axes_along(direction: Array) -> Array:
    """Axes as columns: x along a direction of the plane, z across the plane."""
    x = direction / np.linalg.norm(direction)
    z = np.array([0.0, 0.0, 1.0])
    return np.column_stack([x, np.cross(z, x), z])


def _add_rest(model: TrussModel, rest: Rest) -> None:
    """A one-sided spring on the distance of the upper outer joint from the axis."""
    system = model.assembly.system
    room = float(model.points.upper_end[0]) - model.truss.rest_distance
    ground = system.AddNode(item.NodePointGround())
    markers = [
        system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        for node in (ground, model.bar)
    ]
    law = model.assembly.symbolic(
        "rest",
        _rest_law(rest, room),
        "ObjectConnectorCoordinateSpringDamper",
        "springForceUserFunction",
    )
    system.AddObject(
        item.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=markers, springForceUserFunction=law
        )
    )


def rest_force(rest: Rest, distance: float, rate: float, room: float) -> tuple[float, float]:
    """The same law in numpy: whole push and its elastic part, N.

    Parameters
    ----------
    distance, rate
        Of the upper outer joint from the axis, m and m/s.
    room
        Distance at which contact begins, m.
    """
    depth = max(room - distance, 0.0)
    spring = rest.stiffness * depth
    return max(spring - rest.damping * rate * min(depth / _ONSET, 1.0), 0.0), spring


def _rest_law(rest: Rest, room: float) -> Any:
    k, d = rest.stiffness, rest.damping

    def law(
        mbs: Any, t: Any, itemNumber: Any, displacement: Any, velocity: Any,  # noqa: N803
        stiffness: Any, damping: Any, offset: Any,
    ) -> Any:  # fmt: skip
        least, most = exu.symbolic.min, exu.symbolic.max
        depth = most(-room - displacement, 0.0)
        return -most(k * depth - d * velocity * least(depth / _ONSET, 1.0), 0.0)

    return law
