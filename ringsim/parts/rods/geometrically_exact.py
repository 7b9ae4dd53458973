"""Geometrically exact (Simo-Reissner) beams."""

from typing import Literal

from ringsim.parts.rods.family import Rods


class GeometricallyExactRods(Rods):
    """Shear-deformable beams with rigid-body nodes, interpolated on SE(3).

    Source: exudyn ObjectBeamGeometricallyExact; Simo and Vu-Quoc (1986).
    """

    kind: Literal["geometrically-exact"] = "geometrically-exact"
