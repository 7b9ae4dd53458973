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

import numpy as np

from ringsim.engine.rotations import Array, cross, skew

SLOPES = 6
"""Coordinates of the two slope vectors of a node."""


class Direction:
    """The unit vectors u of vectors v, shape (n, 3), with their derivatives."""

    def __init__(self, vectors: Array) -> None:
        self._size = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None, None]
        self.unit = vectors / self._size[:, 0]
        self._outer = self.unit[:, :, None] * self.unit[:, None, :]

    def first(self) -> Array:
        """du/dv, shape (n, 3, 3)."""
        return np.asarray((np.eye(3) - self._outer) / self._size)

    def second(self, along: Array) -> Array:
        """Second derivative of g . u after v with g = ``along`` (n, 3), shape (n, 3, 3)."""
        dot = np.einsum("ij,ij->i", self.unit, along)[:, None, None]
        mixed = along[:, :, None] * self.unit[:, None, :]
        curved = dot * (np.eye(3) - 3.0 * self._outer) + mixed + mixed.transpose(0, 2, 1)
        return np.asarray(-curved / self._size**2)


class HalfFrame:
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


class PlacedBlocks:
    """Blocks at one instant, between a left and a right node each.

    They are found from the nodes' slopes and their rates, shape (2, blocks, 6), and ``sense`` and
    ``offset`` (m) of ``BlockSheave``, shape (blocks, 1).

    Attributes
    ----------
    arms, arm_rates
        From the V-joint to the pulley (m) and its rate (m/s), shape (blocks, 3).
    maps
        Derivative of the arms after the slopes of either node, shape (2, blocks, 3, 6).
    """

    def __init__(self, slopes: Array, rates: Array, sense: Array, offset: Array) -> None:
        count = len(sense)
        self._halves = HalfFrame(slopes.reshape(-1, SLOPES), np.concatenate([-sense, sense]))
        self._block = Direction(self._halves.vector[:count] + self._halves.vector[count:])
        self._reach = -sense * offset
        self._by_half = self._halves.first().reshape(2, count, 3, SLOPES)
        self.arms = self._reach * self._block.unit
        self.maps = self._reach[:, :, None] * self._block.first() @ self._by_half
        self.arm_rates = np.einsum("sbij,sbj->bi", self.maps, rates)

    def turning(self, forces: Array) -> Array:
        """Second derivative of F . arm after the slopes of two nodes, shape (2, 2, blocks, 6, 6).

        The forces F act on the pulleys, N, shape (blocks, 3).
        """
        scaled = self._reach * forces
        along = (self._block.first() @ scaled[:, :, None])[:, :, 0]
        curved = self._by_half.transpose(0, 1, 3, 2) @ self._block.second(scaled)
        found: Array = curved[:, None] @ self._by_half[None]
        own = self._halves.second(np.concatenate([along, along]))
        found[range(2), range(2)] += own.reshape(2, -1, SLOPES, SLOPES)
        return found
