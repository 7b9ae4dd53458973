"""The law of the ropes, for both engines: tensions of all spans, and how they change."""

from typing import NamedTuple

import numpy as np

from ringsim.cable.ropes import Array, Indices, Ropes
from ringsim.core.library import call

# The tension chain of all cables, from positions and velocities of their pulleys (ropes.c).
#
# Spans i = 0 .. n-1 run from the winch to the far end, pulley j = 1 .. n-1 stands between spans
# j-1 and j.  For each rope (metre, newton, second):
#
# Geometry.  L_i and u_i (away from the winch) from the points; the angle between the pulls -u_j-1
# and u_j is a_j = 2 atan2(\|u_j-1 + u_j\|, \|u_j - u_j-1\|), exact near 0 and pi.
#
# Stretch.  S = sum L_i, natural length M = content - wound (of a parted rope the content: its winch
# winds what holds nothing), mean strain e = (S - M) / M (paper
# 001's element).  Mean tension q = b ln(1 + exp(y / b)) with y = EA (e + t_d de/dt): smooth in
# slack; de/dt = (dS/dt + (S / M) w) / M with w the rate of winding.  Above y = 10 b the tension
# exceeds y by less than 5e-5 b, below y = -10 b it is less than that; its energy is the integral of
# q dy from -inf, b^2 (-Li2(-exp(y / b))).
#
# Friction.  T_i = c_i T_0, c_i = product over j <= i of eta_j^p_j, p_j = tanh(s_j / s_slip): full
# decay towards the far end while the rope runs to the winch (s_j > 0), inverted where it runs back,
# uniform tension at rest.  The stretch of span i, T_i L_i M / (S EA), summed over the spans must be
# S - M; hence T_i = q c_i / (sum c_k L_k / S), that is T_0 = EA (S - M) (S / M) / sum c_k L_k when
# taut.  To first order of strain these are paper 000's eqs 22-26 corrected (their products of
# lengths and shifted indices are misprints); for c = 1 it is exactly EA (S - M) / M.  Sums are
# taken with c relative to its largest value, so that long chains with high friction neither
# overflow nor divide by zero.
#
# A law of friction may depend on the speed s_j, known before, and on the mean of T_j-1 and T_j.
# The latter is solved for by repetition from q itself: each time the laws see the tensions found
# last.  It converges as long as the sum of |dln eta_j / dln T| is below 1 or so; elsewhere a state
# has no answer, as one whose winch has wound up all its rope.
#
# Speed of the rope over the pulleys.  Span i holds the natural length m_i.  Rope enters it over
# pulley i+1 and leaves it over pulley i, so dm_i/dt = s_i+1 - s_i with s_0 = winding at the winch
# and s_n = -(winding at the far end), 0 where it is fixed.  Summed over the spans beyond pulley j:
#
#     s_j = s_n - d/dt sum_{i >= j} m_i        (the rate of length less elongation).
#
# With m_i = L_i M / S (each span at the mean strain) and b_j = sum_{i >= j} L_i / S that is
#
#     s_j = s_n + w b_j - (M / S) (d/dt sum_{i >= j} L_i - b_j dS/dt).
#
# It gives s_0 and s_n exactly, and needs no rate of the tension.  What it leaves out, the change
# in how the stretch is distributed, is of second order in strain.  Energy is conserved identically:
# see docs/theory/truss2.md.


class RopeTable(NamedTuple):
    """What faults alone change: first span of each rope and one more than the last, first points of
    the spans, pulley before each span (-1: none, or jammed there), whether spans are felt, as they
    are between different frames; span behind each pulley; rope without what winches have wound (m),
    and whether it is whole; EA (N), Kelvin-Voigt time (s) and slack width (N) of each rope; slip
    speeds of the pulleys, m/s.
    """

    starts: Indices
    ends: Indices
    near: Indices
    pulley: Indices
    felt: Indices
    behind: Indices
    content: Array
    alive: Array
    material: Array
    slip_speed: Array

    @classmethod
    def of(cls, ropes: Ropes, material: Array, slip_speed: Array, felt: Indices) -> "RopeTable":
        """Of the ropes of a chain, whose spans of these numbers are felt."""
        pulley = np.full(ropes.spans, -1)
        slips = ropes.slips > 0.0
        pulley[ropes.behind[slips]] = np.flatnonzero(slips)
        own = np.zeros(ropes.spans, dtype=np.int64)
        own[felt] = 1
        return cls(
            ropes.starts, ropes.ends, ropes.near, pulley, own, ropes.behind,
            np.array(ropes.content, dtype=float),
            ropes.alive.astype(float),
            material[:, ropes.cable].T.copy(), slip_speed,
        )  # fmt: skip


class Drums(NamedTuple):
    """Natural length (m) of each rope, what its winches take up and what comes in at its far end
    (m/s), shape (ropes,).
    """

    natural: Array
    winding: Array
    inflow: Array

    @classmethod
    def still(cls, ropes: int) -> "Drums":
        """Of so many ropes, not yet wound."""
        return cls(np.zeros(ropes), np.zeros(ropes), np.zeros(ropes))

    def wind(self, table: RopeTable, wound: Array, rate: Array) -> None:
        """Let the winches have wound so much (m), at rates (m/s), shape (cables, 2)."""
        call("wind", table, wound, rate, self)


class Spans(NamedTuple):
    """Lengths, their rates and directions of spans; angles at pulleys; tensions of spans, their
    share of the rope's mean; exponents of the pulleys' friction and speeds of the ropes over them.
    """

    length: Array
    rate: Array
    unit: Array
    angle: Array
    tension: Array
    share: Array
    exponent: Array
    speed: Array

    @classmethod
    def empty(cls, ropes: Ropes) -> "Spans":
        """Of ropes, not yet measured."""
        n, pulleys = ropes.spans, len(ropes.behind)
        one = np.zeros(n)
        return cls(one, one.copy(), np.zeros((n, 3)), np.zeros(pulleys), one.copy(), one.copy(),
                   np.zeros(pulleys), np.zeros(pulleys))  # fmt: skip


# Derivatives of the cable's forces after positions and velocities of its points.
#
# Every span pulls with f_i = T_i u_i, so with the differences D x = x_i+1 - x_i of the points
#
#     F = -D^T f,   dF = -D^T (u_i dT_i + T_i (I - u_i u_i^T) / L_i D dx).
#
# The second part is the geometric tangent (paper 001), block by block on the spans.  For the
# first, T_i = q c_i / cbar with cbar = sum c_k L_k / S, and weights omega_k = c_k L_k / sum c L:
#
#     dT_i = (c_i / cbar) dq                                                       material
#          + T_i (dln c_i - sum_k omega_k (dln c_k + dL_k / L_k) + dS / S)         decay
#
#     dq = q'(y) EA (dS / M + t_d (w dS / M^2 + d(dS/dt) / M)),
#     dln c_i = sum_{j <= i} (p_j dln eta_j/da da_j + ln eta_j (1 - p_j^2) / s_slip ds_j).
#
# L_i, dL_i/dt, a_j and s_j depend on neighbouring points alone, so everything is written on the
# differences of points, and in few factors dT = A dlog: no full matrices are formed.
#
# ln eta_j / ds_j of a law of speed comes beside (1 - p_j^2) / s_slip.  That laws of tension change
# with what is sought is left out: Newton's method takes up to twice the iterations where a rope is
# nearly slack, so that such a law changes fast (tests/cable_engine/own_laws/stribeck.py).
#
# Where the rope runs straight over a pulley the angle has a kink (the wrap angle cannot be
# negative); its derivative is taken as zero there, the mean of both sides.


PASSING = 2e-4
"""Slope of a pulley's friction over that at rest below which Newton's tangent does without it: more
than 0.9999 of the friction acts, and the rope's speed no longer changes it.  It keeps what it has
seen on both sides: in a step of 0.1 us a light hinge assembly may turn to and fro at 300 m/s, and
only a slope of a hundred-thousandth of that at rest leads it to its place."""


def with_law_slopes(
    slopes: Array, exponents: Array, by_speed: Array, log_decays: Array, slip_speed: Array,
    passing: float = PASSING,
) -> Array:  # fmt: skip
    """Slopes of exponents times decays over the decays, s/m: those of the exponents with those of
    laws that depend on speed, whose derivatives ``by_speed`` are; slow ones are left out.
    """
    more = np.abs(exponents) * by_speed / np.minimum(log_decays, -1e-300)
    return np.asarray(slopes + np.where(np.abs(more) * slip_speed > passing, more, 0.0))
