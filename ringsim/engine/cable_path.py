"""Where the cables run: points of their paths as functions of the nodes' coordinates.

A hinge pulley is a point fixed on a hinge assembly.  A V pulley stands on a block without mass
that a gear keeps on the bisector of the two bar halves: it is the point

    p = r - sense h b,   b = (y_L + y_R + sense (x_R - x_L)) / |...|,

r the V-joint, x and y the axes of the halves' frames, h the block's offset, sense +1 in the upper
plane and -1 in the lower.  Half the turn of each half turns the block, so a force F on the pulley
acts as F on the joint and as the moment arm x F shared evenly by the halves: the coupling is
exact and resists nothing.  Source: paper 000, fig. 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly
from ringsim.engine.rotations import cross, first_axes, gyration, rotated, skew, spin
from ringsim.scene import Scene

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
WIDTH = 7
"""Coordinates of a node: position and Euler parameters."""


@dataclass(frozen=True)
class Placed:
    """All points of all paths at one instant.

    Attributes
    ----------
    points, velocities
        Shape (points, 3), m and m/s.
    arms
        From the carrying node's position to the point, global, shape (points, 3).
    turns, turn_rates
        Euler parameters of all nodes and their rates, shape (nodes, 4).
    turning
        Angular velocity of every arm, rad/s, shape (points, 3).
    """

    points: Array
    velocities: Array
    arms: Array
    turns: Array
    turn_rates: Array
    turning: Array

    @cached_property
    def gyrations(self) -> Array:
        """Angular velocity after the rates of the Euler parameters, shape (nodes, 3, 4)."""
        return gyration(self.turns)


class Carrier(Protocol):
    """What carries cables: the model of any structure."""

    @property
    def scene(self) -> Scene:
        """What the model was built from."""

    @property
    def assembly(self) -> Assembly:
        """The system under construction."""


@dataclass(frozen=True)
class FixedStop:
    """A point of a path that is fixed on a node's body, ``arm`` (m) from the node."""

    node: Any
    arm: Array


@dataclass(frozen=True)
class BlockStop:
    """A V pulley on its block between the nodes of two bar halves."""

    left: Any
    right: Any
    sense: float
    offset: float


Stop = FixedStop | BlockStop


class CablePath:
    """Points, velocities and generalised forces of the cables' paths.

    Attributes
    ----------
    nodes
        exudyn nodes whose coordinates the path depends on.
    per_cable
        Number of points of each cable.
    leg_point, leg_node, leg_share
        Every dependence of a point on a node, in the order of the nodes: the point, the node's
        place in ``nodes``, and the share of the node's turn that turns the point's arm.
    spots
        Place of each node's coordinates among those of all nodes behind one another, shape
        (nodes, width); -1 where a node has fewer.
    """

    width = WIDTH
    """Most coordinates of a node."""

    def __init__(self, paths: Sequence[Sequence[Stop]]) -> None:
        self._register: dict[int, int] = {}
        self.nodes: list[Any] = []
        hinge: list[tuple[int, int, Array]] = []
        block: list[tuple[int, int, int, float, float]] = []
        self.per_cable = [len(path) for path in paths]
        for count, stop in enumerate(stop for path in paths for stop in path):
            if isinstance(stop, BlockStop):
                left, right = self._number(stop.left), self._number(stop.right)
                block.append((count, left, right, stop.sense, stop.offset))
            else:
                hinge.append((count, self._number(stop.node), stop.arm))
        count = sum(self.per_cable)
        self.count = count
        self._hinge_point = np.array([h[0] for h in hinge], dtype=np.int64)
        self._hinge_node = np.array([h[1] for h in hinge], dtype=np.int64)
        self._hinge_arm = np.array([h[2] for h in hinge])
        self._block_point = np.array([b[0] for b in block], dtype=np.int64)
        self._left = np.array([b[1] for b in block], dtype=np.int64)
        self._right = np.array([b[2] for b in block], dtype=np.int64)
        self._halves = np.concatenate([self._left, self._right])
        self._sense = np.array([b[3] for b in block], dtype=float)[:, None]
        self._offset = np.array([b[4] for b in block], dtype=float)[:, None]
        self.leg_point = np.concatenate([self._hinge_point, self._block_point, self._block_point])
        self.leg_node = np.concatenate([self._hinge_node, self._left, self._right])
        ones = np.ones(len(hinge))
        halves = np.full(len(block), 0.5)
        self.leg_share = np.concatenate([ones, halves, halves])
        self.leg_carries = np.concatenate([ones, np.ones(len(block)), np.zeros(len(block))])
        self._order = order = np.argsort(self.leg_node, kind="stable")
        self.leg_point, self.leg_node = self.leg_point[order], self.leg_node[order]
        self.leg_share, self.leg_carries = self.leg_share[order], self.leg_carries[order]
        self._first_leg = np.searchsorted(self.leg_node, np.arange(len(self.nodes)))
        self._carrier = np.empty(count, dtype=np.int64)
        self._carrier[self._hinge_point] = self._hinge_node
        self._carrier[self._block_point] = self._left
        self._held = np.arange(self.width) < self._widths()[:, None]
        self.spots = np.where(self._held, np.cumsum(self._held).reshape(self._held.shape) - 1, -1)

    def _widths(self) -> Indices:
        """Coordinates of each node."""
        return np.full(len(self.nodes), WIDTH)

    @property
    def size(self) -> int:
        """Coordinates of all nodes."""
        return int(self._held.sum())

    def by_node(self, values: Array) -> Array:
        """Values of all coordinates, (size,), as (nodes, width); 0 where a node has fewer."""
        if self._held.all():
            return values.reshape(self._held.shape)
        found = np.zeros(self._held.shape, dtype=values.dtype)
        found[self._held] = values
        return found

    def in_a_row(self, values: Array) -> Array:
        """Values by node, (nodes, width), as (size,)."""
        return values[self._held]

    def place(self, coordinates: Array, rates: Array) -> Placed:
        """Points and velocities from the nodes' coordinates and rates, shape (nodes, width)."""
        turns = coordinates[:, 3:7]
        spins = spin(turns, rates[:, 3:7])
        arms, turning = np.empty((2, self.count, 3))
        arms[self._hinge_point] = rotated(turns[self._hinge_node], self._hinge_arm)
        turning[self._hinge_point] = spins[self._hinge_node]
        x, y = first_axes(turns[self._halves])
        count = len(self._left)
        bisector = y[:count] + y[count:] + self._sense * (x[count:] - x[:count])
        size = np.sqrt(np.einsum("ij,ij->i", bisector, bisector))
        arms[self._block_point] = (-self._sense * self._offset / size[:, None]) * bisector
        turning[self._block_point] = 0.5 * (spins[self._left] + spins[self._right])
        points = coordinates[self._carrier, :3] + arms
        velocities = rates[self._carrier, :3] + cross(turning, arms)
        return Placed(points, velocities, arms, turns, rates[:, 3:7], turning)

    def generalised(self, placed: Placed, forces: Array) -> Array:
        """Generalised forces on the nodes' coordinates, (nodes, width), of point forces."""
        pull = forces[self.leg_point]
        moments = self.leg_share[:, None] * cross(placed.arms[self.leg_point], pull)
        by_leg = np.empty((len(pull), WIDTH))
        by_leg[:, :3] = self.leg_carries[:, None] * pull
        turns = placed.turns[self.leg_node]
        scalar, vector = turns[:, :1], turns[:, 1:]
        by_leg[:, 3] = -2.0 * np.einsum("ij,ij->i", vector, moments)
        by_leg[:, 4:] = 2.0 * (scalar * moments - cross(vector, moments))
        return np.asarray(np.add.reduceat(by_leg, self._first_leg, axis=0))

    def leg_maps(self, placed: Placed) -> Array:
        """Derivative of each leg's point after its node's coordinates, (legs, 3, width)."""
        maps = np.zeros((len(self.leg_point), 3, WIDTH))
        maps[:, range(3), range(3)] = self.leg_carries[:, None]
        arms = self.leg_share[:, None] * placed.arms[self.leg_point]
        maps[:, :, 3:] = -skew(arms) @ placed.gyrations[self.leg_node]
        return maps

    def leg_swings(self, placed: Placed) -> Array:
        """Derivative of each leg's velocity after its node's coordinates at fixed rates.

        With w = G(q) q_dot = -G(q_dot) q, w turns and carries the arm: dv = dw x arm + w x darm.
        Shape (legs, 3, width), 1/s.
        """
        swings = np.zeros((len(self.leg_point), 3, WIDTH))
        arms = skew(self.leg_share[:, None] * placed.arms[self.leg_point])
        turning = skew(placed.turning[self.leg_point])
        carried = turning @ arms @ placed.gyrations[self.leg_node]
        swings[:, :, 3:] = arms @ gyration(placed.turn_rates[self.leg_node]) - carried
        return swings

    def turning(self, placed: Placed, forces: Array) -> tuple[Array, Array]:
        """Change of the generalised forces of constant point forces with the nodes' turns.

        Parameters
        ----------
        forces
            On all points, N, shape (points, 3).

        Returns
        -------
        tuple of Array
            Derivatives of the moments arm x F by the pairs of ``turning_pairs``, and of what
            moments do on each leg's own node, shape (pairs or legs, width - 3, width - 3).
        """
        pull, arms = forces[self.leg_point], placed.arms[self.leg_point]
        along = np.einsum("li,li->l", arms, pull)
        kernel = arms[:, :, None] * pull[:, None, :]
        kernel[:, range(3), range(3)] -= along[:, None]
        gyrations = self.leg_share[:, None, None] * placed.gyrations[self.leg_node]
        carried = gyrations.transpose(0, 2, 1) @ kernel
        first, second = self.turning_pairs
        moments = self.leg_share[:, None] * cross(arms, pull)
        own = np.zeros((len(moments), 4, 4))
        own[:, 0, 1:], own[:, 1:, 0] = -2.0 * moments, 2.0 * moments
        own[:, 1:, 1:] = 2.0 * skew(moments)
        return carried[first] @ gyrations[second], own

    @cached_property
    def turning_pairs(self) -> tuple[Indices, Indices]:
        """Pairs of legs of the same point: how a moment on one node turns with another."""
        first, second = [], []
        for point in range(self.count):
            own = np.flatnonzero(self.leg_point == point)
            for a in own:
                for b in own:
                    first.append(a)
                    second.append(b)
        return np.array(first), np.array(second)

    def _number(self, node: Any) -> int:
        key = int(node)
        if key not in self._register:
            self._register[key] = len(self.nodes)
            self.nodes.append(node)
        return self._register[key]
