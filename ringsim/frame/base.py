"""What the base carries and how it turns."""

import numpy as np

from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.layout.pose import Array
from ringsim.outputs.series import Carried
from ringsim.theory.first_reaction import first_reaction


class BaseMeter:
    """Reads the base of a model.

    The ground's reaction is what is out of balance on the unknowns that it holds; a spacecraft's
    is the inertia of its points.
    """

    def __init__(self, model: FrameModel) -> None:
        self._model, self._base = model, model.layout.base
        self._first = first_reaction(model.layout, model.moving)
        craft = model.layout.spacecraft
        self._mass = 0.0 if craft is None else 0.25 * craft.mass

    def read(self, state: State) -> Carried:
        """At a state."""
        torques = self._model.laws.stop_torques(state.pose.angle, state.rate.angles)
        return Carried(self._reaction(state), self._turn(state), torques)

    def _reaction(self, state: State) -> Array | None:
        """Shape (2, 3), N and N m; None of a base that floats alone."""
        first, self._first = self._first, None
        if first is not None:  # nothing has been out of balance yet
            return first
        if self._model.layout.supports:
            return self._model.reaction.reshape(2, 3)
        own = self._model.mesh.craft
        if not len(own):
            return None
        pulled = self._mass * (state.acceleration.points[own] - self._model.gravity)
        arms = state.place.points[own] - state.pose.place[self._base]
        return -np.array([pulled.sum(axis=0), np.cross(arms, pulled).sum(axis=0)])

    def _turn(self, state: State) -> Array | None:
        """Rotation matrix since the start; None without a base."""
        if self._base is None:
            return None
        start = self._model.layout.bodies[self._base].pose.axes
        return np.asarray(state.pose.axes[self._base] @ start.T)
