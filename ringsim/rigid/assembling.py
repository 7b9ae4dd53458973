"""A structure put together from parts that are not as drawn."""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ringsim.layout.bodies import (
    STEP,
    Array,
    InSpace,
    Joint,
    JointOpening,
    Mount,
    OnBody,
    Pose,
    stiffness_of,
)
from ringsim.layout.draft import balanced
from ringsim.layout.layout import Layout, layout_at_opening
from ringsim.outputs.corners import deviations
from ringsim.parts.rods import Rods
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted

# Strains of rods' elements and gaps of joints, for numbers real and complex.
#
# Frames are places, shape (n, 3), m, and axes, (n, 3, 3); a function of two of them has derivatives
# after the first one's place and turn and the second one's, (x_1, phi_1, x_2, phi_2), by the
# complex step (``ringsim.layout.bodies``): exact, and without a second set of equations.


Of = NDArray[Any]
"""Real or complex."""
OfTwo = Callable[[Of, Of, Of, Of], Of]
"""Place and axes of a first and a second frame give numbers, shape (n, m)."""


def values_and_slopes(function: OfTwo, ends: tuple[Array, ...]) -> tuple[Array, Array]:
    """Values, shape (n, m), and derivatives, (n, m, 12), at places and axes of n pairs."""
    values = np.asarray(function(*ends), dtype=float)
    slopes = np.empty((*values.shape, 12))
    unit = np.eye(3)
    for k in range(12):
        moved: list[Of] = [*ends]
        where, axis = 2 * (k // 6) + (k % 6) // 3, unit[k % 3]
        by = axis if k % 6 < 3 else np.cross(axis, ends[where], axisb=1, axisc=1)
        moved[where] = ends[where] + 1j * STEP * by
        slopes[..., k] = function(*moved).imag / STEP
    return values, slopes


def strains(lengths: Array) -> OfTwo:
    """Strains u (m) and psi (rad) of elements with these natural lengths (m), shape (n, 6).

    Those of ``ringsim.frame.state``: u = Z R^T d - L e_x and psi = log(R_1^T R_2), with series
    for psi, which is below 0.1 rad wherever rods hardly bend: what they leave out is below 1e-11.
    """

    def of(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
        between = np.swapaxes(r1, 1, 2) @ r2
        sine = 0.5 * _axial(between - np.swapaxes(between, 1, 2))
        s = np.sum(sine * sine, axis=1)[:, None]
        arc = 1 + s * (1 / 6 + s * (3 / 40 + s * (15 / 336 + s * (105 / 3456 + s * 945 / 42240))))
        psi = arc * sine
        along = np.einsum("nji,nj->ni", r1 @ _turned(0.5 * psi), x2 - x1)
        square = np.sum(psi * psi, axis=1)[:, None]
        c = -(1 / 24 + square * (7 / 5760 + square * (31 / 967680 + square * 127 / 154828800)))
        u = along + c * _crossed(psi, _crossed(psi, along))
        return np.concatenate([u - lengths[:, None] * np.eye(3)[0], psi], axis=1)

    return of


def apart(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first, in space, shape (n, 3), m."""
    del r1, r2
    return x2 - x1


def aside(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first frame's z axis, shape (n, 2), m."""
    del r2
    return np.asarray(np.einsum("nji,nj->ni", r1, x2 - x1)[:, :2])


def off_x(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first frame's x axis, shape (n, 2), m."""
    del r2
    return np.asarray(np.einsum("nji,nj->ni", r1, x2 - x1)[:, 1:])


def tilted(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second frame's x and y axes are from normal to the first one's z, (n, 2)."""
    del x1, x2
    return np.asarray(np.einsum("nk,nki->ni", r1[:, :, 2], r2)[:, :2])


def turned_aside(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second frame's y axis is from normal to the first one's x, shape (n, 1)."""
    del x1, x2
    return np.asarray(np.sum(r1[:, :, 0] * r2[:, :, 1], axis=1)[:, None])


def _axial(skewed: Of) -> Of:
    """Vectors a of matrices [a], shape (n, 3)."""
    return np.stack([skewed[:, 2, 1], skewed[:, 0, 2], skewed[:, 1, 0]], axis=1)


def _crossed(a: Of, b: Of) -> Of:
    return np.cross(a, b, axis=1)


def _turned(phi: Of) -> Of:
    """Rotations by small vectors (rad), shape (n, 3, 3), by series."""
    square = np.sum(phi * phi, axis=1)[:, None, None]
    sine = 1 - square * (1 / 6 - square * (1 / 120 - square / 5040))
    cosine = 0.5 - square * (1 / 24 - square * (1 / 720 - square / 40320))
    x, y, z = phi.T
    zero = 0 * x
    spun = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    return np.asarray(np.eye(3) + sine * spun + cosine * (spun @ spun))


# A structure put together from parts that are not as drawn.
#
# Where all parts are, places x and axes R of bodies and of the rods' nodes, is what has the least
# elastic energy of the rods,
#
#     sum_e (u . K_u u + psi . K_psi psi) / 2,   with joints closed and the mean opening angle held,
#
# or every opening angle, where sections are held at their own; u and psi are strains against the
# natural lengths (``ringsim.rigid.assembling``).  Loads, net and springs do not act yet.
# Stationary points are found by Gauss and Newton's method with Lagrange's multipliers for joints
# and angles. How a free structure lies in space, and what else its joints leave free, stays as near
# to the drawing as a weak spring on every frame in each iteration keeps it.


_MOST = 60
_BALANCED = 1e-8
"""Force (N) that may be out of balance on a frame; a scene's loads are a million times as large."""
_ROUNDED = 16.0 * sys.float_info.epsilon
"""The same over the stiffness of the stiffest rod, m.  Round-off alone leaves half an epsilon in a
ring of 3 sections and one in a ring of 72, with tubes of 12 and of 100 mm."""
_CLOSED = 1e-12
"""Gap (m) and tilt of a joint that is round-off."""
_WEAK = 1e-9
"""Springs that hold what is free, over the stiffness of the stiffest rod: a millionth of how stiff
a ring of 18 is against becoming an oval."""
_CLOSES: dict[str, tuple[OfTwo, ...]] = {
    "revolute": (apart, tilted),
    "sleeve": (aside,),
    "prismatic": (off_x, tilted, turned_aside),
    "weld": (apart, tilted, turned_aside),
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
        self._strains = strains(np.array(lengths))
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
        multipliers, balanced = None, max(_BALANCED, _ROUNDED * self._scale)
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
                if left < balanced and np.abs(gaps).max() < _CLOSED:
                    return self._moved()
            blocks = np.einsum("nmi,nm,nmj->nij", slopes, self._stiffness, slopes)
            multipliers = self._step(self._summed(blocks, spots), rows, pushed, gaps)
        raise InputError(
            "rods.length_error, structure.hinge_error, structure.angle_error: the structure cannot "
            "be put together, nothing balances near the drawing (reduce them)"
        )

    def _step(
        self,
        stiffness: "scipy.sparse.csc_array",
        rows: "scipy.sparse.csc_array",
        pushed: Array,
        gaps: Array,
    ) -> Array:
        """Move by Newton's step; returns Lagrange's multipliers over the scale."""
        scale, n = self._scale, self._size
        held = stiffness + _WEAK * scale * scipy.sparse.eye_array(n)
        both = scipy.sparse.coo_array(scale * rows)
        top = scipy.sparse.coo_array(held)
        row = np.concatenate([top.row, both.row + n, both.col])
        column = np.concatenate([top.col, both.col, both.row + n])
        values = np.concatenate([top.data, both.data, both.data])
        size = n + len(gaps)
        matrix = scipy.sparse.csc_array(
            scipy.sparse.coo_array((values, (row, column)), shape=(size, size))
        )
        found = scipy.sparse.linalg.splu(matrix).solve(-np.concatenate([pushed, scale * gaps]))
        move = found[:n].reshape(-1, 6)
        self._place[:-1] += move[:, :3]
        self._axes[:-1] = (
            scipy.spatial.transform.Rotation.from_rotvec(move[:, 3:]).as_matrix() @ self._axes[:-1]
        )
        return np.asarray(found[n:])

    def _closing(self) -> tuple[Array, "scipy.sparse.csc_array"]:
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
        matrix = scipy.sparse.csc_array(scipy.sparse.coo_array(entries, shape=size))
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
        self, function: OfTwo, pairs: Array, arms: Array, turns: Array
    ) -> tuple[Array, Array]:
        """Values of a function of mounts, and derivatives after the frames that carry them."""
        place, axes = self._mounted(pairs, arms, turns)
        ends = place[:, 0], axes[:, 0], place[:, 1], axes[:, 1]
        values, slopes = values_and_slopes(function, ends)
        # A mount moves by the turn of its frame, too: dx = dX - a x d phi.
        lever = place - self._place[pairs]
        for side in (0, 1):
            at = slice(6 * side, 6 * side + 3)
            swung = np.cross(lever[:, side, None], slopes[:, :, at])
            slopes[:, :, 6 * side + 3 : 6 * side + 6] += swung
        return values, slopes

    def _over(
        self, function: OfTwo, pairs: Array, frames: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Values and derivatives of a function of two frames."""
        place, axes = frames
        first, second = pairs.T
        ends = place[first], axes[first], place[second], axes[second]
        return values_and_slopes(function, ends)

    def _spots(self, pairs: Array) -> Array:
        """Unknowns of pairs of frames, shape (n, 12)."""
        return (6 * pairs[:, :, None] + np.arange(6)).reshape(len(pairs), 12)

    def _summed(self, blocks: Array, spots: Array) -> "scipy.sparse.csc_array":
        row = np.broadcast_to(spots[:, :, None], blocks.shape).ravel()
        column = np.broadcast_to(spots[:, None, :], blocks.shape).ravel()
        whole = scipy.sparse.coo_array((blocks.ravel(), (row, column)), shape=(self._size + 6,) * 2)
        return scipy.sparse.csc_array(whole)[: self._size, : self._size]

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
        return balanced(replace(layout, bodies=bodies, rods=rods))


# The structure as it is put together before a run.


class Assembled(NamedTuple):
    """A layout whose bodies and rods' nodes are where they balance, and their elastic energy, J."""

    layout: Layout
    energy: float


def assembled(layout: Layout, rods: Rods, *, locked: bool = False) -> Assembled:
    """The structure as it is put together; the layout itself if that is as drawn.

    Where it is ``locked`` every opening angle is held, not only their mean.

    Raises
    ------
    InputError
        If nothing balances near the drawing.
    """
    wrong = any(rod.strain for rod in layout.rods) or any(
        joint.error is not None for joint in layout.joints
    )
    if not wrong and (locked or layout.held is None):
        return Assembled(layout, 0.0)
    frames = Frames(layout, rods, locked=locked)
    return Assembled(frames.relax(), frames.energy)


# The shape of a structure that has opened and locked.


class Deployed(NamedTuple):
    """Deviations of the corners from the design, shape (planes, corners), m, and the elastic energy
    of the rods, J.
    """

    deviations: Array
    energy: float

    @property
    def rms(self) -> float:
        """Root of their mean square, m."""
        return float(np.sqrt(np.mean(self.deviations**2)))


def deployed(scene: Scene) -> Deployed:
    """At rest with every opening angle at 180 deg, unloaded: what is left where all vibrations are.

    Raises
    ------
    InputError
        If nothing balances near the drawing.
    """
    scene = substituted(scene)
    drawn = layout_at_opening(scene, math.pi)
    found = assembled(drawn, scene.rods, locked=True)
    places, wanted = (
        np.array([[layout.bodies[k].pose.place for k in plane] for plane in layout.corners])
        for layout in (found.layout, drawn)
    )
    return Deployed(deviations(places, wanted), found.energy)
