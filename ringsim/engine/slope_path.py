"""Paths of cables whose V pulleys stand between nodes with slope vectors (rods.kind = "ancf").

Hinge assemblies keep their Euler parameters, seven coordinates; the halves of the V-joints have
nine, see ``ringsim.engine.slope_blocks``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.cable_path import WIDTH, CablePath, Placed, Stop
from ringsim.engine.rotations import cross, gyration, rotated, skew, spin
from ringsim.engine.slope_blocks import SLOPES, SlopeBlocks, SlopePlaced

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class SlopesPlaced(Placed):
    """The same with the blocks on slope vectors; ``turning`` of their points is not used."""

    blocks: SlopePlaced


class SlopePath(CablePath):
    """Points, velocities and generalised forces with blocks on slope vectors."""

    width = 3 + SLOPES

    def __init__(self, paths: Sequence[Sequence[Stop]]) -> None:
        super().__init__(paths)
        self._blocks = SlopeBlocks(self._left, self._right, self._sense, self._offset)
        hinges, count = len(self._hinge_point), len(self._left)
        on_block = self._order >= hinges
        self._slope_legs = np.flatnonzero(on_block)
        self._hinge_legs = np.flatnonzero(~on_block)
        number = self._order[on_block] - hinges
        self._side, self._block = number // count, number % count

    def _widths(self) -> Indices:
        widths = np.full(len(self.nodes), WIDTH)
        widths[self._halves] = self.width
        return widths

    def place(self, coordinates: Array, rates: Array) -> SlopesPlaced:
        """See ``CablePath``."""
        turns, turn_rates = coordinates[:, 3:7], rates[:, 3:7]
        blocks = self._blocks.place(coordinates, rates)
        spins = spin(turns, turn_rates)
        arms, moving = np.empty((2, self.count, 3))
        hinge, node = self._hinge_point, self._hinge_node
        turning = np.zeros((self.count, 3))
        turning[hinge] = spins[node]
        arms[hinge] = rotated(turns[node], self._hinge_arm)
        moving[hinge] = cross(spins[node], arms[hinge])
        arms[self._block_point], moving[self._block_point] = blocks.arms, blocks.arm_rates
        return SlopesPlaced(
            coordinates[self._carrier, :3] + arms,
            rates[self._carrier, :3] + moving,
            arms,
            turns,
            turn_rates,
            turning,
            blocks,
        )

    def generalised(self, placed: Placed, forces: Array) -> Array:
        """See ``CablePath``."""
        maps = self.leg_maps(placed)
        by_leg = np.einsum("lki,lk->li", maps, forces[self.leg_point])
        return np.asarray(np.add.reduceat(by_leg, self._first_leg, axis=0))

    def leg_maps(self, placed: Placed) -> Array:
        """See ``CablePath``."""
        maps = np.zeros((len(self.leg_point), 3, self.width))
        maps[:, range(3), range(3)] = self.leg_carries[:, None]
        hinge, node = self._hinge_legs, self.leg_node[self._hinge_legs]
        arms = skew(placed.arms[self.leg_point[hinge]])
        maps[hinge, :, 3:WIDTH] = -arms @ placed.gyrations[node]
        by_side = np.array(cast(SlopesPlaced, placed).blocks.maps)
        maps[self._slope_legs, :, 3:] = by_side[self._side, self._block]
        return maps

    def leg_swings(self, placed: Placed) -> Array:
        """See ``CablePath``."""
        swings = np.zeros((len(self.leg_point), 3, self.width))
        hinge, node = self._hinge_legs, self.leg_node[self._hinge_legs]
        arms = skew(placed.arms[self.leg_point[hinge]])
        carried = skew(placed.turning[self.leg_point[hinge]]) @ arms @ placed.gyrations[node]
        swings[hinge, :, 3:WIDTH] = arms @ gyration(placed.turn_rates[node]) - carried
        by_side = np.array(cast(SlopesPlaced, placed).blocks.swings())
        swings[self._slope_legs, :, 3:] = by_side[self._side, self._block]
        return swings

    def turning(self, placed: Placed, forces: Array) -> tuple[Array, Array]:
        """See ``CablePath``; what the slopes of a block do stands among the pairs."""
        first, second = self.turning_pairs
        pairs = np.zeros((len(first), SLOPES, SLOPES))
        own = np.zeros((len(self.leg_point), SLOPES, SLOPES))
        hinge = self._hinge_legs
        pull, arms = forces[self.leg_point[hinge]], placed.arms[self.leg_point[hinge]]
        kernel = arms[:, :, None] * pull[:, None, :]
        kernel[:, range(3), range(3)] -= np.einsum("li,li->l", arms, pull)[:, None]
        turned = placed.gyrations[self.leg_node[hinge]]
        alone = np.flatnonzero(np.isin(first, hinge))
        by_leg = np.zeros((len(self.leg_point), 4, 4))
        by_leg[hinge] = turned.transpose(0, 2, 1) @ kernel @ turned
        pairs[alone, :4, :4] = by_leg[first[alone]]
        moments = cross(arms, pull)
        own[hinge, 0, 1:4], own[hinge, 1:4, 0] = -2.0 * moments, 2.0 * moments
        own[hinge, 1:4, 1:4] = 2.0 * skew(moments)
        blocks = cast(SlopesPlaced, placed).blocks
        second_order = np.array(blocks.turning(forces[self._block_point]))
        side, block = np.full((2, len(self.leg_point)), -1)
        side[self._slope_legs], block[self._slope_legs] = self._side, self._block
        among = np.flatnonzero(np.isin(first, self._slope_legs))
        pairs[among] = second_order[side[first[among]], side[second[among]], block[first[among]]]
        return pairs, own
