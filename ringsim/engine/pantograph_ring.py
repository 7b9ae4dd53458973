"""The multibody model of a pantograph ring: hinge assemblies, rods, joints, masses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly, Frame
from ringsim.engine.rods import Formulation, Rod, add_rod
from ringsim.geometry.ring import Fold, RingGeometry
from ringsim.parts.boom.rigid import RigidBoom
from ringsim.parts.persection import spread
from ringsim.scene import Scene
from ringsim.theory.ideal_ring import IdealRing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A revolute joint: its family, section (from 0), markers, and the gap that it closes.

    ``gap`` names the two points that the joint holds together: a rod's node, and another rod's
    node or a place (3,) on a hinge assembly's node.
    """

    family: str
    section: int
    markers: tuple[Any, Any]
    gap: tuple[Any, Any, Array | None]


@dataclass
class RingModel:
    """What was built, for the parts that come after and for reading results.

    Attributes
    ----------
    hinges
        Body and node of every hinge assembly, [plane][corner].
    rods
        Rods by name, one per section: ``diagonal_rising``, ``bar_upper_left``, ...
    vjoints
        Joints in the middle of the folding bars, [plane][section].
    joints
        All revolute joints.

    """

    scene: Scene
    geometry: RingGeometry
    fold: Fold
    formulation: Formulation
    assembly: Assembly = field(default_factory=Assembly)
    hinges: list[list[tuple[Any, Any]]] = field(default_factory=lambda: [[], []])
    rods: dict[str, list[Rod]] = field(default_factory=dict)
    vjoints: list[list[Joint]] = field(default_factory=lambda: [[], []])
    joints: list[Joint] = field(default_factory=list)


class _Release:
    """Accelerations of the ideal ring released at rest."""

    def __init__(self, scene: Scene, geometry: RingGeometry) -> None:
        ideal = IdealRing.of(scene)
        phi = scene.structure.initial_phi
        motion = ideal.motion(phi)
        self.pull = ideal.acceleration_from_rest(phi)
        self.rate = geometry.fold_rate(phi)
        self.velocity, self.rotation = motion.velocity, motion.rotation
        sine = np.sin(phi)
        self.diagonal_turn = 2.0 * geometry.half_bar * sine / geometry.height(phi)

    def frame(self, place: Array, rate: Array, axes: Array, turn: Array | float = 0.0) -> Frame:
        """A frame with the acceleration that follows from the rates of the fold."""
        moving = rate - self.velocity - np.cross(self.rotation, place)
        turning = np.asarray(turn) - self.rotation
        return Frame(place, axes, self.pull * moving, self.pull * (turning + np.zeros(3)))


def build_ring(scene: Scene, formulation: Formulation) -> RingModel:
    """Build hinge assemblies, rods and joints in the scene's initial fold state."""
    geometry = scene.structure.geometry()
    model = RingModel(scene, geometry, geometry.fold(scene.structure.initial_phi), formulation)
    release = _Release(scene, geometry)
    _add_hinges(model, release)
    young = spread(scene.rods.young_modulus, geometry.sections)
    for section in range(geometry.sections):
        _add_section(model, release, section, float(young[section]))
    return model


def _add_hinges(model: RingModel, release: _Release) -> None:
    ring, boom = model.scene.structure, model.scene.boom
    own = ring.corner_mass * ring.hinge_size**2 / 6.0 * np.eye(3)
    for plane in range(2):
        for corner, place in enumerate(model.fold.corners[plane]):
            rate = release.rate.corners[plane, corner]
            node = model.assembly.add_rigid_node(release.frame(place, rate, np.eye(3)))
            mass, inertia, centre = ring.corner_mass, own, None
            if plane == 0 and corner == 0 and isinstance(boom, RigidBoom):
                across = (
                    0.125 * boom.mass * (boom.tube.outer_diameter**2 + boom.tube.inner_diameter**2)
                )
                along = boom.mass * boom.length**2 / 3.0 + 0.5 * across
                centre = np.array([0.0, 0.0, -0.5 * boom.length]) * boom.mass / (mass + boom.mass)
                mass = mass + boom.mass
                inertia = own + np.diag([along, along, across])
            body = model.assembly.add_body(node, mass, inertia, centre)
            model.hinges[plane].append((body, node))


def _add_section(model: RingModel, release: _Release, section: int, young: float) -> None:
    fold, rate, rods = model.fold, release.rate, model.scene.rods
    normal = model.geometry.normals[section]
    ends = (section, (section + 1) % fold.corners.shape[1])
    pins = (fold.left, fold.right)
    pin_rates = (rate.left, rate.right)

    def rod(start: tuple[Array, Array], end: tuple[Array, Array], turn: float, kind: str) -> Rod:
        along = (end[0] - start[0]) / np.linalg.norm(end[0] - start[0])
        axes = np.column_stack([along, np.cross(normal, along), normal])
        tube = rods.diagonal if kind == "diagonal" else rods.bar
        halves = 2 if kind == "diagonal" else 1
        frames = tuple(release.frame(p, v, axes, turn * normal) for p, v in (start, end))
        return add_rod(
            model.assembly,
            model.formulation,
            (frames[0], frames[1]),
            halves * rods.elements,
            rods,
            tube,
            young,
        )

    def pin(side: int, plane: int) -> tuple[Array, Array]:
        return pins[side][plane, section], pin_rates[side][plane, section]

    turn = release.diagonal_turn
    rising = rod(pin(0, 1), pin(1, 0), turn, "diagonal")
    falling = rod(pin(0, 0), pin(1, 1), -turn, "diagonal")
    _keep(model, "diagonal_rising", rising)
    _keep(model, "diagonal_falling", falling)
    _hinge(model, section, rising.nodes[0], rising.axes, 1, ends[0], fold.left[1, section])
    _hinge(model, section, rising.nodes[-1], rising.axes, 0, ends[1], fold.right[0, section])
    _hinge(model, section, falling.nodes[0], falling.axes, 0, ends[0], fold.left[0, section])
    _hinge(model, section, falling.nodes[-1], falling.axes, 1, ends[1], fold.right[1, section])
    middle = rods.elements
    _pin_together(model, "pivot", section, rising.nodes[middle], falling.nodes[middle])
    for plane, name in enumerate(("upper", "lower")):
        joint = fold.vjoints[plane, section], rate.vjoints[plane, section]
        sense = -1.0 if plane == 0 else 1.0
        left = rod(pin(0, plane), joint, sense, "bar")
        right = rod(joint, pin(1, plane), -sense, "bar")
        _keep(model, f"bar_{name}_left", left)
        _keep(model, f"bar_{name}_right", right)
        corner_left, corner_right = fold.left[plane, section], fold.right[plane, section]
        _hinge(model, section, left.nodes[0], left.axes, plane, ends[0], corner_left)
        _hinge(model, section, right.nodes[-1], right.axes, plane, ends[1], corner_right)
        vjoint = _pin_together(model, "vjoint", section, left.nodes[-1], right.nodes[0])
        model.vjoints[plane].append(vjoint)
        mass = model.scene.structure.vjoint_mass
        if mass > 0.0:
            model.formulation.add_mass(model.assembly, left.nodes[-1], mass)


def _keep(model: RingModel, name: str, rod: Rod) -> None:
    model.rods.setdefault(name, []).append(rod)


def _hinge(
    model: RingModel, section: int, node: Any, axes: Array, plane: int, corner: int, place: Array
) -> None:
    """A revolute joint between a rod's end and its hinge assembly."""
    body, hinge_node = model.hinges[plane][corner]
    arm = place - model.fold.corners[plane, corner]
    markers = (
        model.assembly.body_marker(body, arm, axes),
        model.assembly.node_marker(node),
    )
    model.assembly.revolute(*markers)
    model.joints.append(Joint("hinge", section, markers, (node, hinge_node, arm)))


def _pin_together(model: RingModel, family: str, section: int, first: Any, second: Any) -> Joint:
    """A revolute joint between nodes of two rods."""
    markers = (model.assembly.node_marker(first), model.assembly.node_marker(second))
    model.assembly.revolute(*markers)
    joint = Joint(family, section, markers, (first, second, None))
    model.joints.append(joint)
    return joint
