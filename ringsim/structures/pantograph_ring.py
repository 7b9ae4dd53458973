"""The pantograph ring: closed, or an open arc of the same polygon (two sections: the truss)."""

import functools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from ringsim.choice import kind_of
from ringsim.layout.bodies import Array, Lump
from ringsim.layout.draft import BodyRef, Draft, Track
from ringsim.layout.layout import Layout
from ringsim.parts.rods import errors_of
from ringsim.structures.family import HingeError, Structure
from ringsim.units import Degree, KilogramOrZero, Metre, MetreOrZero, PerSection, Unit, spread

if TYPE_CHECKING:
    from ringsim.scene import Scene

# Fold states of the pantograph ring: every point as a function of one angle.
#
# Two planes (0 upper, 1 lower), ``sections`` sections, and ``corners`` corners (one more than the
# sections in an open arc).  phi is the angle of a bar half from the horizontal; the opening angle
# between the halves is delta = pi - 2 phi.  With half bar l and half diagonal d, the width between
# the pins of a section is w = 2 l cos(phi) and its height h = sqrt(4 d^2 - w^2): every fold state
# keeps all rod lengths, so each is an exact, stress-free configuration.


_UP = np.array([0.0, 0.0, 1.0])
_SIGNED = np.array([_UP, -_UP])[:, None]
"""Outward in the upper and in the lower plane, shape (2, 1, 3)."""


@dataclass(frozen=True)
class Fold:
    """Point positions of one fold state, in metre."""

    corners: Array
    """Centres of the hinge assemblies, shape (2, corners, 3)."""
    left: Array
    """Pins of a section at its first corner, shape (2, sections, 3)."""
    right: Array
    """Pins of a section at its second corner, shape (2, sections, 3)."""
    pivots: Array
    """Crossing points of the diagonals, shape (sections, 3)."""
    vjoints: Array
    """Middle joints of the folding bars, shape (2, sections, 3)."""


@dataclass(frozen=True)
class RingGeometry:
    """An ideal ring: unit directions of its sections and the lengths of one section (metre)."""

    plan: Array
    """Corners in plan view in units of the chord, shape (corners, 3), z = 0."""
    closed: bool
    half_bar: float
    half_diagonal: float
    hinge_offset: float

    @classmethod
    def of_polygon(
        cls,
        sections: int,
        *,
        closed: bool,
        polygon_sections: int,
        aspect_ratio: float,
        **lengths: float,
    ) -> "RingGeometry":
        """A closed ring, or the first ``sections`` sides of a polygon left open; with its
        ``lengths`` half_bar, half_diagonal and hinge_offset.
        """
        sides = sections if closed else polygon_sections
        corners = np.arange(sections if closed else sections + 1) % sides
        return cls(polygon_corners(sides, aspect_ratio)[corners], closed, **lengths)

    @property
    def sections(self) -> int:
        """Number of sections."""
        return len(self.plan) if self.closed else len(self.plan) - 1

    @property
    def directions(self) -> Array:
        """Unit vector e_k from corner k to corner k + 1, shape (sections, 3)."""
        following = np.roll(self.plan, -1, axis=0)[: self.sections]
        return np.asarray(following - self.plan[: self.sections])

    @property
    def normals(self) -> Array:
        """Outward normal n_k = e_k x z of each section's plane, shape (sections, 3)."""
        return np.cross(self.directions, _UP)

    def width(self, phi: Any) -> Any:
        """Horizontal distance between the pins of a section, in metre."""
        return 2.0 * self.half_bar * np.cos(phi)

    def height(self, phi: Any) -> Any:
        """Vertical distance between upper and lower corners, in metre."""
        return np.sqrt(4.0 * self.half_diagonal**2 - self.width(phi) ** 2)

    def fold(self, phi: Any) -> Fold:
        """Positions at the bar angle ``phi`` (rad, 0 deployed .. pi/2 stowed), complex at complex
        ``phi``, whose imaginary part carries derivatives.
        """
        half_height, half_chord = 0.5 * self.height(phi), 0.5 * self.width(phi) + self.hinge_offset
        lift, offset = half_height * _SIGNED, self.hinge_offset * self.directions
        chord = 2.0 * half_chord
        first, second = self.plan[: self.sections], np.roll(self.plan, -1, axis=0)[: self.sections]
        pivots = half_chord * (first + second)
        return Fold(
            corners=chord * self.plan + lift,
            left=chord * first + offset + lift,
            right=chord * second - offset + lift,
            pivots=pivots,
            vjoints=pivots + (half_height - self.half_bar * np.sin(phi)) * _SIGNED,
        )


@functools.lru_cache(maxsize=64)  # the scenes of a campaign ask for the same ones again and again
def polygon_corners(sides: int, aspect_ratio: float) -> Array:
    """Corners of the closed polygon with equal chords of length 1, inscribed in an ellipse.

    The first corner lies on the major axis (+x), the polygon runs anticlockwise and is centred on
    the origin.  Read-only, shape (sides, 3), in units of the chord, z = 0.  The unknowns are the
    ellipse parameters of the other corners and the chord; Newton's method starts from the regular
    polygon.

    Raises
    ------
    ValueError
        With less than 3 sides, minor over major axis not in (0, 1], or no polygon found.
    """
    if sides < 3:
        raise ValueError(f"a closed polygon needs at least 3 sides, not {sides}")
    if not 0.0 < aspect_ratio <= 1.0:
        raise ValueError(f"aspect_ratio = {aspect_ratio} must be in (0, 1]")
    parameters = 2.0 * np.pi * np.arange(sides) / sides
    steps = 1 + int(np.ceil(8 * np.log(1.0 / aspect_ratio)))
    for ratio in (aspect_ratio ** (np.arange(1, steps + 1) / steps)).tolist():
        parameters, chord = _equal_chords(parameters, ratio)
    points = np.stack([np.cos(parameters), ratio * np.sin(parameters), 0.0 * parameters], axis=-1)
    found: Array = points / chord
    found.flags.writeable = False
    return found


def _equal_chords(t: Array, ratio: float) -> tuple[Array, float]:
    """Newton's method on |r(t_k+1) - r(t_k)|^2 = c^2, k = 0..sides-1, with t_0 = 0 fixed."""
    sides = len(t)
    square = 4.0 * np.sin(np.pi / sides) ** 2 * (0.5 * (1.0 + ratio**2))
    this, following = np.arange(sides), (np.arange(sides) + 1) % sides
    for _ in range(60):
        place = np.stack([np.cos(t), ratio * np.sin(t)])
        slope = np.stack([-np.sin(t), ratio * np.cos(t)])
        run = place[:, following] - place
        jacobian = np.zeros((sides, sides + 1))
        jacobian[this, this] = -2.0 * np.sum(run * slope, axis=0)
        jacobian[this, following] += 2.0 * np.sum(run * slope[:, following], axis=0)
        jacobian[:, sides] = -1.0
        change = np.linalg.solve(jacobian[:, 1:], square - np.sum(run**2, axis=0))
        largest = np.abs(change[:-1]).max()
        change *= min(1.0, np.pi / sides / max(largest, 1e-300))
        t = t + np.append(0.0, change[:-1])
        square += change[-1]
        if largest < 1e-14 * sides:
            break
    if not (np.all(np.diff(t) > 0.0) and t[-1] < 2.0 * np.pi and square > 0.0):
        raise ValueError(f"no equal-chord polygon with {sides} sides and axis ratio {ratio:.6g}")
    return t, float(np.sqrt(square))


# Pantograph sections between hinge assemblies: rods, joints and the tracks of their cables.


def add_sections(
    draft: Draft,
    geometry: RingGeometry,
    fold: Fold,
    corners: list[list[BodyRef]],
    vjoint_mass: float,
    *,
    plane: int = 0,
    prefix: str = "",
    errors: HingeError | None = None,
) -> None:
    """Add the sections of a closed ring or an arc, with V-joints of ``vjoint_mass`` (kg) each.

    ``fold`` tells where their points are at a complex coordinate (``ringsim.layout.bodies``),
    ``corners`` the hinge assemblies by plane (upper, lower) and corner.  Of several rings
    ``plane`` is the number of the upper plane, which the lower one follows, and ``prefix`` that of
    the rods' names.  ``errors`` are those of the pins.
    """
    rods = draft.scene.rods
    young, young_bar = (
        spread(rods.young_of(group), geometry.sections).tolist() for group in ("diagonal", "bar")
    )
    strains = errors_of(rods, geometry.sections)
    whole, half = (np.arange(n + 1) / n for n in (2 * rods.elements, rods.elements))
    middle = ((rods.elements, vjoint_mass, "V-joints"),) if vjoint_mass > 0.0 else ()
    tracks: tuple[list[Any], list[Any]] = ([], [])
    for section, normal in enumerate(geometry.normals):
        pins = fold.left[:, section], fold.right[:, section]
        wrong = [_shifts(errors, end, section, geometry) for end in (0, 1)]
        held = [[plane[(section + end) % len(plane)] for plane in corners] for end in (0, 1)]
        diagonals = []
        for name, sides in (("rising", (1, 0)), ("falling", (0, 1))):
            ends = [pins[end][side] for end, side in enumerate(sides)]
            diagonals.append(
                draft.rod(f"{prefix}diagonal_{name}", section, "diagonals", ends, normal,
                          rods.diagonal, whole, young[section],
                          strain=strains[f"diagonal_{name}"][section])
            )  # fmt: skip
            for end, side in enumerate(sides):
                parts = diagonals[-1], held[end][side]
                draft.joint("revolute", "hinge", section, parts, ends[end], error=wrong[end][side])
        draft.joint("revolute", "pivot", section, diagonals, fold.pivots[section])
        for side, (name, sense) in enumerate((("upper", 1.0), ("lower", -1.0))):
            at, bars, track = fold.vjoints[side, section], [], tracks[side]
            for end, name_of_half in enumerate(("left", "right")):
                pin, body = pins[end][side], held[end][side]
                bars.append(
                    draft.rod(f"{prefix}bar_{name}_{name_of_half}", section, "bars",
                              (at, pin) if end else (pin, at), normal, rods.bar, half,
                              young_bar[section], () if end else middle,
                              strains[f"bar_{name}_{name_of_half}"][section])
                )  # fmt: skip
                draft.joint(
                    "revolute", "hinge", section, (bars[end], body), pin, error=wrong[end][side]
                )
                track.append(draft.on(body, pin))
            track.insert(-1, section)
            joint = draft.joint("revolute", "vjoint", section, bars, at)
            draft.opening(plane + side, joint, sense, [0.0, 0.0, sense])
    for side, sense in enumerate((1.0, -1.0)):
        draft.tracks[plane + side] = Track(tracks[side], np.array([0.0, 0.0, -sense]))


def _shifts(
    errors: HingeError | None, end: int, section: int, geometry: RingGeometry
) -> list[Array] | list[None]:
    """By how much the upper and the lower pin at an end of a section stand off, m."""
    if errors is None:
        return [None, None]
    away = geometry.directions[section] * (1.0 - 2.0 * end)
    sides = (getattr(errors, f"{plane}_{('left', 'right')[end]}") for plane in ("upper", "lower"))
    return [spread(value, geometry.sections)[section] * away for value in sides]


# The pantograph ring: closed, or an open arc of the same polygon (two sections: the truss).


AngleError = Annotated[float, Field(ge=-20.0, le=20.0), Unit("deg")]
LEAST_OPENING = 1.0
"""Degree; below it stand angles meant in radians, and hardly a fold: two bar halves of 0.3 m end
5 mm apart there, less than a bar is thick."""
LEAST_HINGE_OFFSET = 1e-6
"""Metre; directions of the rope between two pulleys are then good to 1e-10 in doubles."""


_NO_DIAMETER = (
    "a closed, regular ring of N sections and aperture diameter D has half_bar = "
    "D sin(pi / N) / 2 - hinge_offset; half_diagonal and the cables' block_offset grow with it"
)


class PantographRing(Structure):
    """Sections of two crossing diagonals and two folding bars between hinge assemblies.

    The plan view is a polygon with equal chords on an ellipse; the hinge assemblies fix its
    angles.  Source: paper 002 (18-section antenna), table 1; paper 000 (two-section truss).
    """

    gone: ClassVar[dict[str, str]] = dict.fromkeys(("diameter", "aperture"), _NO_DIAMETER)
    """Keys that are none, and what to give in their place."""

    kind: Literal["pantograph-ring"] = "pantograph-ring"
    sections: Annotated[int, Field(ge=1, le=360)] = 18
    """Number of sections, each of two diagonals and an upper and a lower folding bar."""
    closed: bool = True
    """Whether the last section meets the first; otherwise an open arc."""
    polygon_sections: Annotated[int, Field(ge=3, le=720)] = 18
    """Sides of the full polygon that an open arc is cut from; a closed ring is its own."""
    aspect_ratio: Annotated[float, Field(ge=0.05, le=1.0), Unit("1")] = 3.2856 / 3.5184
    """Minor over major axis of the ellipse."""
    half_bar: Metre = 0.2889
    """Length of each half of a folding bar, from hinge pin to V-joint: in a closed, regular ring of
    N sections and aperture diameter D through its corners, D sin(pi / N) / 2 - hinge_offset.
    """
    half_diagonal: Metre = 0.4275
    """Half the length of a diagonal, from hinge pin to pivot."""
    hinge_offset: MetreOrZero = 0.006554
    """Distance of the pins from the vertical line of their hinge assembly."""
    hinge_error: HingeError | None = None
    """How much further the pins stand; left out, they are where they are drawn."""
    corner_mass: KilogramOrZero = 0.0198
    """Mass of each hinge assembly."""
    vjoint_mass: KilogramOrZero = 0.0198
    """Point mass at each V-joint."""
    hinge_size: Metre = 0.0112
    """Edge of the cube whose inertia a hinge assembly has (its density is 13 975 kg/m^3)."""
    opening_angle: Degree = 46.0
    """Initial angle between the bar halves: near 0 stowed, 180 deployed."""
    angle_error: PerSection[AngleError] | None = None
    """How much further open, upper and lower V-joints alike, a section is held before it is
    released; left out, all are at ``opening_angle``, or as errors of their rods' lengths leave
    them."""

    @model_validator(mode="after")
    def _possible(self) -> "PantographRing":
        self.require_below(
            "half_bar", "half_diagonal", "the diagonals could not span the deployed section"
        )
        self.require_below(
            "hinge_offset", "half_bar", "shorten it, a hinge assembly is smaller than a section"
        )
        for name, error in self.hinge_error or ():
            if self.hinge_offset + np.min(error) < 0.0:
                raise ValueError(
                    f"hinge_error.{name} = {np.min(error):g} m must be at least "
                    f"{-self.hinge_offset:g}, the negative of hinge_offset: the pin would lie "
                    "beyond its hinge assembly, in the next section (raise it)"
                )
        if self.closed and self.sections < 3:
            raise ValueError(
                f"sections = {self.sections} must be at least 3 for a closed ring "
                "(or set closed = false)"
            )
        if not self.closed and self.sections >= self.polygon_sections:
            raise ValueError(
                f"sections = {self.sections} must be below polygon_sections = "
                f"{self.polygon_sections} for an open arc (raise it, or set closed = true)"
            )
        if self.opening_angle < LEAST_OPENING:
            meant = math.degrees(self.opening_angle)
            raise ValueError(
                f"opening_angle = {self.opening_angle} deg must be at least {LEAST_OPENING:g} deg: "
                f"angles are in degrees (write {meant:.4g} if {self.opening_angle} rad is meant)"
            )
        if self.opening_angle > 179.9:
            raise ValueError(
                f"opening_angle = {self.opening_angle} deg must be at most 179.9: there is "
                "nothing left to deploy"
            )
        for error in np.ravel(0.0 if self.angle_error is None else self.angle_error):
            if not LEAST_OPENING <= self.opening_angle + error <= 179.9:
                cure = "lower" if error > 0.0 else "raise"
                raise ValueError(
                    f"angle_error = {error:g} deg must leave opening_angle = {self.opening_angle} "
                    f"deg between {LEAST_OPENING:g} and 179.9 deg: {cure} it"
                )
        if self.corner_mass == 0.0:
            raise ValueError(
                "corner_mass = 0.0 kg must be positive: a hinge assembly is a rigid body"
            )
        self.geometry()
        return self

    def check(self, scene: "Scene") -> None:
        """See ``Structure``."""
        for rod in ("diagonal", "bar"):
            tube, longest = f"rods.{rod}.outer_diameter", f"structure.half_{rod}"
            scene.require_below(tube, longest, "a rod must be longer than thick")
        highest = 2.0 * self.half_diagonal
        if scene.boom is not None and scene.boom.length < highest:
            raise ValueError(
                f"boom.length = {scene.boom.length} m must be at least {highest:.4g} m, the "
                "height of the ring folded as far as it goes (2 half_diagonal): the sliding joint "
                "would leave the boom"
            )
        if scene.stop is not None:
            scene.require_below("stop.stowed_angle", "structure.opening_angle")
        present = [] if scene.cables is None else scene.cables.present()
        for plane, cable in present:
            reason = cable.bracket.refusal(self.opening_angle)
            if reason is not None:
                raise ValueError(f"cables.{self.planes[plane]}.{reason}")
            if cable.bracket.on_rod and not scene.rods.oriented:
                raise ValueError(
                    f'cables.{self.planes[plane]}.bracket.kind = "{kind_of(cable.bracket)}" needs '
                    f'rods.kind = "geometrically-exact", not "{kind_of(scene.rods)}": choose one '
                    "of both"
                )
        if present and self.sections > 1 and self.hinge_offset < LEAST_HINGE_OFFSET:
            raise ValueError(
                f"structure.hinge_offset = {self.hinge_offset} m must be at least "
                f"{LEAST_HINGE_OFFSET:g} m with cables: the rope runs between the hinge pulleys of "
                "neighbouring sections, which would coincide (set it to "
                f"{LEAST_HINGE_OFFSET:g} for pulleys on one axis, or leave the cables out)"
            )

    @property
    def coordinate(self) -> float:
        """Initial angle phi of the bar halves from the horizontal, rad."""
        return 0.5 * (math.pi - math.radians(self.opening_angle))

    @property
    def reach(self) -> float:
        """See ``Structure``."""
        return self.half_bar

    def strained_by(self) -> str:
        """See ``Structure``."""
        given = (name for name in ("hinge_error", "angle_error") if getattr(self, name) is not None)
        return next(given, "")

    def held_angles(self) -> Array | None:
        """See ``Structure``."""
        if self.angle_error is None:
            return None
        return np.radians(np.tile(spread(self.angle_error, self.sections), (2, 1)))

    def geometry(self) -> RingGeometry:
        """The ideal ring."""
        return RingGeometry.of_polygon(
            self.sections, closed=self.closed, polygon_sections=self.polygon_sections,
            aspect_ratio=self.aspect_ratio, half_bar=self.half_bar,
            half_diagonal=self.half_diagonal, hinge_offset=self.hinge_offset,
        )  # fmt: skip

    def describe(self) -> dict[str, str]:
        """See ``Structure``."""
        geometry = self.geometry()
        arc = f"open arc of a polygon with {self.polygon_sections} sides"
        shape = "closed ring" if self.closed else arc
        # The first corner lies on the major axis of the ellipse.
        chord = 2.0 * (self.half_bar + self.hinge_offset)
        major, (x, y) = geometry.plan[0, 0], geometry.plan[1, :2]
        minor = abs(y) / math.sqrt(1.0 - (x / major) ** 2)
        round_ = abs(major - minor) < 1e-6 * major
        axes = f"{2.0 * chord * major:.4f} m and {2.0 * chord * minor:.4f} m"
        whole = f"a circle of {2.0 * chord * major:.4f} m"
        curve = whole if round_ else f"an ellipse with axes {axes}"
        degrees = math.degrees(self.opening_angle)
        meant = f" ({self.opening_angle} rad would be {degrees:.4g} deg)" if degrees < 180.0 else ""
        return {
            "structure": f"{kind_of(self)}, {shape}, {self.sections} section"
            + "s" * (self.sections > 1),
            "polygon": f"equal chords of {chord:.4f} m on {curve}",
            "deployed": _size(geometry, 0.0),
            "initial": f"{_size(geometry, self.coordinate)} at {self.opening_angle} deg{meant}",
        }

    def path_slope(self, cable: Any, angles: Any) -> float:
        """See ``Structure``."""
        return float(np.sum(cable.bracket.path_slope(self.half_bar, cable.block_offset, angles)))

    def basis(self, coordinate: float) -> Array:
        """See ``Structure``: 1, cos(phi), sin(phi) and sin(theta), d cos(theta) = l cos(phi).

        The distance of two corners 2 (l cos(phi) + a), half the height d sin(theta) and the
        directions of all rods are linear in them.  NaN where the diagonals are too short.
        """
        c, s = math.cos(coordinate), math.sin(coordinate)
        ratio = (self.half_bar / self.half_diagonal) ** 2
        rest = 1.0 - ratio * c * c
        h = math.sqrt(rest) if rest > 0.0 else math.nan
        slope = ratio * c * s / h
        return np.array([[1.0, c, s, h], [0.0, -s, c, slope]])

    def layout(self, scene: "Scene", coordinate: Any) -> Layout:
        """See ``Structure``; the coordinate is phi, and every point that of ``RingGeometry``."""
        draft, geometry = Draft(scene), self.geometry()
        fold = geometry.fold(coordinate)
        cube = self.corner_mass * self.hinge_size**2 / 6.0 * np.eye(3)
        hinge = Lump("hinges", self.corner_mass, np.zeros(3), cube)
        draft.corners = [[draft.body(at, [hinge]) for at in plane] for plane in fold.corners]
        add_sections(
            draft, geometry, fold, draft.corners, self.vjoint_mass, errors=self.hinge_error
        )
        return replace(draft.finish(), held=self.held_angles())


def _size(geometry: RingGeometry, phi: float) -> str:
    extent = np.ptp(geometry.fold(phi).corners.reshape(-1, 3), axis=0)
    return " x ".join(f"{length:.3f}" for length in extent) + " m"
