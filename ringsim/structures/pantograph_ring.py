"""The pantograph ring: closed, or an open arc of the same polygon (two sections: the truss)."""

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.choice import kind_of
from ringsim.layout.bodies import Lump
from ringsim.layout.draft import Draft
from ringsim.layout.layout import Layout
from ringsim.parts.persection import PerSection, spread
from ringsim.structures.family import Structure
from ringsim.structures.hinge_error import HingeError
from ringsim.structures.pantograph_sections import add_sections
from ringsim.structures.ring_geometry import RingGeometry
from ringsim.units import Degree, KilogramOrZero, Metre, MetreOrZero, Unit

AngleError = Annotated[float, Field(ge=-20.0, le=20.0), Unit("deg")]
LEAST_OPENING = 1.0
"""Degree; below it stand angles meant in radians, and hardly a fold: two bar halves of 0.3 m end
5 mm apart there, less than a bar is thick."""
LEAST_HINGE_OFFSET = 1e-6
"""Metre; directions of the rope between two pulleys are then good to 1e-10 in doubles."""


class PantographRing(Structure):
    """Sections of two crossing diagonals and two folding bars between hinge assemblies.

    The plan view is a polygon with equal chords on an ellipse; the hinge assemblies fix its
    angles.  Source: paper 002 (18-section antenna), table 1; paper 000 (two-section truss).
    """

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
    """Length of each half of a folding bar, from hinge pin to V-joint."""
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
                    f"{-self.hinge_offset:g}, the negative of hinge_offset: the pin would stand "
                    "beyond the line of its hinge assembly, in the next section (raise it)"
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

    def check(self, scene: Any) -> None:
        """See ``Structure``."""
        for rod in ("diagonal", "bar"):
            tube, longest = f"rods.{rod}.outer_diameter", f"structure.half_{rod}"
            scene.require_below(tube, longest, "a rod is longer than thick")
        highest = 2.0 * self.half_diagonal
        if scene.boom is not None and scene.boom.length < highest:
            raise ValueError(
                f"boom.length = {scene.boom.length} m must be at least {highest:.4g} m, the "
                "height of the stowed ring: the sliding joint would leave the boom"
            )
        if scene.stop is not None:
            scene.require_below("stop.stowed_angle", "structure.opening_angle")
        present = [] if scene.cables is None else scene.cables.present()
        for plane, cable in present:
            reason = cable.bracket.refusal(self.opening_angle)
            if reason is not None:
                raise ValueError(f"cables.{self.planes[plane]}.{reason}")
            if kind_of(cable.bracket) == "bar-half" and kind_of(scene.rods) == "ancf":
                raise ValueError(
                    f'cables.{self.planes[plane]}.bracket.kind = "bar-half" needs rods.kind = '
                    '"geometrically-exact", not "ancf": choose one of both'
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

    def held_angles(self) -> NDArray[np.float64] | None:
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
        degrees = math.degrees(self.opening_angle)
        meant = f" ({self.opening_angle} rad would be {degrees:.4g} deg)" if degrees < 180.0 else ""
        return {
            "structure": f"{kind_of(self)}, {shape}, {self.sections} section"
            + "s" * (self.sections > 1),
            "polygon": f"equal chords of {chord:.4f} m on an ellipse with axes "
            f"{2.0 * chord * major:.4f} m and {2.0 * chord * minor:.4f} m",
            "deployed": _size(geometry, 0.0),
            "initial": f"{_size(geometry, self.coordinate)} at {self.opening_angle} deg{meant}",
        }

    def path_slope(self, cable: Any, angles: Any) -> float:
        """See ``Structure``."""
        return float(np.sum(cable.bracket.path_slope(self.half_bar, cable.block_offset, angles)))

    def basis(self, coordinate: float) -> NDArray[np.float64]:
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

    def layout(self, scene: Any, coordinate: Any) -> Layout:
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
