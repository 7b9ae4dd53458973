"""The state of the tension chain: what its ropes, pulleys and winches tell."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ringsim.cable.friction import LEAST_TENSION, Friction, Pulleys
from ringsim.cable.ropes import CHAIN_PARTS, Array, Flags, Ropes

# The chain at one instant: tensions, forces, powers.


ROUNDED = 1e-12
"""Share of its length by which a rope is longer than its path before it counts as slack: one that
begins as long as its path is off by 1e-15, as lengths of points in another order are summed."""


class _Part:
    """What one of ``CHAIN_PARTS`` is at an instant, shape (spans,), (pulleys,), (ropes,) or
    (cables, 2); of many instants at once these are the first axis.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._each = name, CHAIN_PARTS[name][1]

    def __get__(self, state: "ChainState", owner: type) -> Array:
        found = state.numbers[..., state.ropes.places[self._name]]
        return found if self._each == 1 else found.reshape(*found.shape[:-1], -1, self._each)


@dataclass(frozen=True)
class ChainState:
    """All spans, pulleys and ropes at one instant, or at many; see ``ringsim.core.tension``."""

    ropes: Ropes
    table: Any
    """The same as the core takes it (``ringsim.core.tension.RopeTable``)."""
    friction: Friction
    """The laws of ``log_decays``, and their derivatives, which forces do not need."""
    numbers: Array
    """All that follows, in a row."""
    lengths, rates = _Part(), _Part()
    """Length of each span (m) and its rate (m/s)."""
    directions = _Part()
    """Unit vectors away from the winch, shape (spans, 3)."""
    angles, log_decays = _Part(), _Part()
    """Angle between the two pulls on each pulley (rad); logarithm of the full decay there."""
    speeds = _Part()
    """Rope over each pulley (m/s, towards the winch positive)."""
    exponents = _Part()
    """Share and direction of the full decay, tanh(speed / slip speed)."""
    shares, tensions = _Part(), _Part()
    """Tension of each span over its rope's mean tension, and in N."""
    paths, path_rates = _Part(), _Part()
    """Path length of each rope (m) and its rate (m/s)."""
    natural, wound_rates = _Part(), _Part()
    """Natural length of each rope (m) and what its winches take up (m/s)."""
    strains, strain_rates = _Part(), _Part()
    """Mean strain of each rope, (path - natural) / natural as of paper 001's element, and its
    rate in 1/s."""
    forces = _Part()
    """Elastic and viscous force of each rope before smoothing (N)."""
    mean_tensions, viscous_forces = _Part(), _Part()
    """Mean tension of each rope, weighted by length, and the viscous part of it (N)."""
    energy_density = _Part()
    """Elastic energy of each rope per natural length, in J/m."""
    friction_forces = _Part()
    """Loss of tension over each pulley times the stretch there, in N."""
    held_beyond = _Part()
    """Natural length from each pulley to its rope's far end, m."""
    wound, wound_rate = _Part(), _Part()
    """Of the winches at both ends of each cable, m and m/s."""

    @property
    def material(self) -> Array:
        """EA (N), Kelvin-Voigt time (s) and slack width (N) of each rope, shape (3, ropes)."""
        return np.asarray(self.table.material.T)

    @property
    def slip_speeds(self) -> Array:
        """Speed that regularises the exponents (m/s), shape (pulleys,)."""
        return np.asarray(self.table.slip_speed)

    @property
    def exponent_slopes(self) -> Array:
        """Derivative of the exponents after the speeds, s/m, shape (pulleys,)."""
        return np.asarray((1.0 - self.exponents**2) / self.slip_speeds)

    @property
    def pulley_tensions(self) -> Array:
        """Mean of both sides of each pulley, N, shape (pulleys,), as friction laws see it."""
        return pulley_tensions(self.ropes, self.tensions)

    @cached_property
    def pulleys(self) -> Pulleys:
        """What friction laws see."""
        return Pulleys(self.angles, np.abs(self.speeds), self.pulley_tensions)

    @cached_property
    def is_slack(self) -> Flags:
        """Whether a rope is longer than its path, or cut; shape (ropes,)."""
        longer = self.natural - self.paths > ROUNDED * self.natural
        return np.asarray(longer | ~self.ropes.alive)

    @cached_property
    def winch_tensions(self) -> Array:
        """Tension at both ends of each cable, in N, shape (cables, 2)."""
        edge, tensions = self.ropes.cable_starts, self.tensions
        return np.stack([tensions[..., edge[:-1]], tensions[..., edge[1:] - 1]], axis=-1)

    @property
    def point_forces(self) -> Array:
        """T_behind u_behind - T_before u_before on each point of the paths, N, (points, 3)."""
        pull = self.tensions[:, None] * self.directions
        forces = np.zeros((self.ropes.spans + len(self.ropes.points_per_cable), 3))
        forces[self.ropes.near] = pull
        forces[self.ropes.near + 1] -= pull
        return forces

    @property
    def stored(self) -> Array:
        """Natural length in each span, in metre: stretch goes with tension, slack evenly."""
        rope = self.ropes.of_span
        stretch = (self.paths - self.natural) / self.paths
        taut, loose = np.maximum(stretch, 0.0), np.minimum(stretch, 0.0)
        return np.asarray(self.lengths * (1.0 - taut[rope] * self.shares - loose[rope]))

    @property
    def elastic_energy(self) -> Array:
        """Elastic energy of each rope, in J, shape (ropes,)."""
        return self.energy_density * self.natural


def pulley_tensions(ropes: Ropes, tensions: Array) -> Array:
    """Mean of both sides of each pulley, N, shape (pulleys,); see ``Pulleys``."""
    behind = ropes.behind
    return np.maximum(0.5 * (tensions[behind - 1] + tensions[behind]), LEAST_TENSION)
