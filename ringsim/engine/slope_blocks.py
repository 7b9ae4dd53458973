r"""V pulleys on blocks between nodes with slope vectors, the coordinates of paper 000's rods.

A node holds its position r and the slopes y and z of its cross-section, nine coordinates.  The
axes of a bar half are y / \|y\| and y x z / \|y x z\|, so the block stands at

    p = r - sense h b / \|b\|,   b = c_L + c_R,   c = y / \|y\| + t (y x z) / \|y x z\|,

t = -sense for the left half and +sense for the right: the point of ``ringsim.engine.cable_path``
as a function of the coordinates alone.  A force F on the pulley acts on them as (dp/dq)^T F, the
exact virtual work; as only directions count, it does none on the stretch of a cross-section.
With u = v / \|v\| and any constant vector g,

    du/dv = (I - u u^T) / \|v\|,
    d2(g . u)/dv2 = -((u . g) (I - 3 u u^T) + g u^T + u g^T) / \|v\|^2,

the rest is the chain rule.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.rotations import cross, skew

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
SLOPES = 6
"""Coordinates of the two slope vectors of a node."""


class Direction:
    """The unit vectors u of vectors v, shape (n, 3), with their derivatives."""

    def __init__(self, vectors: Array) -> None:
        self.size = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
        self.unit = vectors / self.size
        self._outer = self.unit[:, :, None] * self.unit[:, None, :]

    def first(self) -> Array:
        """du/dv, shape (n, 3, 3)."""
        return np.asarray((np.eye(3) - self._outer) / self.size[:, :, None])

    def second(self, along: Array) -> Array:
        """Second derivative of g . u after v with g = ``along`` (n, 3), shape (n, 3, 3)."""
        dot = np.einsum("ij,ij->i", self.unit, along)[:, None, None]
        mixed = along[:, :, None] * self.unit[:, None, :]
        curved = dot * (np.eye(3) - 3.0 * self._outer) + mixed + mixed.transpose(0, 2, 1)
        return np.asarray(-curved / self.size[:, :, None] ** 2)


class Half:
    """c = y / |y| + t (y x z) / |y x z| of bar halves from their slopes (y, z), shape (n, 6)."""

    def __init__(self, slopes: Array, sign: Array) -> None:
        y, z = slopes[:, :3], slopes[:, 3:]
        self._sign = sign
        self._across, self._along = Direction(y), Direction(cross(y, z))
        self._turned = np.concatenate([-skew(z), skew(y)], axis=2)
        self.vector = self._across.unit + sign * self._along.unit

    def first(self) -> Array:
        """Derivative of c after the slopes, shape (n, 3, 6)."""
        found: Array = self._sign[:, :, None] * (self._along.first() @ self._turned)
        found[:, :, :3] += self._across.first()
        return found

    def second(self, along: Array) -> Array:
        """Second derivative of g . c with g = ``along`` (n, 3), shape (n, 6, 6)."""
        aside = skew((self._along.first() @ along[:, :, None])[:, :, 0])
        found: Array = self._turned.transpose(0, 2, 1) @ self._along.second(along) @ self._turned
        found[:, :3, 3:] -= aside
        found[:, 3:, :3] += aside
        found *= self._sign[:, :, None]
        found[:, :3, :3] += self._across.second(along)
        return found


@dataclass(frozen=True)
class SlopePlaced:
    """The blocks at one instant.

    Attributes
    ----------
    arms, arm_rates
        From the V-joint to the pulley (m) and its rate (m/s), shape (blocks, 3).
    maps
        Derivative of the arms after the slopes of the left and the right node, each of shape
        (blocks, 3, 6).
    """

    arms: Array
    arm_rates: Array
    maps: tuple[Array, Array]
    reach: Array
    block: Direction
    halves: tuple[Half, Half]
    rates: tuple[Array, Array]

    def turning(self, forces: Array) -> list[list[Array]]:
        """Second derivative of F . arm after the slopes of two nodes, [first][second].

        Parameters
        ----------
        forces
            F on the pulleys, N, shape (blocks, 3).
        """
        scaled = self.reach * forces
        curved = self.block.second(scaled)
        along = (self.block.first() @ scaled[:, :, None])[:, :, 0]
        slopes = [half.first() for half in self.halves]
        found = [[a.transpose(0, 2, 1) @ curved @ b for b in slopes] for a in slopes]
        for k, half in enumerate(self.halves):
            found[k][k] = found[k][k] + half.second(along)
        return found

    def swings(self) -> tuple[Array, Array]:
        """Derivative of the arms' rates after the slopes of either node at fixed rates."""
        found = np.zeros((2, len(self.arms), 3, SLOPES))
        for axis in range(3):
            force = np.broadcast_to(np.eye(3)[axis], self.arms.shape)
            second = self.turning(force)
            for k in range(2):
                for other, rate in enumerate(self.rates):
                    found[k, :, axis] += (second[k][other] @ rate[:, :, None])[:, :, 0]
        return found[0], found[1]


@dataclass(frozen=True)
class SlopeBlocks:
    """Blocks between the nodes ``left`` and ``right``; sense (+1, -1) and offset (m), (n, 1)."""

    left: Indices
    right: Indices
    sense: Array
    offset: Array

    def place(self, coordinates: Array, rates: Array) -> SlopePlaced:
        """The blocks from the coordinates of all nodes and their rates, shape (nodes, 9)."""
        ends = (self.left, self.right)
        signs = (-self.sense, self.sense)
        halves = tuple(
            Half(coordinates[end, 3:], sign) for end, sign in zip(ends, signs, strict=True)
        )
        moving = tuple(rates[end, 3:] for end in ends)
        block = Direction(halves[0].vector + halves[1].vector)
        reach = -self.sense * self.offset
        first = reach[:, :, None] * block.first()
        maps = tuple(first @ half.first() for half in halves)
        turned = sum((m @ r[:, :, None])[:, :, 0] for m, r in zip(maps, moving, strict=True))
        return SlopePlaced(
            arms=reach * block.unit,
            arm_rates=np.asarray(turned),
            maps=(maps[0], maps[1]),
            reach=reach,
            block=block,
            halves=(halves[0], halves[1]),
            rates=(moving[0], moving[1]),
        )
