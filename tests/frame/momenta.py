"""Momentum of frames, summed over their points by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.frame.model import FrameModel
from ringsim.frame.state import State

Array = NDArray[np.float64]


def momenta(model: FrameModel, state: State, *, craft: bool = True) -> Array:
    """Momentum (kg m/s) and angular momentum about the origin (kg m^2/s), shape (2, 3); of all, or
    without the spacecraft.
    """
    mesh, place, rate = model.mesh, state.place.points, state.rate.points
    own = np.array(mesh.point_mass)
    if not craft:
        own[mesh.craft] = 0.0
    pushed = own[:, None] * rate
    for (first, second), (mass, other) in zip(mesh.point, mesh.mass, strict=True):
        pushed[first] += mass * rate[first] + other * rate[second]
        pushed[second] += mass * rate[second] + other * rate[first]
    if model.with_hub:
        place = np.vstack([place, state.place.hub])
        pushed = np.vstack([pushed, model.web.hub_mass * state.rate.hub])
    return np.array([pushed.sum(axis=0), np.cross(place, pushed).sum(axis=0)])
