"""Friction of joints that is no plain damper, in exudyn's torsional dampers.

exudyn's damper gives the torque d w + m at a rate w.  Before every residual its d and m are set so
that this line goes through the law at Newton's iterate: the residual is the law's, and d is the
slope that Newton's tangent has.  So the slope may be the secant to the other side of zero rate
where a joint turns round within a step (``ringsim.stepping.turning``), which no user function of
exudyn's allows: it differentiates those by itself.
"""

from collections.abc import Sequence
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.parts.joint_friction.family import JointFriction
from ringsim.stepping.turning import Turning

_RATE = exu.OutputVariableType.AngularVelocityLocal


class DryJoints:
    """The joints of a model whose friction is not proportional to their rates."""

    def __init__(self, system: Any) -> None:
        self._system = system
        self._families: list[tuple[JointFriction, list[Any], Turning]] = []

    def add(self, law: JointFriction, markers: Sequence[tuple[Any, Any]]) -> None:
        """Joints between pairs of markers about their common z axis; ``law`` has values for all of
        them, or arrays with one for each.
        """
        add, damper = self._system.AddObject, item.ObjectConnectorTorsionalSpringDamper
        dampers = [add(damper(markerNumbers=list(pair))) for pair in markers]
        self._families.append((law, dampers, Turning()))

    def begin(self) -> None:
        """Begin an attempt at a step."""
        for *_, turning in self._families:
            turning.forget()

    def follow(self) -> None:
        """Take the lines of all laws at the current state; due before every residual."""
        system = self._system
        for law, dampers, turning in self._families:
            rates = np.array([system.GetObjectOutput(damper, _RATE) for damper in dampers])
            turning.note(law, rates)
            slopes = turning.tangents(law, rates, law.torque)
            rest = law.torque(rates) - slopes * rates
            for damper, slope, torque in zip(dampers, slopes, rest, strict=True):
                system.SetObjectParameter(damper, "damping", slope)
                system.SetObjectParameter(damper, "torque", torque)
