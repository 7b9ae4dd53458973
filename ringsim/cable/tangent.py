"""Derivatives of the cable's forces after positions and velocities of its points.

Every span pulls with f_i = T_i u_i, so with the differences D x = x_i+1 - x_i of the points

    F = -D^T f,   dF = -D^T (u_i dT_i + T_i (I - u_i u_i^T) / L_i D dx).

The second part is the geometric tangent (paper 001), block by block on the spans.  For the
first, T_i = q c_i / cbar with cbar = sum c_k L_k / S, and weights omega_k = c_k L_k / sum c L:

    dT_i = (c_i / cbar) dq                                                       material
         + T_i (dln c_i - sum_k omega_k (dln c_k + dL_k / L_k) + dS / S)         decay

    dq = q'(y) EA (dS / M + t_d (w dS / M^2 + d(dS/dt) / M)),
    dln c_i = sum_{j <= i} (p_j dln eta_j/da da_j + ln eta_j (1 - p_j^2) / s_slip ds_j).

For a taut rope at full friction the material part is the rank-one matrix
-(EA S / (M sum c_k L_k)) (sum c_k grad L_k) (sum grad L_k)^T, and without friction it is
symmetric.  L_i, dL_i/dt, a_j and s_j depend on neighbouring points alone, so everything is
written on the differences of points: no product of full matrices is formed.

Where the rope runs straight over a pulley the angle has a kink (the wrap angle cannot be
negative); its derivative is taken as zero there, the mean of both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.cable import slack
from ringsim.cable.state import ChainState

Array = NDArray[np.float64]

STRAIGHT = 1e-7
"""Sine of the angle between the pulls below which its derivative is taken as zero."""


@dataclass(frozen=True)
class RopeTangent:
    """Derivatives of the forces on the p points of one rope of n = p - 1 spans.

    Matrices have the shape (3 p, 3 p), ordered x, y, z of the first point first.

    Attributes
    ----------
    points
        The rope's points among those of all cables.
    directions
        Unit vectors of its spans, shape (n, 3).
    by_mean, by_share, by_velocity
        Derivatives of each span's tension after each difference of points, shape (n, n, 3):
        through the mean tension (N/m), through its distribution (N/m), and after the
        difference of velocities (N s/m).
    by_direction
        T_i (I - u_i u_i^T) / L_i of each span, in N/m, shape (n, 3, 3).

    """

    points: slice
    directions: Array
    by_mean: Array
    by_share: Array
    by_velocity: Array
    by_direction: Array

    @property
    def material(self) -> Array:
        """Part of dF/dx by the mean tension, in N/m."""
        return self._assembled(self.by_mean)

    @property
    def decay(self) -> Array:
        """Part of dF/dx by the distribution of tension over the spans, in N/m."""
        return self._assembled(self.by_share)

    @property
    def geometric(self) -> Array:
        """Part of dF/dx by the directions of the spans, in N/m."""
        return self._assembled(None, self.by_direction)

    @property
    def stiffness(self) -> Array:
        """The whole dF/dx, in N/m."""
        return self._assembled(self.by_mean + self.by_share, self.by_direction)

    @property
    def damping(self) -> Array:
        """dF/dv, in N s/m: Kelvin-Voigt damping and the regularised friction."""
        return self._assembled(self.by_velocity)

    def _assembled(self, by_difference: Array | None, by_direction: Array | None = None) -> Array:
        """-D^T (u_i times the tension's derivatives, and the directions' part) D."""
        count = len(self.directions)
        rows = np.zeros((count + 1, 3, count + 1, 3))
        if by_difference is not None:
            by_point = np.zeros((count, count + 1, 3))
            by_point[:, 1:] = by_difference
            by_point[:, :-1] -= by_difference
            np.multiply(self.directions[:, :, None, None], by_point[:, None, :, :], out=rows[:-1])
            rows[1:] -= self.directions[:, :, None, None] * by_point[:, None, :, :]
        if by_direction is not None:
            near, far = np.arange(count), np.arange(1, count + 1)
            for one, other, sign in (
                (near, near, -1),
                (far, far, -1),
                (near, far, 1),
                (far, near, 1),
            ):
                rows[one, :, other, :] += sign * by_direction
        return rows.reshape(3 * count + 3, 3 * count + 3)


def tangents(state: ChainState, velocities: Array) -> list[RopeTangent]:
    """Tangents of all ropes; forces on a point that two ropes share add up.

    Parameters
    ----------
    state
        The chain at the instant wanted.
    velocities
        The velocities that it was evaluated with, in m/s, shape (points, 3).

    """
    return [rope_tangent(state, velocities, k) for k in range(len(state.natural))]


def mean_tangent(state: ChainState, velocities: Array, rope: int) -> tuple[Array, Array]:
    """What is left of a rope's tangent if the shares of its spans stay as they are.

    Returns
    -------
    tuple
        Derivatives of the rope's mean tension after the differences of its points, shape (n, 3),
        N/m, and T_i (I - u_i u_i^T) / L_i of its spans, shape (n, 3, 3), N/m.

    """
    ropes = state.ropes
    spans = slice(int(ropes.starts[rope]), int(ropes.ends[rope]))
    first = int(ropes.near[spans.start])
    unit, length = state.directions[spans], state.lengths[spans]
    natural = float(state.natural[rope])
    elastic, viscous = _mean_slopes(state, rope)
    relative = np.diff(velocities[first : first + len(unit) + 1], axis=0)
    swing = (relative - unit * state.rates[spans, None]) / length[:, None]
    across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    stretched = elastic + viscous * float(state.wound_rates[rope]) / natural
    scale = (state.tensions[spans] / length)[:, None, None]
    return stretched * unit + viscous * swing, scale * across


def _mean_slopes(state: ChainState, rope: int) -> tuple[float, float]:
    """Derivatives of a rope's mean tension after its path (N/m) and its rate (N s/m)."""
    stiffness = float(state.material.axial_stiffness[rope]) / float(state.natural[rope])
    stiffness *= bool(state.ropes.alive[rope]) * float(
        slack.slope(state.forces[rope], state.material.slack_width[rope])
    )
    return stiffness, stiffness * float(state.material.damping_time[rope])


def rope_tangent(state: ChainState, velocities: Array, rope: int) -> RopeTangent:
    """The tangent of one rope; see ``tangents``."""
    ropes = state.ropes
    spans = slice(int(ropes.starts[rope]), int(ropes.ends[rope]))
    first = int(ropes.near[spans.start])
    points = slice(first, first + spans.stop - spans.start + 1)
    inner = (ropes.of_pulley == rope) & (ropes.slips > 0.0)
    length, unit = state.lengths[spans], state.directions[spans]
    share, tension = state.shares[spans], state.tensions[spans]
    path, natural = float(state.paths[rope]), float(state.natural[rope])
    # How the unit vectors, and with them the rates of length, follow the differences of points.
    relative = np.diff(velocities[points], axis=0)
    swing = (relative - unit * state.rates[spans, None]) / length[:, None]
    projector = (np.eye(3) - unit[:, :, None] * unit[:, None, :]) / length[:, None, None]

    stiffness, viscous = _mean_slopes(state, rope)
    elastic = stiffness + viscous * float(state.wound_rates[rope]) / natural
    material = share[:, None, None] * (elastic * unit + viscous * swing)

    spread, by_place, by_velocity = _distribution(state, spans, inner, rope, swing)
    flat = (tension[:, None] * spread) @ np.stack([by_place, by_velocity]).reshape(2, -1, unit.size)
    decay, drag = flat.reshape(2, len(unit), *unit.shape)
    decay += tension[:, None, None] * (((1.0 - share) / path)[:, None] * unit)
    return RopeTangent(
        points=points,
        directions=unit,
        by_mean=material,
        by_share=decay,
        by_velocity=share[:, None, None] * (viscous * unit) + drag,
        by_direction=tension[:, None, None] * projector,
    )


def _distribution(
    state: ChainState, spans: slice, inner: NDArray[np.bool_], rope: int, swing: Array
) -> tuple[Array, Array, Array]:
    """Derivatives of ln(c_i) - sum omega_k ln(c_k) as a product: spread (spans, pulleys) times
    the derivatives of each pulley's logarithm after the differences of points (1/m) and after
    those of velocities (s/m), shape (pulleys, spans, 3) each.
    """
    length, rate, unit = state.lengths[spans], state.rates[spans], state.directions[spans]
    path, path_rate = float(state.paths[rope]), float(state.path_rates[rope])
    ratio = float(state.natural[rope]) / path
    weight = state.shares[spans] * length / path
    count = len(length)
    beyond = (np.arange(count) >= np.arange(1, count)[:, None]).astype(float)
    share, share_rate = beyond @ length / path, beyond @ rate
    beyond_less_share = beyond - share[:, None]

    exponent = state.exponents[inner]
    sensitivity = state.log_decays[inner] * (1.0 - exponent**2) / state.slip_speeds[inner]
    steadily = float(state.wound_rates[rope]) + ratio * path_rate
    by_length = (sensitivity * (steadily / path))[:, None] * beyond_less_share
    by_length += (sensitivity * (ratio / path) * (share_rate - share * path_rate))[:, None]
    by_rate = (-ratio * sensitivity)[:, None] * beyond_less_share

    by_place = by_length[:, :, None] * unit
    by_place += by_rate[:, :, None] * swing
    before, behind = _angle_gradients(unit, length)
    turned = (exponent * state.friction_slopes()[inner])[:, None]
    pulley = np.arange(count - 1)
    by_place[pulley, pulley] += turned * before
    by_place[pulley, pulley + 1] += turned * behind
    remaining = weight[::-1].cumsum()[::-1][1:]
    return beyond.T - remaining, by_place, by_rate[:, :, None] * unit


def _angle_gradients(unit: Array, length: Array) -> tuple[Array, Array]:
    """Gradients of the angles after the differences of points, shape (pulleys, 3) each.

    cos a = -u_before . u_behind, hence sin a da = du_before . u_behind + u_before . du_behind.
    """
    before, behind = unit[:-1], unit[1:]
    cosine = np.einsum("ij,ij->i", before, behind)[:, None]
    aside = behind - cosine * before
    sine = np.sqrt(np.einsum("ij,ij->i", aside, aside))[:, None]
    scale = np.where(sine > STRAIGHT, 1.0 / np.maximum(sine, STRAIGHT), 0.0)
    return (
        scale * aside / length[:-1, None],
        scale * (before - cosine * behind) / length[1:, None],
    )
