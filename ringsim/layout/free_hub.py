"""The net of an ideal ring: springs from the upper corners to a massless hub.

The hub lies where the springs' pulls balance, sum k_i s_i u_i = 0 (s_i the stretch, u_i the
direction from the hub): the least of a convex energy while they only pull.  The springs' work is
then that of the corners alone.  Where dampers act too, the hub is taken along as the corners
move, dx_hub = A^-1 sum A_i dx_i, A_i = k_i (u_i u_i^T + (s_i / L_i) (1 - u_i u_i^T)).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.net import Net
from ringsim.parts.persection import spread

Array = NDArray[np.float64]

_ONSET = 1e-4
"""Stretch in m over which the damping of a string comes in."""
_MOST = 60
_BALANCED = 1e-14
"""Pull on the hub over the largest string's, or its movement over the net's size, taken as zero."""


class NetForces(NamedTuple):
    """Generalised force of the net (N m), its energy (J) and the power lost in it (W)."""

    force: Array
    energy: float
    loss: float


class FreeHub:
    """Springs from so many corners to a free hub."""

    def __init__(self, net: Net, corners: int) -> None:
        self._net, self._stiffness = net, spread(net.stiffness, corners)

    def hub(self, corners: Array) -> Array:
        """Where the hub lies, shape (3,), m: in the middle while all strings are slack.

        Parameters
        ----------
        corners
            Upper corners, shape (corners, 3), m.
        """
        hub = corners.mean(axis=0)
        size = float(np.ptp(corners))
        for _ in range(_MOST):
            stretch, units, spring = self._strings(corners - hub)
            pull = spring @ units
            if np.abs(pull).max() <= _BALANCED * np.abs(spring).max():
                break
            step = np.linalg.lstsq(self._rates(stretch, units).sum(axis=0), pull, rcond=1e-9)[0]
            longest = float(np.abs(step).max())
            if longest > 0.1 * size:
                step *= 0.1 * size / longest
            hub = hub + step
            if longest < _BALANCED * size:
                break
        return np.asarray(hub)

    def energy(self, corners: Array) -> float:
        """Energy stored in the springs, J."""
        stretch, _, spring = self._strings(corners - self.hub(corners))
        return 0.5 * float(spring @ stretch)

    def forces(self, corners: Array, slopes: Array, rates: Array) -> NetForces:
        """Generalised forces on some coordinates.

        Parameters
        ----------
        corners, slopes
            Upper corners and their derivatives after the coordinates, shapes (corners, 3) and
            (corners, 3, coordinates), m and m/rad.
        rates
            Of the coordinates, rad/s.
        """
        stretch, units, spring = self._strings(corners - self.hub(corners))
        energy = 0.5 * float(spring @ stretch)
        longer = np.einsum("ia,iaj->ij", units, slopes)
        if self._net.damping == 0.0:
            return NetForces(-spring @ longer, energy, 0.0)
        matrices = self._rates(stretch, units)
        carried = np.einsum("iab,ibj->aj", matrices, slopes)
        hub = np.linalg.lstsq(matrices.sum(axis=0), carried, rcond=1e-9)[0]
        longer -= units @ hub
        damper = self._net.damping * (longer @ rates)
        if not self._net.two_sided:
            damper = np.maximum(damper * np.minimum(stretch / _ONSET, 1.0), -spring)
        loss = float(damper @ (longer @ rates))
        return NetForces(-(spring + damper) @ longer, energy, loss)

    def imbalance(self, corners: Array) -> float:
        """Pull on a hub in the middle over the sum of the strings' pulls."""
        arms = corners - corners.mean(axis=0)
        units = arms / np.linalg.norm(arms, axis=1)[:, None]
        return float(np.linalg.norm(self._stiffness @ units) / self._stiffness.sum())

    def _strings(self, arms: Array) -> tuple[Array, Array, Array]:
        lengths = np.linalg.norm(arms, axis=1)
        stretch = lengths - self._net.neutral_length
        if not self._net.two_sided:
            stretch = np.maximum(stretch, 0.0)
        units = arms / np.maximum(lengths, 1e-300)[:, None]
        return np.asarray(stretch), units, self._stiffness * stretch

    def _rates(self, stretch: Array, units: Array) -> Array:
        """The matrices A_i, shape (corners, 3, 3), N/m."""
        acting = self._stiffness * ((stretch > 0.0) | self._net.two_sided)
        along = units[:, :, None] * units[:, None, :]
        lengths = np.maximum(stretch + self._net.neutral_length, 1e-300)
        across = (self._stiffness * stretch / lengths)[:, None, None]
        return np.asarray(acting[:, None, None] * along + across * (np.eye(3) - along))
