"""What holds bodies and rods together, and which angles say how far a structure has opened."""

from dataclasses import dataclass
from typing import Literal

from ringsim.layout.bodies import Mount
from ringsim.layout.pose import Array


@dataclass(frozen=True)
class Joint:
    """A joint between two places that coincide; its axes are those of its mounts.

    "revolute" turns about z, "prismatic" slides along x, "sleeve" slides along z and turns freely,
    "weld" holds everything.  By its ``family`` a scene gives it friction: "pivot", "hinge",
    "vjoint", ...; empty if it cannot have any.  ``section`` counts from 0.  Where a part is not
    made as drawn, ``error`` is by how much longer the arm of the second mount, a body's, is (m); in
    a structure that has been put together the arm has it.
    """

    kind: Literal["revolute", "prismatic", "sleeve", "weld"]
    family: str
    section: int
    first: Mount
    second: Mount
    error: Array | None = None


@dataclass(frozen=True)
class JointOpening:
    """An opening angle at a revolute: pi less ``sense`` times the turn of the second part.

    It is pi, and the joint locked, where both parts lie in line.  ``lift`` is the direction in
    space of a load that opens it, shape (3,).
    """

    joint: int
    sense: float
    lift: Array


@dataclass(frozen=True)
class ChordOpening:
    """The angle about z of the line from a point in space to a body's origin, from -y; no lock."""

    body: int
    centre: Array


Opening = JointOpening | ChordOpening
