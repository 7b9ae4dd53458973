"""The planar truss with a driving cable."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from ringsim.choice import kind_of
from ringsim.layout.bodies import Array, Lump, axes_along
from ringsim.layout.draft import Draft, Track
from ringsim.layout.layout import OWN, Contact, Layout
from ringsim.parts.laws import PairLaw, PairRecord, Reaction, one_sided, two_sided
from ringsim.parts.rods import Tube
from ringsim.structures.family import Structure
from ringsim.units import DampingRate, Metre, Model, SpringRate

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The planar truss: a parallelogram with a telescopic strut and a cable along its diagonal.
#
# The fixed axis stands along y with the lower joint at the origin and the upper joint a distance H
# above.  Both beams, of length b, make the angle g with it: g = 0 folded down along the axis,
# 90 deg square to it.  The synchronising beam joins their outer ends parallel to the axis.
#
#     upper outer joint   C = (b sin g, H - b cos g)
#     cable, lower joint to C        c^2 = b^2 + H^2 - 2 b H cos g,      dc/dg = b H sin g / c
#     strut, from a foot on the axis p below the upper joint to a head on the upper beam q from it
#                                    s^2 = q^2 + p^2 - 2 q p cos g,      ds/dg = q p sin g / s
#
# Source: paper 001, figs 4 and 7.


class TrussPoints(NamedTuple):
    """Joints on the axis, outer ends of the beams, ends of the strut; shape (..., 3), metre."""

    lower: Array
    upper: Array
    lower_end: Array
    upper_end: Array
    foot: Array
    head: Array


@dataclass(frozen=True)
class TrussGeometry:
    """An ideal planar truss with rigid beams; its lengths b, H, p and q in metre, angles in rad."""

    beam: float
    axis: float
    foot: float
    head: float

    def cable(self, angle: ArrayLike) -> Array:
        """Distance c from the lower joint to the upper outer joint."""
        return _third_side(self.beam, self.axis, angle)

    def cable_rate(self, angle: ArrayLike) -> Array:
        """Its derivative dc/dg, m/rad."""
        return np.asarray(self.beam * self.axis * np.sin(angle) / self.cable(angle))

    def strut(self, angle: ArrayLike) -> Array:
        """Length s of the strut between its joints."""
        return _third_side(self.head, self.foot, angle)

    def angle(self, cable: ArrayLike) -> Array:
        """Angle g in [0, pi] at which the cable has a length; NaN out of reach."""
        c = np.asarray(cable, dtype=float)
        cosine = (self.beam**2 + self.axis**2 - c**2) / (2.0 * self.beam * self.axis)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.arccos(cosine))

    def points(self, angle: Any) -> TrussPoints:
        """All points, at angles of any shape."""
        g = np.asarray(angle)  # of any type: a complex angle carries derivatives
        zero = np.zeros_like(g)
        along = np.stack([np.sin(g), -np.cos(g), zero], axis=-1)
        up = np.stack([zero, zero + 1.0, zero], axis=-1)
        upper, beam = self.axis * up, self.beam * along
        foot, head = upper - self.foot * up, upper + self.head * along
        return TrussPoints(0.0 * up, upper, beam, upper + beam, foot, head)


def _third_side(a: float, b: float, angle: ArrayLike) -> Array:
    """Law of cosines, written so that it keeps its digits at small angles."""
    half = np.sin(0.5 * np.asarray(angle, dtype=float))
    return np.asarray(np.sqrt((a - b) ** 2 + 4.0 * a * b * half**2))


# The planar truss with a driving cable.


REST_ONSET = 1e-5
"""Depth over which the rest's damper comes in, m: 1 N on the default spring, less than the 1.5 N
that the cable holds where the rest is met."""


class DeployingSpring(PairRecord):
    """Compression spring inside the telescopic strut, with its damping."""

    stiffness: SpringRate = 2030.0
    """Force of the spring over the strut's change of length."""
    free_length: Metre = 0.316
    """Length of the strut at which the spring is without force."""
    damping: DampingRate = 5.0
    """Force over the rate of the strut's length."""

    def linear(self) -> tuple[float, float] | None:
        """See ``PairRecord``."""
        return self.stiffness, self.damping

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        """See ``PairRecord``; the spring pushes: negative."""
        return two_sided(stretch, rate, self.stiffness, self.damping)


class Rest(Model):
    """One-sided contact that ends the contraction: buffers of the synchronising beam meet the
    fixed axis and keep its upper joint at a distance.

    Force stiffness * depth + damping * rate while positive.
    """

    buffer: Metre = 0.0118
    """Between the fixed axis and the synchronising beam at the end of contraction."""
    stiffness: SpringRate = 1e5
    """Force of the buffers over their depth."""
    damping: DampingRate = 100.0
    """Force over the rate of the depth, while in contact."""

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """Against a depth (m) and its rate (m/s), none where it is negative."""
        return one_sided(depth, rate, self.stiffness, self.damping, REST_ONSET, xp)


class PlanarTruss(Structure):
    """Fixed axis, two parallel beams, synchronising beam and sliding axis (telescopic strut).

    The cable runs from a winch on the fixed axis over a pulley at the lower joint to the upper
    outer joint.  ``rods`` gives the material and the tubes: ``rods.bar`` the upper and the lower
    beam, ``rods.diagonal`` the outer tube of the strut, ``rods.elements`` half the elements of
    the upper beam.

    Source: paper 001, fig. 4 and table 1, for parts and sections; where strut and cable are
    attached, and the spring, are inferred from its figs 8 and 9 (docs/theory/planar_truss.md).
    """

    planes: ClassVar[tuple[str, ...]] = ("upper",)
    sections: ClassVar[int] = 1
    closed: ClassVar[bool] = False
    locks: ClassVar[bool] = False
    supported: ClassVar[bool] = True
    gauge: ClassVar[str] = "upper_beam"
    long_names: ClassVar[dict[str, str]] = {
        "opening_angle": "angle between the beams and the fixed axis",
    }
    shaping: ClassVar[tuple[str, ...]] = ("structure.beam_length", "rods.elements")

    kind: Literal["planar-truss"] = "planar-truss"
    beam_length: Metre = 0.627
    """Length of the upper and the lower beam between their joints."""
    axis_length: Metre = 0.72
    """Distance of the two joints on the fixed axis."""
    strut_foot: Metre = 0.05
    """Distance of the strut's joint on the fixed axis from the upper joint."""
    strut_head: Metre = 0.3135
    """Distance of the strut's joint on the upper beam from the upper joint."""
    strut_tube_length: Metre = 0.23
    """Length of the strut's outer tube, and of its inner one."""
    cable_length: Metre = 0.9
    """Initial distance from the lower joint to the upper outer joint: 0.9 m deployed."""
    axis: Tube = Tube(outer_diameter=0.030, inner_diameter=0.028)
    """Cross-section of the fixed axis."""
    strut_inner: Tube = Tube(outer_diameter=0.029, inner_diameter=0.027)
    """Cross-section of the strut's inner tube."""
    bar_width: Metre = 0.015
    """Synchronising beam, in the plane of the truss."""
    bar_depth: Metre = 0.008
    """Synchronising beam, across the plane of the truss."""
    spring: DeployingSpring = DeployingSpring()
    """Spring in the strut that opens the truss."""
    rest: Rest = Rest()
    """Buffers that end the contraction."""

    @model_validator(mode="after")
    def _possible(self) -> "PlanarTruss":
        self.require_below("strut_head", "beam_length")
        self.require_below("strut_foot", "axis_length")
        if self.rest_distance >= self.beam_length:
            raise ValueError(
                f"rest.buffer = {self.rest.buffer} m must leave room for the folded beams: the "
                f"rest is {self.rest_distance:.4g} m from the axis"
            )
        geometry, stowed = self.geometry(), self.stowed_angle
        least, most = float(geometry.cable(stowed)), self.axis_length + self.beam_length
        if not least < self.cable_length < most:
            raise ValueError(
                f"cable_length = {self.cable_length} m must be above {least:.4g} m (at the rest) "
                f"and below {most:.4g} m (beams and axis in line)"
            )
        shortest, longest = geometry.strut([stowed, self.coordinate])
        if not shortest >= self.strut_tube_length > 0.5 * longest:
            raise ValueError(
                f"strut_tube_length = {self.strut_tube_length} m must be above "
                f"{0.5 * longest:.4g} m and at most {shortest:.4g} m: the tubes would part, "
                "or hit each other's ends"
            )
        return self

    @classmethod
    def cable_points(cls, sections: int) -> tuple[str, ...]:
        """See ``Structure``."""
        return "lower joint", "upper outer joint"

    def check(self, scene: "Scene") -> None:
        """See ``Structure``: parts of rings are refused, the cable is needed."""
        for name in ("hinge_spring", "stop", "boom", "spacecraft", "offload", "net", "loads"):
            if getattr(scene, name) is not None:
                raise ValueError(f'{name} is for rings only: leave it out ({name} = "none")')
        if scene.joints.model_dump():
            raise ValueError("joints: a planar truss has no joint friction yet: leave it out")
        if scene.faults:
            raise ValueError("faults: a planar truss has no faults yet: leave them out")
        if scene.cables is None or scene.cables.upper is None or scene.cables.lower is not None:
            raise ValueError("cables must hold the one driving cable, as cables.upper")
        if scene.cables.upper.end != "first":
            raise ValueError(
                f'cables.upper.end = "{scene.cables.upper.end}" must be "first": the winch '
                "stands on the fixed axis"
            )
        # Its cable runs over no block at a V-joint, and nothing locks.
        cable = scene.cables.upper
        for record, path, names in (
            (cable, "cables.upper", ("block_offset", "bracket")),
            (cable.winch, "cables.upper.winch", ("after_lock",)),
        ):
            for name in names:
                if getattr(record, name) != type(record).model_fields[name].default:
                    raise ValueError(f"{path}.{name} is for rings only: leave it out")
        if not scene.rods.oriented:
            raise ValueError(
                f'rods.kind = "{kind_of(scene.rods)}" must be "geometrically-exact": the cable '
                "of a planar truss runs to a node with an orientation"
            )
        if scene.solver.step_control != "constant":
            raise ValueError('solver.step_control = "motion" must be "constant" for a planar truss')
        outer, inner = scene.rods.diagonal, self.strut_inner
        if inner.outer_diameter > outer.inner_diameter:
            raise ValueError(
                f"structure.strut_inner.outer_diameter = {inner.outer_diameter} m must be at "
                f"most rods.diagonal.inner_diameter = {outer.inner_diameter} m: the tubes slide"
            )

    @property
    def rest_distance(self) -> float:
        """Distance of the upper outer joint from the axis at the end of contraction, m."""
        return 0.5 * (self.axis.outer_diameter + self.bar_width) + self.rest.buffer

    @property
    def stowed_angle(self) -> float:
        """Angle at the end of contraction, rad."""
        return math.asin(self.rest_distance / self.beam_length)

    @property
    def coordinate(self) -> float:
        """Angle between the beams and the axis at the start, rad."""
        return float(self.geometry().angle(self.cable_length))

    @property
    def reach(self) -> float:
        """See ``Structure``."""
        return self.beam_length

    @property
    def push(self) -> float:
        """See ``Structure``: of the deploying spring, folded."""
        shortest = float(self.geometry().strut(self.stowed_angle))
        return self.spring.stiffness * abs(self.spring.free_length - shortest)

    def geometry(self) -> TrussGeometry:
        """The ideal truss."""
        return TrussGeometry(self.beam_length, self.axis_length, self.strut_foot, self.strut_head)

    def describe(self) -> dict[str, str]:
        """See ``Structure``."""
        geometry, found = self.geometry(), f"{kind_of(self)}, two beams of {self.beam_length} m"
        return {"structure": found} | {
            label: f"{math.degrees(angle):.4g} deg, {geometry.cable(angle):.4g} m of cable, "
            f"strut {geometry.strut(angle):.4g} m"
            for label, angle in (("initial", self.coordinate), ("at its rest", self.stowed_angle))
        }

    def path_slope(self, cable: Any, angles: Any) -> float:
        """See ``Structure``."""
        del cable
        return float(np.sum(self.geometry().cable_rate(angles)))

    def layout(self, scene: "Scene", coordinate: Any) -> Layout:
        """See ``Structure``; the coordinate is the beams' angle from the axis.

        Everything moves in the plane x (outward), y (along the axis).  The beams are elastic; the
        axis, 40 times stiffer in bending than they, the synchronising beam and the tubes of the
        strut are rigid bodies.
        """
        draft, points, rods = Draft(scene), self.geometry().points(coordinate), scene.rods
        down, across = np.array([0.0, -self.axis_length, 0.0]), np.array([0.0, 0.0, 1.0])
        line = rods.density * self.axis.area, rods.density * self.bar_width * self.bar_depth
        axis = draft.body(points.lower, [_slender("axis", line[0], -0.5 * down)])
        bar = draft.body(points.upper_end, [_slender("synchronising beam", line[1], 0.5 * down)])
        draft.joint("weld", "", 0, (None, axis), points.lower)

        head, count = self.strut_head / self.beam_length, 2 * rods.elements
        inside = min(max(round(head * count), 1), count - 1)
        beyond = np.linspace(head, 1.0, count - inside + 1)[1:]
        shares = [*np.linspace(0.0, head, inside + 1), *beyond]
        young = float(np.max(rods.young_modulus))
        lines = (points.upper, points.upper_end), (points.lower, points.lower_end)
        upper, lower = (
            draft.rod(name, 0, "beams", ends, across, rods.bar, stations, young)
            for name, ends, stations in zip(
                ("upper_beam", "lower_beam"), lines, (shares, [0.0, 0.5, 1.0]), strict=True
            )
        )
        for end, body in enumerate((axis, bar)):
            for beam, ends in zip((upper, lower), lines, strict=True):
                draft.joint("revolute", "", 0, (body, beam), ends[end])

        along = axes_along(points.foot, points.head, across)
        half = np.array([0.5 * self.strut_tube_length, 0.0, 0.0])
        outer, inner = (
            draft.body(at, [_slender("strut", rods.density * tube.area, centre)], along)
            for at, centre, tube in (
                (points.foot, half, rods.diagonal),
                (points.head, -half, self.strut_inner),
            )
        )
        draft.joint("revolute", "", 0, (axis, outer), points.foot, np.eye(3))
        draft.joint("revolute", "", 0, (upper, inner), points.head)
        draft.slide(outer, inner, along)
        pair, free = np.array([[outer.number, inner.number]]), np.array([self.spring.free_length])
        draft.pairs.append(PairLaw(OWN, self.spring, pair, np.zeros(1, int), lambda: free))
        draft.contacts.append(Contact(bar.number, 0, self.rest_distance, self.rest))
        draft.chord_opening(0, bar, points.upper)
        cable = [draft.on(axis, points.lower), draft.on(bar, points.upper_end)]
        draft.tracks[0] = Track(cable, np.array([0.0, 1.0, 0.0]))
        return draft.finish()


def _slender(group: str, per_length: float, centre: Array) -> Lump:
    """A slender rod (kg/m) from the body's origin to twice ``centre``, with little inertia about
    its own line.
    """
    length = 2.0 * float(np.linalg.norm(centre))
    mass, own = per_length * length, np.outer(centre, centre) / (0.25 * length**2)
    return Lump(group, mass, centre, mass * length**2 * ((np.eye(3) - own) / 3.0 + 1e-4 * own))
