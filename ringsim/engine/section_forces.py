r"""Force and moment in the middle of beam elements, by their formulation.

exudyn tells those of geometrically exact elements.  Of those with slope vectors it does not: they
are evaluated here from the nodes as its element does (Nachbagauer, Gruber and Gerstmayr, Structural
and continuum mechanics approaches for a 3D shear deformable ANCF beam finite element, 2013).  With
the means r', y and z of position's derivative and of the slopes in the middle, and their
derivatives along the element, y' and z',

    e3 = z / \|z\|,   e1 = y x z / \|y x z\|,   e2 = e3 x e1,
    Gamma = (e1 . r' - 1, e2 . r', e3 . r'),   kappa = 1/2 sum e_k x e_k',

in the axes e, and forces and moments are EA, kGA, kGA and GJ, EI, EI times these.
"""

from collections.abc import Callable, Sequence

import exudyn as exu
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rods import Ancf, beam_section
from ringsim.engine.rotations import Array
from ringsim.engine.slope_blocks import Direction

_KIND = exu.OutputVariableType
SectionForces = Callable[[State], tuple[Array, Array]]
"""Force (N) and moment (N m) in the axes of elements at a state, shape (3, elements) each."""


def section_forces(model: Multibody, places: Sequence[tuple[int, int]]) -> SectionForces:
    """Elastic ones in the middle of elements, each told by its rod and its place in the rod."""
    if isinstance(model.formulation, Ancf):
        return SlopeForces(model, places)
    output = model.assembly.system.GetObjectOutputBody
    elements = [model.rods[rod].elements[k] for rod, k in places]

    def read(state: State) -> tuple[Array, Array]:
        force, moment = (
            np.array([output(e, kind, [0.0] * 3) for e in elements]).T
            for kind in (_KIND.ForceLocal, _KIND.TorqueLocal)
        )
        return force, moment

    return read


class SlopeForces:
    """Those of elements with slope vectors."""

    def __init__(self, model: Multibody, places: Sequence[tuple[int, int]]) -> None:
        where = model.assembly.coordinates_of
        self._where = np.array(
            [[where(node) for node in model.rods[rod].nodes[k : k + 2]] for rod, k in places]
        )
        parts = [model.layout.rods[rod] for rod, _ in places]
        self._lengths = np.array(
            [part.natural_lengths[k] for part, (_, k) in zip(parts, places, strict=True)]
        )[:, None]
        rods = model.scene.rods
        self._stiffness = np.array(
            [np.diag(beam_section(rods, part, 0.0).stiffnessMatrix) for part in parts]
        ).T

    def __call__(self, state: State) -> tuple[Array, Array]:
        """As for ``SectionForces``."""
        first, last = state.position[self._where].swapaxes(0, 1)
        middle, along = 0.5 * (first + last), (last - first) / self._lengths
        y, z = middle[:, 3:6], middle[:, 6:]
        normal = np.cross(y, z)
        normal_along = np.cross(along[:, 3:6], z) + np.cross(y, along[:, 6:])
        e1, e1_along = _unit(normal, normal_along)
        e3, e3_along = _unit(z, along[:, 6:])
        e2, e2_along = np.cross(e3, e1), np.cross(e3_along, e1) + np.cross(e3, e1_along)
        axes = np.stack([e1, e2, e3], axis=1)
        turned = np.stack([e1_along, e2_along, e3_along], axis=1)
        strain = np.einsum("nij,nj->in", axes, along[:, :3])
        strain[0] -= 1.0
        bent = np.einsum("nij,nj->in", axes, 0.5 * np.cross(axes, turned).sum(axis=1))
        return self._stiffness[:3] * strain, self._stiffness[3:] * bent


def _unit(vectors: Array, along: Array) -> tuple[Array, Array]:
    """Unit vectors and their derivatives, from vectors and theirs, shape (n, 3) each."""
    direction = Direction(vectors)
    return direction.unit, np.einsum("nij,nj->ni", direction.first(), along)
