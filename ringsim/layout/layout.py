"""A structure at one value of its coordinate: the one description that every room reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import Body, InSpace, Mount, OnBody, Rod
from ringsim.layout.joints import Joint, JointOpening, Opening
from ringsim.layout.pose import Pose, cross
from ringsim.layout.sheaves import BlockSheave, Sheave
from ringsim.layout.springs import BoomBeam, Contact, HubNet, Spring

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layout:
    """Everything that a structure consists of, with its rates; SI units throughout.

    Attributes
    ----------
    bodies, rods, joints
        Numbered by their place here.
    openings
        Opening angles by plane and section.
    corners
        Hinge assemblies by plane and corner, as numbers of bodies.
    paths
        Sheaves of each cable of the scene in order, from its first winch to its far end.
    springs, contacts, net, boom
        What else acts between bodies.
    forces
        Constant forces: number of the joint whose first mount they act on, and vector, N.
    """

    bodies: tuple[Body, ...]
    rods: tuple[Rod, ...]
    joints: tuple[Joint, ...]
    openings: tuple[tuple[Opening, ...], ...]
    corners: tuple[tuple[int, ...], ...]
    paths: tuple[tuple[Sheave, ...], ...]
    springs: tuple[Spring, ...]
    contacts: tuple[Contact, ...]
    net: HubNet | None
    boom: BoomBeam | None
    forces: tuple[tuple[int, Array], ...]

    def pose(self, mount: Mount) -> Pose:
        """The frame of a mount, with its own axes."""
        if isinstance(mount, InSpace):
            return Pose(mount.place, mount.axes, np.zeros(3), np.zeros(3))
        if isinstance(mount, OnBody):
            body = self.bodies[mount.body].pose
            place, rate = body.at(mount.arm)
            return Pose(place, body.axes @ mount.axes, rate, body.turn)
        rod = self.rods[mount.rod]
        return rod.station(rod.stations[mount.station])

    def masses(self) -> dict[str, float]:
        """Mass of each group of parts, kg."""
        found: dict[str, float] = {}
        for rod in self.rods:
            found[rod.group] = found.get(rod.group, 0.0) + rod.mass
        lumps = [lump for body in self.bodies for lump in body.lumps]
        for group, mass in [(lump.group, lump.mass) for lump in lumps] + [
            ("V-joints", mass) for rod in self.rods for _, mass in rod.masses
        ]:
            found[group] = found.get(group, 0.0) + mass
        if self.boom is not None:
            found["boom"] = found.get("boom", 0.0) + self.boom.record.mass
        if self.net is not None:
            found["hub"] = self.net.mass
        return found

    def inertia(self) -> Array:
        """Mass matrix of (V, W, q'), shape (7, 7): rigid motion about the origin, and the fold.

        A rod of mass m is m / 6 at its ends and 2 m / 3 in its middle (Simpson's rule, exact for
        what is quadratic along it), and its cross-sections turn with it; the net's hub and a
        flexible boom are left out.
        """
        points, spins = [], []
        for body in self.bodies:
            centre = body.centre
            axes, arm = body.pose.axes, centre
            shift = body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            points.append((body.mass, *body.pose.at(arm)))
            spins.append((axes @ (body.inertia - shift) @ axes.T, body.pose.turn))
        for rod in self.rods:
            for share, part in ((0.0, 1.0), (0.5, 4.0), (1.0, 1.0)):
                pose = rod.station(share)
                points.append((part / 6.0 * rod.mass, pose.place, pose.rate))
            second = rod.density * rod.length * rod.tube.second_moment
            axes = rod.start.axes
            spins.append((axes @ np.diag([2 * second, second, second]) @ axes.T, rod.start.turn))
            for station, mass in rod.masses:
                pose = rod.station(rod.stations[station])
                points.append((mass, pose.place, pose.rate))
        matrix = np.zeros((7, 7))
        weights = np.array([p[0] for p in points])
        places, rates = np.array([p[1] for p in points]), np.array([p[2] for p in points])
        reach = np.zeros((len(points), 3, 7))
        reach[:, range(3), range(3)] = 1.0
        x, y, z = places.T
        reach[:, 0, 4], reach[:, 0, 5], reach[:, 1, 5] = z, -y, x
        reach[:, 1, 3], reach[:, 2, 3], reach[:, 2, 4] = -z, y, -x
        reach[:, :, 6] = rates
        matrix += np.einsum("i,iaj,iak->jk", weights, reach, reach)
        for tensor, turn in spins:
            turning = np.zeros((3, 7))
            turning[:, 3:6], turning[:, 6] = np.eye(3), turn
            matrix += turning.T @ tensor @ turning
        return matrix

    def sheave(self, sheave: Sheave) -> tuple[Array, Array]:
        """Place of a sheave in space and its derivative after the coordinate, shape (3,), m."""
        if not isinstance(sheave, BlockSheave):
            return self.pose(sheave.mount).at(sheave.arm)
        left, right = self.pose(sheave.left), self.pose(sheave.right)
        both = left.axes[:, 1] + right.axes[:, 1]
        both = both + sheave.sense * (right.axes[:, 0] - left.axes[:, 0])
        arm = -sheave.sense * sheave.offset * both / np.linalg.norm(both)
        turn = 0.5 * (left.turn + right.turn)
        return left.place + arm, left.rate + cross(turn, arm)

    def opening_angles(self) -> tuple[Array, Array]:
        """Opening angles, rad, and derivatives after the coordinate, shape (planes, sections)."""
        found = np.array([[self._opening(one) for one in plane] for plane in self.openings])
        return found[..., 0], found[..., 1]

    def _opening(self, opening: Opening) -> tuple[float, float]:
        if not isinstance(opening, JointOpening):
            pose = self.bodies[opening.body].pose
            (x, y, _), (by_x, by_y, _) = pose.place - opening.centre, pose.rate
            return float(np.arctan2(x, -y)), float(x * by_y - y * by_x) / float(x * x + y * y)
        joint = self.joints[opening.joint]
        first, second = self.pose(joint.first), self.pose(joint.second)
        y, other, z = first.axes[:, 1], second.axes[:, 1], first.axes[:, 2]
        folded = opening.sense * float(np.arctan2(cross(y, other) @ z, y @ other))
        folded += 2.0 * np.pi if folded < -0.5 * np.pi else 0.0
        return np.pi - folded, -opening.sense * float((second.turn - first.turn) @ z)

    @property
    def supports(self) -> tuple[Joint, ...]:
        """Joints to places in space."""
        return tuple(j for j in self.joints if isinstance(j.first, InSpace))
