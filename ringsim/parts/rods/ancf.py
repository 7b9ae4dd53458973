"""Absolute nodal coordinate beams, as in the papers."""

from typing import Literal

from ringsim.parts.rods.family import Rods


class AncfRods(Rods):
    """Two-node beams with position and two slope vectors per node (18 coordinates).

    Source: papers 000 and 002, eq. 1; exudyn ObjectANCFBeam.  It does not tell what its damping
    takes: with damping there is no stress, the dissipation and the energy error are NaN, and steps
    are not judged by their energy.  Its damping works against the integrator's own velocities,
    which brake a rod that turns along its axis where steps are long (``ringsim.engine.rod_dampers``
    cures that for the other kind of rods): leave damping out, or take steps of some milliseconds.

    An element has constant curvature: a rod half in one is a quarter too stiff in bending, in n
    of them by 1 / 4 n^2.
    """

    kind: Literal["ancf"] = "ancf"
