"""Where the cables run: points of their paths as functions of the nodes' coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ringsim.cable.records import BlockSheave, FixedSheave, Sheave
from ringsim.exudyn.assembly import Array, Indices, axes_of, cross, gyration, skew, spin

# V pulleys on blocks between nodes with slope vectors, the coordinates of paper 000's rods.
#
# A node holds its position r and the slopes y and z of its cross-section, nine coordinates.  The
# axes of a bar half are y / \|y\| and y x z / \|y x z\|, so the block stands at
#
#     p = r - sense h b / \|b\|,   b = c_L + c_R,   c = y / \|y\| + t (y x z) / \|y x z\|,
#
# t = -sense for the left half and +sense for the right: the point of ``CablePath`` below as a
# function of the coordinates alone.  A force F on the pulley acts on them as (dp/dq)^T F, the
# exact virtual work; as only directions count, it does none on the stretch of a cross-section.
# With u = v / \|v\| and any constant vector g,
#
#     du/dv = (I - u u^T) / \|v\|,
#     d2(g . u)/dv2 = -((u . g) (I - 3 u u^T) + g u^T + u g^T) / \|v\|^2,
#
# the rest is the chain rule.


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


# Where the cables run: points of their paths as functions of the nodes' coordinates.
#
# A hinge pulley is a point fixed on a hinge assembly.  A V pulley stands on a block without mass
# that a gear keeps on the bisector of the two bar halves: it is the point
#
#     p = r - sense h b,   b = (y_L + y_R + sense (x_R - x_L)) / |...|,
#
# r the V-joint, x and y the axes of the halves' frames, h the block's offset, sense +1 in the upper
# plane and -1 in the lower.  Half the turn of each half turns the block, so a force F on the pulley
# acts as F on the joint and as the moment arm x F shared evenly by the halves: the coupling is
# exact and resists nothing.  Source: paper 000, fig. 3.
#
# Nodes have Euler parameters; with rods of kind "ancf" those of the bar halves have slope vectors
# instead, and blocks act on them as the head of this file says.


WIDTH = 7
"""Coordinates of a node: position and Euler parameters."""


@dataclass(frozen=True)
class Placed:
    """All points of all paths at one instant: places (m), velocities (m/s) and arms from the
    carrying nodes' positions (m, global), shape (points, 3); Euler parameters of all nodes, shape
    (nodes, 4); the blocks between nodes with slope vectors, if there are such nodes.
    """

    points: Array
    velocities: Array
    arms: Array
    turns: Array
    blocks: PlacedBlocks | None

    @cached_property
    def gyrations(self) -> Array:
        """Angular velocity after the rates of the Euler parameters, shape (nodes, 3, 4)."""
        return gyration(self.turns)


class CablePath:
    """Points, velocities and generalised forces of the cables' paths.

    ``paths`` are what each cable runs over, in order from its winch, on exudyn's nodes; ``slopes``
    is whether the nodes at the blocks have slope vectors.

    Attributes
    ----------
    nodes, per_cable
        exudyn nodes whose coordinates the path depends on; number of points of each cable.
    width, size
        Most coordinates of a node, and those of all nodes.
    leg_point, leg_node, leg_share, leg_carries
        Every dependence of a point on a node, in the order of the nodes: the point, the node's
        place in ``nodes``, the share of the turn of its Euler parameters that turns the point's
        arm (0 for slope vectors, which leaves their legs alone), and that of its displacement.
    spots
        Place of each node's coordinates among those of all nodes behind one another, shape
        (nodes, width); -1 where a node has fewer.
    """

    def __init__(self, paths: Sequence[Sequence[Sheave]], *, slopes: bool = False) -> None:
        sheaves = [sheave for path in paths for sheave in path]
        self.per_cable = [len(path) for path in paths]
        self.nodes: list[Any] = list({int(n): n for s in sheaves for n in s.nodes}.values())
        number = {int(node): place for place, node in enumerate(self.nodes)}
        blocks = np.array([isinstance(sheave, BlockSheave) for sheave in sheaves])
        self._fixed, self._block = np.flatnonzero(~blocks), np.flatnonzero(blocks)
        fixed = [sheave for sheave in sheaves if isinstance(sheave, FixedSheave)]
        block = [sheave for sheave in sheaves if isinstance(sheave, BlockSheave)]
        self._fixed_node = np.array([number[int(s.node)] for s in fixed], dtype=np.int64)
        self._fixed_arm = np.array([s.arm for s in fixed])
        ends = [[number[int(node)] for node in s.nodes] for s in block]
        self._ends = np.array(ends, dtype=np.int64).reshape(-1, 2).T
        self._sense = np.array([s.sense for s in block]).reshape(-1, 1)
        self._offset = np.array([s.offset for s in block]).reshape(-1, 1)
        self._carrier = np.empty(len(sheaves), dtype=np.int64)
        self._carrier[self._fixed], self._carrier[self._block] = self._fixed_node, self._ends[0]

        self._slopes = slopes
        self.width = 3 + SLOPES if slopes else WIDTH
        widths = np.full(len(self.nodes), WIDTH)
        widths[self._ends] = self.width
        self._held = np.arange(self.width) < widths[:, None]
        self.size = int(self._held.sum())
        self.spots = np.where(self._held, np.cumsum(self._held).reshape(self._held.shape) - 1, -1)

        legs = np.concatenate([self._fixed_node, *self._ends])
        order = np.argsort(legs, kind="stable")
        counts = (len(fixed), len(block), len(block))
        self.leg_node = legs[order]
        self.leg_point = np.concatenate([self._fixed, self._block, self._block])[order]
        self.leg_share = np.repeat([1.0, *((0.0, 0.0) if slopes else (0.5, 0.5))], counts)[order]
        self.leg_carries = np.repeat([1.0, 1.0, 0.0], counts)[order]
        self._first_leg = np.searchsorted(self.leg_node, np.arange(len(self.nodes)))
        # Side and block of the legs that depend on slope vectors.
        self._sloped = np.flatnonzero((order >= len(fixed)) & slopes)
        self._place = np.divmod(order[self._sloped] - len(fixed), max(len(block), 1))

    def by_node(self, values: Array) -> Array:
        """Values of all coordinates, (size,), as (nodes, width); 0 where a node has fewer."""
        found = np.zeros(self._held.shape, dtype=values.dtype)
        found[self._held] = values
        return found

    def in_a_row(self, values: Array) -> Array:
        """Values by node, (nodes, width), as (size,)."""
        return values[self._held]

    def place(self, coordinates: Array, rates: Array) -> Placed:
        """Points and velocities from the nodes' coordinates and rates, shape (nodes, width)."""
        turns = coordinates[:, 3:7]
        axes, spins = axes_of(turns), spin(turns, rates[:, 3:7])
        arms, turning = np.zeros((2, len(self._carrier), 3))
        arms[self._fixed] = np.einsum("nij,nj->ni", axes[self._fixed_node], self._fixed_arm)
        turning[self._fixed] = spins[self._fixed_node]
        blocks = None
        if self._slopes:
            slopes, moving = coordinates[self._ends, 3:], rates[self._ends, 3:]
            blocks = PlacedBlocks(slopes, moving, self._sense, self._offset)
            arms[self._block] = blocks.arms
        else:
            left, right = axes[self._ends]
            along, across = right[:, :, 0] - left[:, :, 0], left[:, :, 1] + right[:, :, 1]
            bisector = across + self._sense * along
            size = np.sqrt(np.einsum("ij,ij->i", bisector, bisector))
            arms[self._block] = (-self._sense * self._offset / size[:, None]) * bisector
            turning[self._block] = 0.5 * (spins[self._ends[0]] + spins[self._ends[1]])
        points = coordinates[self._carrier, :3] + arms
        velocities = rates[self._carrier, :3] + cross(turning, arms)
        if blocks is not None:
            velocities[self._block] += blocks.arm_rates
        return Placed(points, velocities, arms, turns, blocks)

    def generalised(self, placed: Placed, forces: Array) -> Array:
        """Generalised forces on the nodes' coordinates, (nodes, width), of point forces (N)."""
        pull = forces[self.leg_point]
        moments = self.leg_share[:, None] * cross(placed.arms[self.leg_point], pull)
        by_leg = np.empty((len(pull), self.width))
        by_leg[:, :3] = self.leg_carries[:, None] * pull
        turns = placed.turns[self.leg_node]
        scalar, vector = turns[:, :1], turns[:, 1:]
        by_leg[:, 3] = -2.0 * np.einsum("ij,ij->i", vector, moments)
        by_leg[:, 4:7] = 2.0 * (scalar * moments - cross(vector, moments))
        if placed.blocks is not None:
            by_leg[:, 7:] = 0.0
            maps = placed.blocks.maps[self._place]
            by_leg[self._sloped, 3:] = np.einsum("lki,lk->li", maps, pull[self._sloped])
        return np.asarray(np.add.reduceat(by_leg, self._first_leg, axis=0))

    def leg_maps(self, placed: Placed) -> Array:
        """Derivative of each leg's point after its node's coordinates, (legs, 3, width)."""
        maps = np.zeros((len(self.leg_point), 3, self.width))
        maps[:, range(3), range(3)] = self.leg_carries[:, None]
        arms = self.leg_share[:, None] * placed.arms[self.leg_point]
        maps[:, :, 3:7] = -skew(arms) @ placed.gyrations[self.leg_node]
        if placed.blocks is not None:
            maps[self._sloped, :, 3:] = placed.blocks.maps[self._place]
        return maps

    def turning(self, placed: Placed, forces: Array) -> tuple[Array, Array]:
        """Change of the generalised forces of constant forces on all points with the nodes' turns:
        of the moments arm x F by the pairs of ``turning_pairs``, where blocks on slope vectors
        stand as well, and of what moments do on each leg's own node, shape (pairs or legs,
        width - 3, width - 3).
        """
        pull, arms = forces[self.leg_point], placed.arms[self.leg_point]
        kernel = arms[:, :, None] * pull[:, None, :]
        kernel[:, range(3), range(3)] -= np.einsum("li,li->l", arms, pull)[:, None]
        gyrations = self.leg_share[:, None, None] * placed.gyrations[self.leg_node]
        carried = gyrations.transpose(0, 2, 1) @ kernel
        moments = self.leg_share[:, None] * cross(arms, pull)
        first, second = self.turning_pairs
        turned = self.width - 3
        pairs = np.zeros((len(first), turned, turned))
        own = np.zeros((len(moments), turned, turned))
        pairs[:, :4, :4] = carried[first] @ gyrations[second]
        own[:, 0, 1:4], own[:, 1:4, 0] = -2.0 * moments, 2.0 * moments
        own[:, 1:4, 1:4] = 2.0 * skew(moments)
        if placed.blocks is not None:
            side, block = np.zeros((2, len(moments)), dtype=np.int64)
            side[self._sloped], block[self._sloped] = self._place
            among = np.flatnonzero(np.isin(first, self._sloped))
            one, other = first[among], second[among]
            by_slopes = placed.blocks.turning(forces[self._block])
            pairs[among] = by_slopes[side[one], side[other], block[one]]
        return pairs, own

    @cached_property
    def turning_pairs(self) -> tuple[Indices, Indices]:
        """Pairs of legs of the same point: how a moment on one node turns with another."""
        # Ordered by point, so that entries of the Jacobian stand as they always have.
        by_point = [np.flatnonzero(self.leg_point == k) for k in range(len(self._carrier))]
        first = [np.repeat(legs, len(legs)) for legs in by_point]
        second = [np.tile(legs, len(legs)) for legs in by_point]
        return np.concatenate(first), np.concatenate(second)
