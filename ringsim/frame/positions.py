"""Places and velocities of a structure's points in joint coordinates."""

import numpy as np

from ringsim.frame.mesh import Mesh
from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.layout.bodies import OnBody, OnRod
from ringsim.layout.points import BOOM_TIP, HUB, Where, points_of
from ringsim.layout.pose import Array
from ringsim.refusal import InputError

_CLOSE = 1e-9
"""How far a point may be off those with mass of its body, m."""


class PositionMeter:
    """Reads points as means of the points with mass, whose rates are followed.

    A point of a rigid body is the same mean of four others of it wherever it moves.
    """

    def __init__(self, model: FrameModel) -> None:
        points = points_of(model.layout, model.scene.structure.planes)
        self.coordinates = points.coordinates
        self._mesh, rods = model.mesh, model.layout.rods
        self._first = np.cumsum([0, *(len(rod.lengths) for rod in rods)])
        self._weights = np.zeros((len(points.mounts), len(model.mesh.point_mass)))
        self._hub = points.names.index(HUB) if HUB in points.names else None
        for row, where in zip(self._weights, points.mounts, strict=True):
            self._weigh(row, where)

    def read(self, state: State) -> Array:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        both = state.place, state.rate
        found = np.stack([self._weights @ each.points for each in both], axis=1)
        if self._hub is not None:
            found[self._hub] = [each.hub[0] for each in both]
        return found

    def _weigh(self, row: Array, where: Where) -> None:
        mesh = self._mesh
        if where == BOOM_TIP:  # its elements come last
            row[mesh.point[-1, 1]] = 1.0
        elif isinstance(where, OnRod):
            first, last = self._first[where.rod : where.rod + 2]
            element = min(first + where.station, last - 1)
            row[mesh.point[element, first + where.station - element]] = 1.0
        elif isinstance(where, OnBody):
            row[:] = weights_of(mesh, where)


def weights_of(mesh: Mesh, where: OnBody) -> Array:
    """Shares of all points with mass in a point of a body, shape (points,).

    Raises
    ------
    InputError
        If the body has no mass around that point.
    """
    row = np.zeros(len(mesh.point_mass))
    own = np.flatnonzero(mesh.point_frame == where.body)
    known = np.vstack([mesh.point_arm[own].T, np.ones(len(own))])
    wanted = np.append(where.arm, 1.0)
    row[own] = np.linalg.lstsq(known, wanted, rcond=None)[0]
    if np.abs(known @ row[own] - wanted).max() > _CLOSE:
        raise InputError(
            f"record: body {where.body + 1} has no mass around its origin that tells where that is "
            "(positions and accelerations need it): give it an inertia, or choose fidelity = "
            '"full"'
        )
    return row
