"""The cables' paths along an ideal ring, as functions of the bar angle phi alone.

All sections see the same two spans beside the V pulley, of length

    L(phi) = sqrt(l^2 + h^2 + 2 l h sin(phi)),   dL/dphi = l h cos(phi) / L,

which fall by psi against the horizontal, cos(psi) = l cos(phi) / L; every other span keeps its
length.  The cosine between the directions u of the spans on either side of a pulley is

    -sin(psi) at the pulley next to a winch, cos(2 psi) at a V pulley, (e . w) cos(psi) elsewhere,

e the direction of the section and w that of the short span on the hinge assembly: so it is
A cos(psi) + B sin(psi) + C cos(2 psi) with constants of the pulley.  Source of L: paper 000, eq. 20
and fig. 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.cables import pulleys_of
from ringsim.cable.records import Cable
from ringsim.geometry.ring import Fold, RingGeometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PathShape:
    """What of a path does not depend on phi.

    Attributes
    ----------
    folding
        1 for the spans beside a V pulley, 0 for the others, shape (spans,).
    fixed
        Length of the others, 0 for the spans beside a V pulley, m, shape (spans,).
    cosines
        A, B and C of each pulley, shape (3, pulleys).
    """

    folding: Array
    fixed: Array
    cosines: Array

    @classmethod
    def of(cls, geometry: RingGeometry, cable: Cable, winch_distance: float) -> PathShape:
        """The path of one cable; those of the two planes are mirror images."""
        directions = geometry.directions
        between = directions[:-1] + directions[1:]
        apart = np.linalg.norm(between, axis=1)
        along = np.einsum("ki,ki->k", directions[:-1], between / apart[:, None])
        short = geometry.hinge_offset * apart
        if cable.end == "last":
            along, short = along[::-1], short[::-1]
        sections = geometry.sections
        pulleys = pulleys_of(sections, winches=len(cable.winches))
        folding, fixed = np.ones(pulleys + 1), np.zeros(pulleys + 1)
        folding[0::3] = 0.0
        fixed[0], fixed[3 : 3 * sections : 3] = winch_distance, short
        cosines = np.zeros((3, pulleys))
        cosines[1, 0] = -1.0
        cosines[2, 1::3] = 1.0
        cosines[0, 2 : 3 * sections - 1 : 3] = cosines[0, 3::3] = along
        if cable.end == "both":
            fixed[-1], cosines[1, -1] = winch_distance, -1.0
        return cls(folding, fixed, cosines)


def path_points(
    geometry: RingGeometry, fold: Fold, plane: int, cable: Cable, winch_distance: float, phi: float
) -> Array:
    """Points of a path, shape (points, 3), m: winch, pulleys, far end."""
    inward = np.array([0.0, 0.0, -1.0 if plane == 0 else 1.0])
    left, right = fold.left[plane], fold.right[plane]
    aside, inwards = cable.bracket.place(phi, cable.block_offset)
    drop = geometry.half_bar * np.sin(phi) + inwards
    blocks = 0.5 * (left + right) + drop * inward + aside * geometry.directions
    path = np.stack([left, blocks, right], axis=1).reshape(-1, 3)
    if cable.end == "last":
        path = path[::-1]
    down = winch_distance * inward
    far = path[-1:] + down if cable.end == "both" else path[:0]
    return np.concatenate([path[:1] + down, path, far])


def path_point_rates(
    geometry: RingGeometry, rate: Fold, plane: int, cable: Cable, phi: float
) -> Array:
    """Derivatives of ``path_points`` after phi, m/rad; ``rate`` is the fold's."""
    inward = np.array([0.0, 0.0, -1.0 if plane == 0 else 1.0])
    left, right = rate.left[plane], rate.right[plane]
    aside, inwards = cable.bracket.rate(phi, cable.block_offset)
    drop = geometry.half_bar * np.cos(phi) + inwards
    blocks = 0.5 * (left + right) + drop * inward + aside * geometry.directions
    path = np.stack([left, blocks, right], axis=1).reshape(-1, 3)
    if cable.end == "last":
        path = path[::-1]
    far = path[-1:] if cable.end == "both" else path[:0]
    return np.concatenate([path[:1], path, far])
