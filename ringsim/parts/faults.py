"""Faults: what breaks or sticks, where and when, and what it changes."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ringsim.parts.laws import AngleLaw, AngleRecord, Array, Place, Reaction, Switches, two_sided
from ringsim.units import Model, SecondOrZero, TorsionDamping, TorsionRate

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The family of faults: things that break at a given time and place.


AT_ONCE = 1e-8
"""Faults strike together that are nearer than this, s: the accelerations of shorter steps are
round-off of places.  Where Newton fails steps are as short as 1e-9 s, of which one does no harm;
one of 1e-10 s moves the opening of ring18 by 1 ms, one of 1e-12 s by 0.3 s, and several blew rings
up that sound steps open."""


@dataclass
class Struck:
    """What faults can change, between two steps of a run or on the way of a margin.

    ``folded`` are the angles by which V-joints are folded, shape (planes, sections), rad, NaN where
    nobody knows; ``encoders`` what each shows (``LAST``, ``SILENT``), None without a controller;
    ``ropes`` the cables' (``ringsim.cable.ropes``) with the natural length ``stored``
    in each span, m, and the rope ``wound`` at both ends of each cable, m; None without cables.
    """

    planes: tuple[str, ...]
    switches: Switches
    folded: Array
    ropes: Any = None
    stored: Any = None
    wound: Any = None
    encoders: Any = None


class Fault(Model):
    """Anything that breaks; a kind says in ``strike`` what it changes, and engines do the rest."""

    time: SecondOrZero
    """When it happens, in s of the simulation."""
    jolts: ClassVar[bool] = True
    """Whether forces jump when it strikes."""

    def laws(self, planes: tuple[str, ...], sections: int) -> list[AngleLaw]:
        """Laws on V-joints that it will switch on."""
        return []

    def strike(self, now: Struck) -> None:
        """Change what it breaks; ValueError if that does not exist."""
        raise NotImplementedError

    def clear(self, now: Struck) -> None:
        """Take a strike back from what goes on from a stored state; ValueError if nobody can.

        Laws begin as the scene has them, so that only faults of ropes have something to do.
        """

    def unlatches(self, planes: tuple[str, ...]) -> Place | None:
        """The V-joint whose latch no longer catches, if it is such a fault."""
        return None

    def check(self, scene: "Scene") -> None:
        """Raise a ValueError, told behind the fault's name, where a scene has nothing to break."""


class JointFault(Fault):
    """A fault of one V-joint."""

    plane: str = "upper"
    """Plane of the V-joint, one of those of the structure."""
    section: Annotated[int, Field(ge=1)]
    """Counted from 1 at the boom."""

    def place(self, planes: tuple[str, ...]) -> Place:
        """Of the V-joint."""
        return planes.index(self.plane), self.section - 1


# A latch that does not catch.


class FailedLatch(JointFault):
    """The latch of a V-joint does not catch from that time on; one that has caught holds on."""

    kind: Literal["failed-latch"] = "failed-latch"
    jolts: ClassVar[bool] = False

    def strike(self, now: Struck) -> None:
        """Nothing but that: its pawl is lifted all the same."""

    def unlatches(self, planes: tuple[str, ...]) -> Place | None:
        """See ``Fault``."""
        return self.place(planes)

    def check(self, scene: "Scene") -> None:
        """See ``Fault``."""
        if scene.stop is None or not scene.stop.latch:
            raise ValueError(
                "is a fault of a latch, but the stops have none: set stop.latch = true, or leave "
                "the fault out"
            )


# A spring that breaks.


class FailedSpring(JointFault):
    """The spring of a V-joint gives no torque any more; what it had stored is lost."""

    kind: Literal["failed-spring"] = "failed-spring"

    def strike(self, now: Struck) -> None:
        """See ``Fault``."""
        for law in now.switches.of_group("springs"):
            now.switches.set(law, self.place(now.planes), on=0.0)

    def check(self, scene: "Scene") -> None:
        """See ``Fault``."""
        if scene.hinge_spring is None:
            raise ValueError(
                "is a fault of a spring, but the scene has none: add [hinge_spring], or leave the "
                "fault out"
            )


# A V-joint that seizes.


class StuckVJoint(JointFault, AngleRecord):
    """A stiff spring holds the joint at the angle that it has at that time."""

    kind: Literal["stuck-vjoint"] = "stuck-vjoint"
    stiffness: TorsionRate = 1000.0
    """Of the spring that holds the joint."""
    damping: TorsionDamping = 1.0
    """Of the damper beside it."""

    def laws(self, planes: tuple[str, ...], sections: int) -> list[AngleLaw]:
        """The spring, which holds nothing yet."""
        places = (self.place(planes),)
        return [AngleLaw("stuck", self, places, np.zeros(1), np.zeros(1), holds=True)]

    def strike(self, now: Struck) -> None:
        """See ``Fault``."""
        place = self.place(now.planes)
        for law in now.switches.of_record(self):
            now.switches.set(law, place, on=1.0, setting=float(now.folded[place]))

    def reaction(self, folded: Any, rate: Any, setting: Any, xp: Any = np) -> Reaction:
        """See ``AngleRecord``; ``setting`` is the angle at which the joint is held."""
        return two_sided(folded - setting, rate, self.stiffness, self.damping)


# A sensor that fails.


LAST, SILENT = 1.0, 2.0
"""What an encoder shows that has failed: its last reading, or nothing."""


class FailedSensor(JointFault):
    """The encoder of a V-joint fails: the controller is shown the same angle from then on, or
    none.
    """

    kind: Literal["failed-sensor"] = "failed-sensor"
    jolts: ClassVar[bool] = False
    shows: Literal["last", "nothing"] = "last"
    """What the controller is shown: the last reading, or that there is none."""

    def strike(self, now: Struck) -> None:
        """See ``Fault``."""
        if now.encoders is not None:
            now.encoders[self.place(now.planes)] = LAST if self.shows == "last" else SILENT

    def check(self, scene: "Scene") -> None:
        """See ``Fault``."""
        if scene.controller is None:
            raise ValueError(
                "is a fault of a sensor, but the scene has no controller that reads one: add "
                "[controller], or leave the fault out"
            )


# Striking them in the order of their times.


class Faults:
    """Those of a scene that wait for their time."""

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        self.waiting = sorted(faults, key=lambda fault: fault.time)

    @property
    def next_time(self) -> float:
        """Time of the next fault, s; infinite if there is none left."""
        return self.waiting[0].time if self.waiting else math.inf

    def due(self, time: float) -> list[Fault]:
        """Those whose time (s) has come, which wait no longer."""
        found = [fault for fault in self.waiting if fault.time <= time + AT_ONCE]
        del self.waiting[: len(found)]
        return found
