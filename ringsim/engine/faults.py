"""Faults of a scene, struck at their times between two steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.faults.family import CableFault
from ringsim.cable.state import ChainState
from ringsim.engine.cables import CableDrive
from ringsim.engine.model import Model
from ringsim.parts.faults.family import Fault
from ringsim.parts.faults.stuck_vjoint import StuckVJoint

Array = NDArray[np.float64]


@dataclass
class _Stuck:
    """A V-joint that sticks, its place, and the angle that it is held at (rad) once it does."""

    fault: StuckVJoint
    place: tuple[int, int]
    angle: float | None = None


class Faults:
    """The faults of a scene, in the order of their times.

    A stuck V-joint is a torsion spring that lies inactive until its time comes.
    """

    def __init__(self, model: Model, drive: CableDrive | None) -> None:
        self._model, self._drive = model, drive
        self._waiting = sorted(model.scene.faults, key=lambda fault: fault.time)
        self._springs: dict[int, Any] = {}
        self._joints: list[_Stuck] = []
        for fault in self._waiting:
            if isinstance(fault, StuckVJoint):
                plane = model.scene.structure.planes.index(fault.plane)
                joint, _ = model.openings()[plane][fault.section - 1]
                self._joints.append(_Stuck(fault, (plane, fault.section - 1)))
                self._springs[id(fault)] = model.assembly.torsion_spring(
                    *joint.markers,
                    stiffness=fault.stiffness,
                    damping=fault.damping,
                    activeConnector=False,
                )

    @property
    def next_time(self) -> float:
        """Time of the next fault, s; infinite if there is none left."""
        return self._waiting[0].time if self._waiting else math.inf

    def strike(self, time: float, angles: Array, state: ChainState | None) -> bool:
        """Strike all faults that are due; returns whether there was one.

        Parameters
        ----------
        angles
            Opening angles, shape (2, sections), rad.
        state
            The cables now, if the scene has any.
        """
        due = [fault for fault in self._waiting if fault.time <= time + 1e-12]
        for fault in due:
            self._waiting.remove(fault)
            self._strike(fault, angles, state)
        return bool(due)

    def stuck_energy(self, angles: Array, rates: Array) -> tuple[float, tuple[Array, Array]]:
        """Elastic energy in J that stuck V-joints store, their damping (N m) and its rates.

        Parameters
        ----------
        angles, rates
            Opening angles and their rates, shape (2, sections), rad and rad/s.
        """
        stored, forces = 0.0, np.zeros(len(self._joints))
        turning = np.array([rates[stuck.place] for stuck in self._joints])
        for number, stuck in enumerate(self._joints):
            if stuck.angle is not None:
                turned = float(angles[stuck.place]) - stuck.angle
                reaction = stuck.fault.torque(turned, turning[number])
                stored += reaction.stored
                forces[number] = reaction.damping
        return stored, (forces, turning)

    def _strike(self, fault: Fault, angles: Array, state: ChainState | None) -> None:
        if isinstance(fault, StuckVJoint):
            stuck = next(stuck for stuck in self._joints if stuck.fault is fault)
            plane, section = stuck.place
            _, sense = self._model.openings()[plane][section]
            stuck.angle = float(angles[stuck.place])
            folded = math.pi - stuck.angle
            spring, system = self._springs[id(fault)], self._model.assembly.system
            system.SetObjectParameter(spring, "offset", sense * folded)
            system.SetObjectParameter(spring, "activeConnector", True)
        elif isinstance(fault, CableFault) and self._drive is not None and state is not None:
            self._drive.ropes = fault.strike(self._drive.ropes, state)
