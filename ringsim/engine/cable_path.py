"""Where the cables run: points of their paths as functions of the nodes' coordinates.

A hinge pulley is a point fixed on a hinge assembly.  A V pulley stands on a block without mass
that a gear keeps on the bisector of the two bar halves: it is the point

    p = r - sense h b,   b = (y_L + y_R + sense (x_R - x_L)) / |...|,

r the V-joint, x and y the axes of the halves' frames, h the block's offset, sense +1 in the upper
plane and -1 in the lower.  Half the turn of each half turns the block, so a force F on the pulley
acts as F on the joint and as the moment arm x F shared evenly by the halves: the coupling is
exact and resists nothing.  Source: paper 000, fig. 3.

Nodes have Euler parameters; with rods of kind "ancf" those of the bar halves have slope vectors
instead, and blocks act on them as ``ringsim.engine.slope_blocks`` says.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.engine.rotations import Array, Indices, axes_of, cross, gyration, skew, spin
from ringsim.engine.slope_blocks import SLOPES, PlacedBlocks

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
