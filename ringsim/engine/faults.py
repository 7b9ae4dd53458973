"""Faults of a scene, struck at their times between two steps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.faults.family import CableFault
from ringsim.cable.state import ChainState
from ringsim.engine.cables import CableDrive
from ringsim.engine.connectors import StuckJoint
from ringsim.engine.model import Multibody
from ringsim.parts.faults.stuck_vjoint import StuckVJoint

Array = NDArray[np.float64]


class Faults:
    """The faults of a scene, in the order of their times.

    Attributes
    ----------
    joints
        V-joints that stick.
    """

    def __init__(self, model: Multibody, drive: CableDrive | None) -> None:
        self._drive = drive
        faults = sorted(model.scene.faults, key=lambda fault: fault.time)
        self._waiting = [
            (fault, StuckJoint(model, fault) if isinstance(fault, StuckVJoint) else None)
            for fault in faults
        ]
        self.joints = [joint for _, joint in self._waiting if joint is not None]

    @property
    def next_time(self) -> float:
        """Time of the next fault, s; infinite if there is none left."""
        return self._waiting[0][0].time if self._waiting else math.inf

    def strike(self, time: float, angles: Array, state: ChainState | None) -> bool:
        """Strike all faults that are due; returns whether there was one.

        Parameters
        ----------
        angles
            Opening angles, shape (2, sections), rad.
        state
            The cables now, if the scene has any.
        """
        due = [one for one in self._waiting if one[0].time <= time + 1e-12]
        del self._waiting[: len(due)]
        for fault, joint in due:
            if joint is not None:
                joint.strike(angles)
            elif isinstance(fault, CableFault) and self._drive is not None and state is not None:
                self._drive.ropes = fault.strike(self._drive.ropes, state)
        return bool(due)
