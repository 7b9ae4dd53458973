"""What the base carries and how it turns."""

from typing import Any

import exudyn as exu
import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.rotations import Array
from ringsim.layout.bodies import InSpace
from ringsim.outputs.series import Carried
from ringsim.stepping.instant import Instant
from ringsim.theory.first_reaction import body_reaction, first_reaction

_KIND = exu.OutputVariableType


class BaseMeter:
    """Reads the base of a model: what exudyn's clamp of the ground carries, and of a spacecraft
    what accelerates it.
    """

    def __init__(self, built: Built) -> None:
        model, layout = built.model, built.model.layout
        self._system, self._layout, self._stops = model.assembly.system, layout, built.stops
        self._first = first_reaction(layout, model.moving)
        self._node = None if layout.base is None else model.bodies[layout.base][1]
        clamps = [j.holder for j in model.joints if isinstance(j.part.first, InSpace)]
        self._clamp = clamps[0] if clamps else None

    def read(self, now: Instant) -> Carried:
        """At the current state."""
        stops = self._stops
        torques = None if stops is None else stops.reaction(None, now.angles, now.rates)[0].total
        return Carried(self._reaction(), self._turn(), torques)

    def _reaction(self) -> Array | None:
        """Shape (2, 3), N and N m; None of a base that floats alone."""
        first, self._first = self._first, None
        if first is not None:  # the clamp has not been solved for yet
            return first
        if self._clamp is not None:
            found = [self._system.GetObjectOutput(self._clamp, kind) for kind in _CLAMP]
            return np.asarray(_SENSES * found)
        craft = self._layout.spacecraft
        if craft is None or self._layout.base is None:
            return None
        kinds = _KIND.Acceleration, _KIND.AngularAcceleration, _KIND.AngularVelocity
        moving, *turning = map(self._output, kinds)
        gravity = np.zeros(3) if self._layout.gravity is None else self._layout.gravity
        return body_reaction(craft, self._axes(), moving - gravity, *turning)

    def _turn(self) -> Array | None:
        """Rotation matrix since the start; None without a base."""
        if self._layout.base is None:
            return None
        return np.asarray(self._axes() @ self._layout.bodies[self._layout.base].pose.axes.T)

    def _axes(self) -> Array:
        return self._output(_KIND.RotationMatrix).reshape(3, 3)

    def _output(self, kind: Any) -> Array:
        return np.asarray(self._system.GetNodeOutput(self._node, kind))


_CLAMP = _KIND.ForceLocal, _KIND.TorqueLocal
"""Along the axes of the ground's marker, which are those of space."""
_SENSES = np.array([[-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0]])
"""exudyn tells multipliers: those of displacements, and of z_0 . y_1, z_0 . x_1 and x_0 . y_1, the
rates of which are w_x, -w_y and -w_z of the body."""
