"""The net of an ideal ring: springs from the upper corners to a massless hub.

The hub lies where the springs' pulls balance, sum k_i s_i u_i = 0 (s_i the stretch, u_i the
direction from the hub): the least of a convex energy while they only pull, found by Newton's
method with A_i = k_i (u_i u_i^T + (s_i / L_i) (1 - u_i u_i^T)), the pulls' derivatives after its
place.  The springs' work is then that of the corners alone.
"""

from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array
from ringsim.parts.net.hub import SpringNet
from ringsim.parts.persection import at_section, spread
from ringsim.parts.springs import Reaction

_MOST = 60
"""Newton steps to the hub, each a tenth of the net's size long at most."""
_BALANCED = 1e-14
"""Pull on the hub over the largest string's, or its movement over the net's size, taken as zero."""


class NetForce(NamedTuple):
    """Generalised force of a net at rest on a coordinate (N m), and its energy (J)."""

    force: float
    energy: float


class FreeHub:
    """Springs from so many corners to a free hub; ``corners`` have the shape (corners, 3), m."""

    def __init__(self, net: SpringNet, corners: int) -> None:
        self._net = at_section(net, np.arange(corners))
        self._stiffness = spread(net.stiffness, corners)

    def hub(self, corners: Array) -> Array:
        """Where it lies, shape (3,), m: midway while all is slack."""
        return self._balance(corners)[0]

    def force(self, corners: Array, slopes: Array) -> NetForce:
        """On a coordinate after which ``slopes`` are the corners' derivatives, shape (corners, 3),
        m/rad.
        """
        _, _, units, still = self._balance(corners)
        longer = np.sum(units * slopes, axis=1)
        # A difference, not a negative: a slack net pulls with 0, not -0.
        return NetForce(0.0 - float(still.elastic @ longer), float(np.sum(still.stored)))

    def _balance(self, corners: Array) -> tuple[Array, Array, Array, Reaction]:
        """The hub, and the strings' lengths, directions and reaction at rest there."""
        hub, size, moved = corners.mean(axis=0), float(np.ptp(corners)), np.inf
        for _ in range(_MOST):
            arms = corners - hub
            lengths = np.maximum(np.linalg.norm(arms, axis=1), 1e-300)
            units = arms / lengths[:, None]
            still = self._net.tension(lengths - self._net.neutral_length, 0.0)
            pull = still.elastic @ units
            balanced = np.abs(pull).max() <= _BALANCED * np.abs(still.elastic).max()
            if balanced or moved < _BALANCED * size:
                break
            matrix = self._rates(lengths, units, still).sum(axis=0)
            step = np.linalg.lstsq(matrix, pull, rcond=1e-9)[0]
            moved = float(np.abs(step).max())
            hub = hub + (step if moved <= 0.1 * size else step * (0.1 * size / moved))
        return hub, lengths, units, still

    def _rates(self, lengths: Array, units: Array, still: Reaction) -> Array:
        """The matrices A_i, shape (corners, 3, 3), N/m."""
        acting = self._stiffness * ((still.elastic > 0.0) | self._net.two_sided)
        along = units[:, :, None] * units[:, None, :]
        across = (still.elastic / lengths)[:, None, None]
        return np.asarray(acting[:, None, None] * along + across * (np.eye(3) - along))
