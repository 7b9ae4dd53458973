"""Derivatives of the cable's forces after positions and velocities of its points.

Every span pulls with f_i = T_i u_i, so with the differences D x = x_i+1 - x_i of the points

    F = -D^T f,   dF = -D^T (u_i dT_i + T_i (I - u_i u_i^T) / L_i D dx).

The second part is the geometric tangent (paper 001), block by block on the spans.  For the
first, T_i = q c_i / cbar with cbar = sum c_k L_k / S, and weights omega_k = c_k L_k / sum c L:

    dT_i = (c_i / cbar) dq                                                       material
         + T_i (dln c_i - sum_k omega_k (dln c_k + dL_k / L_k) + dS / S)         decay

    dq = q'(y) EA (dS / M + t_d (w dS / M^2 + d(dS/dt) / M)),
    dln c_i = sum_{j <= i} (p_j dln eta_j/da da_j + ln eta_j (1 - p_j^2) / s_slip ds_j).

L_i, dL_i/dt, a_j and s_j depend on neighbouring points alone, so everything is written on the
differences of points: no product of full matrices is formed.

Where the rope runs straight over a pulley the angle has a kink (the wrap angle cannot be
negative); its derivative is taken as zero there, the mean of both sides.
"""

from dataclasses import dataclass

import numpy as np

from ringsim.cable import slack
from ringsim.cable.ropes import Array
from ringsim.cable.state import ChainState

STRAIGHT = 1e-7
"""Sine of the angle between the pulls below which its derivative is taken as zero: far above the
rounding of unit vectors (1e-16), far below the angles of any path that bends."""


@dataclass(frozen=True)
class RopeTangent:
    """Derivatives of the tensions in one rope of n spans after the differences of its points."""

    spans: slice
    """The rope's spans among those of all cables."""
    mean_by_place: Array
    mean_by_velocity: Array
    """Of the mean tension (the material part), N/m and N s/m, shape (n, 3)."""
    by_direction: Array
    """T_i (I - u_i u_i^T) / L_i of each span, in N/m, shape (n, 3, 3)."""
    swing: Array
    """Of the rates of length at fixed velocities, 1/s, shape (n, 3)."""


def rope_tangent(state: ChainState, velocities: Array, rope: int) -> RopeTangent:
    """The tangent of one rope as if the shares of its spans stayed as they are.

    The velocities are those that the state was evaluated with, in m/s, shape (points, 3).
    """
    ropes, (stiffness, damping_time, slack_width) = state.ropes, state.material[:, rope]
    spans = slice(int(ropes.starts[rope]), int(ropes.ends[rope]))
    unit, length = state.directions[spans], state.lengths[spans]
    relative = velocities[ropes.near[spans] + 1] - velocities[ropes.near[spans]]
    swing = (relative - unit * state.rates[spans, None]) / length[:, None]
    across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    natural = state.natural[rope]
    elastic = stiffness / natural * ropes.alive[rope]
    elastic *= slack.slope(state.forces[rope], slack_width)
    viscous = elastic * damping_time
    stretched = elastic + viscous * state.wound_rates[rope] / natural
    return RopeTangent(
        spans=spans,
        mean_by_place=stretched * unit + viscous * swing,
        mean_by_velocity=viscous * unit,
        by_direction=(state.tensions[spans] / length)[:, None, None] * across,
        swing=swing,
    )


def decay_tangent(
    state: ChainState, tangent: RopeTangent, rope: int, slopes: Array
) -> tuple[Array, Array]:
    """The decay part of one rope: how the shares of its spans change.

    Derivatives of each span's tension after each difference of points (N/m) and of velocities
    (N s/m), shape (n, n, 3) each; ``slopes`` are those of the pulleys' exponents after the rope's
    speed, in s/m, shape (pulleys,).
    """
    tensions, by_place, by_velocity = decay_factors(state, tangent, rope, slopes)
    both = np.stack([by_place, by_velocity]).reshape(2, len(by_place), -1)
    decay, drag = (tensions @ both).reshape(2, len(tensions), *by_place.shape[1:])
    return decay, drag


def decay_factors(
    state: ChainState, tangent: RopeTangent, rope: int, slopes: Array
) -> tuple[Array, Array, Array]:
    """The decay part of one rope in factors: changes of tension (N) with the logarithms of the
    decays at its pulleys and, last, with that of the path, shape (n, k), and derivatives of these
    logarithms after differences of points (1/m) and of velocities (s/m), shape (k, n, 3) each.
    """
    spans, inner = tangent.spans, state.ropes.inner(rope)
    length, rate, unit = state.lengths[spans], state.rates[spans], state.directions[spans]
    path, path_rate = float(state.paths[rope]), float(state.path_rates[rope])
    ratio = float(state.natural[rope]) / path
    share, tension, count = state.shares[spans], state.tensions[spans], len(length)
    beyond = (np.arange(count) >= np.arange(1, count)[:, None]).astype(float)
    part, part_rate = beyond @ length / path, beyond @ rate
    beyond_less_part = beyond - part[:, None]

    # Each pulley's p ln(eta) after the differences, shape (pulleys, spans, 3).
    exponent = state.exponents[inner]
    sensitivity = state.log_decays[inner] * slopes[inner]
    steadily = float(state.wound_rates[rope]) + ratio * path_rate
    by_length = (sensitivity * (steadily / path))[:, None] * beyond_less_part
    by_length += (sensitivity * (ratio / path) * (part_rate - part * path_rate))[:, None]
    by_rate = (-ratio * sensitivity)[:, None] * beyond_less_part
    by_place = by_length[:, :, None] * unit
    by_place += by_rate[:, :, None] * tangent.swing
    before, behind = _angle_gradients(unit, length)
    turned = (exponent * state.friction_slopes()[inner])[:, None]
    pulley = np.arange(count - 1)
    by_place[pulley, pulley] += turned * before
    by_place[pulley, pulley + 1] += turned * behind

    # ln(c_i) - sum omega_k ln(c_k) after those logarithms, shape (spans, pulleys).
    spread = beyond.T - (share * length / path)[::-1].cumsum()[::-1][1:]
    logs = np.column_stack([tension[:, None] * spread, tension])
    stretch = ((1.0 - share) / path)[:, None] * unit
    by_place = np.concatenate([by_place, stretch[None]])
    by_velocity = np.concatenate([by_rate[:, :, None] * unit, np.zeros((1, *unit.shape))])
    return logs, by_place, by_velocity


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
