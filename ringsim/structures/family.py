"""The family of structures, and errors of their hinge assemblies."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.cable.records import points_along
from ringsim.layout.layout import Layout
from ringsim.units import Model, PerSection, Unit

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The family of structures.


class Structure(Model):
    """Any deployable structure that a scene can hold: one file, found by its ``kind``.

    Its parts follow from one coordinate (a fold angle, rad).  The properties below are fields,
    constants or properties of a kind.
    """

    if TYPE_CHECKING:

        @property
        def sections(self) -> int:
            """Number of sections."""

        @property
        def closed(self) -> bool:
            """Whether the last section meets the first."""

        @property
        def coordinate(self) -> float:
            """Value of the coordinate at the start, rad."""

        @property
        def reach(self) -> float:
            """Length against which gaps are measured, m."""

    locks: ClassVar[bool] = True
    """Whether it has opened, and a run ended, when every opening angle has reached 180 deg."""

    supported: ClassVar[bool] = False
    """Whether it stands on a support of its own, without a boom."""
    planes: ClassVar[tuple[str, ...]] = ("upper", "lower")
    """Planes that a cable can run in."""
    long_names: ClassVar[dict[str, str]] = {}
    """What variables of a result mean for this kind, where it differs from the ring."""
    gauge: ClassVar[str] = ""
    """Name of the rod whose bending strain is recorded, if any."""
    shaping: ClassVar[tuple[str, ...]] = ()
    """Scene paths that decide where results are given: all samples of a campaign share them."""

    @classmethod
    def cable_points(cls, sections: int) -> tuple[str, ...]:
        """Names of what a cable runs along, from section 1 on."""
        return points_along(sections)

    @property
    def push(self) -> float:
        """Largest force of its own springs along the whole travel, N; 0 without springs."""
        return 0.0

    def layout(self, scene: "Scene", coordinate: Any) -> Layout:
        """What it consists of at a value of the coordinate, with all parts of a scene.

        The imaginary part ``ringsim.layout.bodies.STEP`` of the coordinate carries the derivatives:
        compute places with functions that take complex numbers, without ``float`` and ``abs``.
        """
        raise NotImplementedError

    def strained_by(self) -> str:
        """Name of a field that leaves parts beside the drawing, so that rods are strained before a
        run; empty if there is none.
        """
        return ""

    def held_angles(self) -> NDArray[np.float64] | None:
        """How much further than drawn each V-joint is held open before a run, shape (planes,
        sections), rad; None if they are as drawn.
        """
        return None

    def basis(self, coordinate: float) -> NDArray[np.float64]:
        """Functions s of the coordinate in which all places are linear, if a kind has some, so
        that the rigid mechanism need not build a layout at each coordinate: every place is P s
        with constant P.

        Shape (2, functions): s, of which the first is 1, and its derivative.
        """
        del coordinate
        return np.zeros((2, 0))

    def describe(self) -> dict[str, str]:
        """Its shape and size in words, by label, for ``ringsim check``."""
        return {"structure": str(type(self).model_fields["kind"].default)}

    def path_slope(self, cable: Any, angles: Any) -> float:
        """Derivative of the ideal path of a cable after the opening angle, m/rad, at the opening
        angles along it, shape (sections,), rad.
        """
        raise NotImplementedError

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError with part, value and cure where a scene does not go with this kind."""


# Pins of hinge assemblies that do not stand where they are drawn.


Shift = Annotated[float, Field(ge=-0.01, le=0.01), Unit("m")]


class HingeError(Model):
    """How much further than ``hinge_offset`` pins stand from the line of their hinge assembly.

    Each pin carries an end of a diagonal and one of a folding bar; pulleys stay where they are
    drawn.  The structure is put together as with errors of its rods (``rods.length_error``).
    """

    upper_left: PerSection[Shift] = 0.0
    """Of the upper pin at the first corner of a section."""
    upper_right: PerSection[Shift] = 0.0
    """Of the upper pin at the second corner of a section."""
    lower_left: PerSection[Shift] = 0.0
    """Of the lower pin at the first corner of a section."""
    lower_right: PerSection[Shift] = 0.0
    """Of the lower pin at the second corner of a section."""
