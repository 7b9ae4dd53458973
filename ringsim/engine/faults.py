"""The faults that strike a multibody model between two steps."""

import math

from ringsim.cable.faults.family import CableFault
from ringsim.cable.state import ChainState
from ringsim.engine.cables import CableDrive
from ringsim.engine.connectors import Springs, opening_joints, torsion
from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array
from ringsim.parts.faults.failed_spring import FailedSpring
from ringsim.parts.faults.family import AT_ONCE
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.parts.springs import Reaction


class StuckJoint:
    """A V-joint that a fault will hold: a torsion spring that lies inactive until then."""

    def __init__(self, model: Multibody, fault: StuckVJoint) -> None:
        self._law, self._system = fault, model.assembly.system
        self._place = model.scene.structure.planes.index(fault.plane), fault.section - 1
        planes = opening_joints(model, 'faults of kind "stuck-vjoint"', "faults")
        joint, self._sense = planes[self._place[0]][self._place[1]]
        linear = {"stiffness": fault.stiffness, "damping": fault.damping, "activeConnector": False}
        self._object, self._angle = torsion(model, joint.markers, **linear), math.nan

    def strike(self, angles: Array) -> None:
        """Hold the joint at the opening angle that it has now."""
        self._angle = float(angles[self._place])
        offset = self._sense * (math.pi - self._angle)
        self._system.SetObjectParameter(self._object, "offset", offset)
        self._system.SetObjectParameter(self._object, "activeConnector", True)

    def reaction(self, state: State, angles: Array, rates: Array) -> tuple[Reaction, Array]:
        """See ``Reacting``."""
        rate = rates[self._place]
        if math.isnan(self._angle):  # the fault has not struck
            return Reaction(0.0, 0.0, 0.0), rate
        return self._law.torque(float(angles[self._place]) - self._angle, rate), rate


class Faults:
    """The faults of a scene, in the order of their times, each struck between two steps.

    ``joints`` are the V-joints that will stick.
    """

    def __init__(self, model: Multibody, drive: CableDrive | None, springs: Springs | None) -> None:
        self._drive, self._springs = drive, springs
        self._planes = model.scene.structure.planes
        self._waiting = [
            (fault, StuckJoint(model, fault) if isinstance(fault, StuckVJoint) else None)
            for fault in sorted(model.scene.faults, key=lambda fault: fault.time)
        ]
        self.joints = [joint for _, joint in self._waiting if joint is not None]

    @property
    def next_time(self) -> float:
        """Time of the next fault, s; infinite if there is none left."""
        return self._waiting[0][0].time if self._waiting else math.inf

    def strike(self, time: float, angles: Array, state: ChainState | None) -> bool:
        """Strike all faults that are due, at opening angles (rad) of shape (planes, sections) and
        a state of the cables; returns whether there was one.
        """
        due = [one for one in self._waiting if one[0].time <= time + AT_ONCE]
        del self._waiting[: len(due)]
        for fault, joint in due:
            if joint is not None:
                joint.strike(angles)
            elif isinstance(fault, FailedSpring) and self._springs is not None:
                self._springs.fail((self._planes.index(fault.plane), fault.section - 1))
            elif isinstance(fault, CableFault) and self._drive is not None and state is not None:
                self._drive.ropes = fault.strike(self._drive.ropes, state)
        return bool(due)
