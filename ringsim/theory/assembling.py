"""A structure put together from parts that are not as drawn.

Where all parts are, places x and axes R of bodies and of the rods' nodes, is what has the least
elastic energy of the rods,

    sum_e (u . K_u u + psi . K_psi psi) / 2,   with joints closed and the mean opening angle held,

or every opening angle, where sections are held at their own; u and psi are strains against the
natural lengths (``ringsim.theory.screws``).  Loads, net and springs do not act yet.  Stationary
points are found by Gauss and Newton's method with Lagrange's multipliers for joints and angles.
How a free structure lies in space, and what else its joints leave free, stays as near to the
drawing as a weak spring on every frame in each iteration keeps it.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array, csc_array, eye_array
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from ringsim.layout.bodies import InSpace, Mount, OnBody
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.joints import Joint, JointOpening
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array, Pose
from ringsim.layout.stiffness import stiffness_of
from ringsim.parts.rods.family import Rods
from ringsim.theory import screws

_MOST = 60
_BALANCED = 1e-8
"""Force (N) that may be out of balance on a frame; a scene's loads are a million times as large."""
_CLOSED = 1e-12
"""Gap (m) and tilt of a joint that is round-off."""
_WEAK = 1e-9
"""Springs that hold what is free, over the stiffness of the stiffest rod: a millionth of how stiff
a ring of 18 is against becoming an oval."""
_CLOSES: dict[str, tuple[screws.OfTwo, ...]] = {
    "revolute": (screws.apart, screws.tilted),
    "sleeve": (screws.aside,),
    "prismatic": (screws.off_x, screws.tilted, screws.turned_aside),
    "weld": (screws.apart, screws.tilted, screws.turned_aside),
}
"""What must vanish of each kind of joint."""


def made(joint: Joint) -> Joint:
    """A joint with its error in the arm that is not as drawn."""
    if joint.error is None:
        return joint
    assert isinstance(joint.second, OnBody)
    second = joint.second._replace(arm=joint.second.arm + joint.error)
    return replace(joint, second=second, error=None)


class Frames:
    """Places and axes of all bodies and nodes, and of space, which is last."""

    def __init__(self, layout: Layout, rods: Rods, *, locked: bool) -> None:
        layout = replace(layout, joints=tuple(made(joint) for joint in layout.joints))
        self._layout = layout
        nodes = [rod.node(k) for rod in layout.rods for k in range(len(rod.stations))]
        poses = [*(body.pose for body in layout.bodies), *nodes]
        self._size = 6 * len(poses)
        self._place = np.array([*(pose.place for pose in poses), np.zeros(3)])
        self._axes = np.array([*(pose.axes for pose in poses), np.eye(3)])
        counts = [len(rod.stations) for rod in layout.rods]
        self._first = np.cumsum([len(layout.bodies), *counts])
        pairs, lengths, stiffness = [], [], []
        for first, rod in zip(self._first, layout.rods, strict=False):
            for k, length in enumerate(rod.natural_lengths.tolist()):
                pairs.append((first + k, first + k + 1))
                lengths.append(length)
                stiffness.append(stiffness_of(rod, rods, length))
        self._elements = np.array(pairs)
        self._stiffness = np.array(stiffness)
        self._strains = screws.strains(np.array(lengths))
        self._scale = float(self._stiffness[:, 0].max())
        self._joints = []
        for kind in sorted({joint.kind for joint in layout.all_joints}):
            own = [joint for joint in layout.all_joints if joint.kind == kind]
            sides = [[joint.first for joint in own], [joint.second for joint in own]]
            self._joints += [(function, self._sides(sides)) for function in _CLOSES[kind]]
        found = [(one.joint, one.sense) for plane in layout.openings for one in plane
                 if isinstance(one, JointOpening)]  # fmt: skip
        opening = [layout.joints[number] for number, _ in found]
        self._senses = np.array([sense for _, sense in found])
        self._openings = self._sides([[j.first for j in opening], [j.second for j in opening]])
        count = len(found)
        mean = np.full((min(count, 1), count), 1.0 / max(count, 1))
        held = None if locked else layout.held
        self._held = np.eye(count) if locked or held is not None else mean
        self._folded = self._angles()[0] - (0.0 if held is None else held.ravel())
        self.energy = 0.0

    def relax(self) -> Layout:
        """Move all frames to where they balance."""
        multipliers = None
        for _ in range(_MOST):
            ends = self._place, self._axes
            values, slopes = self._over(self._strains, self._elements, ends)
            self.energy = 0.5 * float(np.sum(self._stiffness * values**2))
            spots = self._spots(self._elements)
            force = np.einsum("nm,nmk->nk", self._stiffness * values, slopes)
            summed = np.bincount(spots.ravel(), force.ravel(), self._size + 6)
            pushed = np.asarray(summed[: self._size], dtype=float)
            gaps, rows = self._closing()
            if multipliers is not None:
                left = np.abs(pushed + self._scale * (rows.T @ multipliers)).max()
                if left < _BALANCED and np.abs(gaps).max() < _CLOSED:
                    return self._moved()
            blocks = np.einsum("nmi,nm,nmj->nij", slopes, self._stiffness, slopes)
            multipliers = self._step(self._summed(blocks, spots), rows, pushed, gaps)
        raise ValueError(
            "the structure cannot be put together: with these rods nothing balances near the "
            "drawing (reduce rods.length_error, structure.hinge_error or structure.angle_error)"
        )

    def _step(self, stiffness: csc_array, rows: csc_array, pushed: Array, gaps: Array) -> Array:
        """Move by Newton's step; returns Lagrange's multipliers over the scale."""
        scale, n = self._scale, self._size
        held = stiffness + _WEAK * scale * eye_array(n)
        both = coo_array(scale * rows)
        top = coo_array(held)
        row = np.concatenate([top.row, both.row + n, both.col])
        column = np.concatenate([top.col, both.col, both.row + n])
        values = np.concatenate([top.data, both.data, both.data])
        size = n + len(gaps)
        matrix = csc_array(coo_array((values, (row, column)), shape=(size, size)))
        found = splu(matrix).solve(-np.concatenate([pushed, scale * gaps]))
        move = found[:n].reshape(-1, 6)
        self._place[:-1] += move[:, :3]
        self._axes[:-1] = Rotation.from_rotvec(move[:, 3:]).as_matrix() @ self._axes[:-1]
        return np.asarray(found[n:])

    def _closing(self) -> tuple[Array, csc_array]:
        """Gaps of all joints and what the mean angle is off, (c,), with derivatives."""
        gaps, rows, columns, slopes = [], [], [], []
        count = 0
        for function, (pairs, arms, turns) in self._joints:
            found, by = self._over_mounts(function, pairs, arms, turns)
            number = np.arange(found.size).reshape(found.shape) + count
            gaps.append(found.ravel())
            shape = by.shape
            rows.append(np.broadcast_to(number[:, :, None], shape).ravel())
            columns.append(np.broadcast_to(self._spots(pairs)[:, None, :], shape).ravel())
            slopes.append(by.ravel())
            count += found.size
        angles, by_turn = self._angles()
        gaps.append(self._held @ (angles - self._folded))
        shape = (*self._held.shape, 12)
        numbers = np.arange(len(self._held)) + count
        rows.append(np.broadcast_to(numbers[:, None, None], shape).ravel())
        columns.append(np.broadcast_to(self._spots(self._openings[0]), shape).ravel())
        slopes.append((self._held[:, :, None] * by_turn).ravel())
        entries = np.concatenate(slopes), (np.concatenate(rows), np.concatenate(columns))
        size = count + len(self._held), self._size + 6
        matrix = csc_array(coo_array(entries, shape=size))
        return np.concatenate(gaps), matrix[:, : self._size]

    def _angles(self) -> tuple[Array, Array]:
        """Angles (rad) by which V-joints are folded, and derivatives, shape (openings, 12)."""
        _, turned = self._mounted(*self._openings)
        first, second = turned[:, 0], turned[:, 1]
        y, z, other = first[:, :, 1], first[:, :, 2], second[:, :, 1]
        sine = np.sum(np.cross(y, other) * z, axis=1)
        folded = self._senses * np.arctan2(sine, np.sum(y * other, axis=1))
        folded += 2.0 * np.pi * (folded < -0.5 * np.pi)
        slopes, share = np.zeros((len(z), 12)), self._senses[:, None] * z
        slopes[:, 3:6], slopes[:, 9:] = -share, share
        return folded, slopes

    def _sides(self, sides: list[list[Mount]]) -> tuple[Array, Array, Array]:
        """Numbers of the frames of mounts by side, shape (n, 2), with arms and axes there."""
        found = [[self._mount(mount) for mount in side] for side in sides]
        shapes = ((-1, 2), (-1, 2, 3), (-1, 2, 3, 3))
        number, arms, axes = (
            np.array([[mount[k] for mount in pair] for pair in zip(*found, strict=True)])
            for k in range(3)
        )
        return (
            number.astype(int).reshape(shapes[0]), arms.reshape(shapes[1]), axes.reshape(shapes[2])
        )  # fmt: skip

    def _mount(self, mount: Mount) -> tuple[int, Array, Array]:
        if isinstance(mount, InSpace):
            return len(self._place) - 1, mount.place, mount.axes
        if isinstance(mount, OnBody):
            return mount.body, mount.arm, mount.axes
        return int(self._first[mount.rod]) + mount.station, np.zeros(3), np.eye(3)

    def _mounted(self, pairs: Array, arms: Array, turns: Array) -> tuple[Array, Array]:
        """Places and axes of mounts, shapes (n, 2, 3) and (n, 2, 3, 3)."""
        axes = self._axes[pairs]
        return self._place[pairs] + np.einsum("nsij,nsj->nsi", axes, arms), axes @ turns

    def _over_mounts(
        self, function: screws.OfTwo, pairs: Array, arms: Array, turns: Array
    ) -> tuple[Array, Array]:
        """Values of a function of mounts, and derivatives after the frames that carry them."""
        place, axes = self._mounted(pairs, arms, turns)
        ends = place[:, 0], axes[:, 0], place[:, 1], axes[:, 1]
        values, slopes = screws.values_and_slopes(function, ends)
        # A mount moves by the turn of its frame, too: dx = dX - a x d phi.
        lever = place - self._place[pairs]
        for side in (0, 1):
            at = slice(6 * side, 6 * side + 3)
            swung = np.cross(lever[:, side, None], slopes[:, :, at])
            slopes[:, :, 6 * side + 3 : 6 * side + 6] += swung
        return values, slopes

    def _over(
        self, function: screws.OfTwo, pairs: Array, frames: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Values and derivatives of a function of two frames."""
        place, axes = frames
        first, second = pairs.T
        ends = place[first], axes[first], place[second], axes[second]
        return screws.values_and_slopes(function, ends)

    def _spots(self, pairs: Array) -> Array:
        """Unknowns of pairs of frames, shape (n, 12)."""
        return (6 * pairs[:, :, None] + np.arange(6)).reshape(len(pairs), 12)

    def _summed(self, blocks: Array, spots: Array) -> csc_array:
        row = np.broadcast_to(spots[:, :, None], blocks.shape).ravel()
        column = np.broadcast_to(spots[:, None, :], blocks.shape).ravel()
        whole = coo_array((blocks.ravel(), (row, column)), shape=(self._size + 6,) * 2)
        return csc_array(whole)[: self._size, : self._size]

    def _moved(self) -> Layout:
        """The layout with its parts where the frames are."""
        layout = self._layout

        def at(frame: int, drawn: Pose) -> Pose:
            return replace(drawn, place=self._place[frame].copy(), axes=self._axes[frame].copy())

        bodies = tuple(
            replace(body, pose=at(number, body.pose)) for number, body in enumerate(layout.bodies)
        )
        rods = tuple(
            replace(
                rod,
                nodes=tuple(
                    at(int(first) + k, rod.station(share)) for k, share in enumerate(rod.stations)
                ),
            )
            for first, rod in zip(self._first, layout.rods, strict=False)
        )
        net = layout.net
        if net is not None:
            corners = np.array([bodies[number].pose.place for number in net.bodies])
            net = net._replace(hub=FreeHub(net.law, len(corners)).hub(corners))
        return replace(layout, bodies=bodies, rods=rods, net=net)
