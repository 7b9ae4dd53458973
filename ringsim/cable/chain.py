"""The tension chain of all cables: tensions, their state from step to step, their tangent."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ringsim.cable import ropes as slack
from ringsim.cable.friction import (
    LEAST_TENSION,
    MOST_SOLVED,
    SOLVED,
    UNSOLVED,
    Friction,
    Pulleys,
)
from ringsim.cable.records import Cable
from ringsim.cable.ropes import Array, Flags, Ropes
from ringsim.cable.winding import WinchReading

# The chain at one instant: tensions, forces, powers; and its work between two instants.


@dataclass(frozen=True)
class ChainState:
    """All spans, pulleys and ropes at one instant; see ``ringsim.cable.chain``."""

    ropes: Ropes
    material: Array
    """EA (N), Kelvin-Voigt time (s) and slack width (N) of each rope, shape (3, ropes)."""
    lengths: Array
    rates: Array
    """Length of each span (m) and its rate (m/s), shape (spans,)."""
    directions: Array
    """Unit vectors away from the winch, shape (spans, 3)."""
    angles: Array
    """Angle between the two pulls on each pulley (rad), shape (pulleys,)."""
    log_decays: Array
    """Logarithm of the full decay at each pulley, shape (pulleys,)."""
    friction: Friction
    """The laws of ``log_decays``, and their derivatives, which forces do not need."""
    speeds: Array
    """Rope over each pulley (m/s, towards the winch positive), shape (pulleys,)."""
    exponents: Array
    """Share and direction of the full decay, tanh(speed / slip speed), shape (pulleys,)."""
    slip_speeds: Array
    """Speed that regularises the exponents (m/s), shape (pulleys,)."""
    shares: Array
    """Tension of each span over its rope's mean tension, shape (spans,)."""
    tensions: Array
    """Of each span, in N, shape (spans,)."""
    paths: Array
    path_rates: Array
    """Path length of each rope (m) and its rate (m/s), shape (ropes,)."""
    natural: Array
    wound_rates: Array
    """Natural length of each rope (m) and what its winches take up (m/s), shape (ropes,)."""
    strains: Array
    strain_rates: Array
    """Mean strain of each rope, (path - natural) / natural as of paper 001's element, and its
    rate in 1/s, shape (ropes,)."""
    forces: Array
    """Elastic and viscous force of each rope before smoothing (N), shape (ropes,)."""
    mean_tensions: Array
    """Mean tension of each rope, weighted by length (N), shape (ropes,)."""
    wound: Array
    wound_rate: Array
    """Of the winches at both ends of each cable, m and m/s, shape (cables, 2)."""

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

    def law_slopes(self, slopes: Array) -> Array:
        """Derivatives of the exponents times the decays after the speeds over the decays, s/m: the
        ``slopes`` of the exponents with those of laws that depend on speed.
        """
        if not self.friction.moves:
            return slopes
        own = np.abs(self.exponents) * self.friction.by_speed(self.pulleys)
        return np.asarray(slopes + own / np.minimum(self.log_decays, -1e-300))

    @property
    def is_slack(self) -> Flags:
        """Whether a rope is longer than its path, or cut; shape (ropes,)."""
        return np.asarray((self.paths < self.natural) | ~self.ropes.alive)

    @cached_property
    def winch_tensions(self) -> Array:
        """Tension at both ends of each cable, in N, shape (cables, 2)."""
        edge = self.ropes.cable_starts
        return np.array([self.tensions[edge[:-1]], self.tensions[edge[1:] - 1]]).T

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

    @cached_property
    def held_beyond(self) -> Array:
        """Natural length from each pulley to its rope's far end, m, shape (pulleys,)."""
        rope = self.ropes.of_pulley
        total = np.zeros(len(self.lengths) + 1)
        np.cumsum(self.lengths, out=total[1:])
        beyond = total[self.ropes.ends[rope]] - total[self.ropes.behind]
        return np.asarray(beyond * (self.natural / self.paths)[rope])

    @cached_property
    def friction_forces(self) -> Array:
        """Loss of tension over each pulley times the stretch there, in N, shape (pulleys,)."""
        before = self.tensions[self.ropes.behind - 1] * self.ropes.slips
        lost = -np.expm1(self.exponents * self.log_decays)
        return np.asarray(before * lost * (1.0 + self.strains[self.ropes.of_pulley]))

    @property
    def friction_loss(self) -> Array:
        """Power lost on each pulley, in W, never negative, shape (pulleys,)."""
        return self.friction_forces * self.speeds

    @cached_property
    def viscous_forces(self) -> Array:
        """Viscous part of each rope's mean tension, in N, shape (ropes,)."""
        stiffness, _, width = self.material
        statically = slack.tension(stiffness * self.strains, width)
        return self.mean_tensions - self.ropes.alive * statically

    @property
    def damping_loss(self) -> Array:
        """Power lost inside each rope, in W, never negative, shape (ropes,)."""
        return np.asarray(self.viscous_forces * self.strain_rates * self.natural)

    @cached_property
    def energy_density(self) -> Array:
        """Elastic energy of each rope per natural length, in J/m, shape (ropes,)."""
        stiffness, _, width = self.material
        elastic = slack.energy(stiffness * self.strains, width)
        return np.asarray(self.ropes.alive * elastic / stiffness)

    @property
    def elastic_energy(self) -> Array:
        """Elastic energy of each rope, in J, shape (ropes,)."""
        return self.energy_density * self.natural

    @cached_property
    def winch_forces(self) -> Array:
        """Force of the winches at both ends of each cable per natural length, in N, (cables, 2)."""
        return self.winch_tensions * (1.0 + self.strains[self.ropes.of_end])

    @property
    def winch_power(self) -> Array:
        """Power that the winches at both ends of each cable put in, in W, shape (cables, 2)."""
        return self.winch_forces * self.wound_rate

    def reading(self, cable: int, end: int = 0, path_slope: float = 0.0) -> WinchReading:
        """Readings of the winch at an end (0 first, 1 far) of a cable (from 0)."""
        ropes = self.ropes
        rope = int(ropes.of_end[cable, end])
        present = float(self.wound_rate[cable, end])
        inner = ropes.inner(rope)
        part = self.lengths[ropes.starts[rope] : ropes.ends[rope]] / self.paths[rope]
        slip, decays = self.slip_speeds[inner], self.log_decays[inner]
        moves, seen, friction = self.friction.moves, self.pulleys, self.friction
        share = (1.0 - np.cumsum(part)[:-1] - float(end)) / slip
        slid = self.speeds[inner] / slip - present * share
        alive, logs = float(ropes.alive[rope]), np.zeros(len(part))

        def ratio(speed: float) -> float:
            # A root finder asks some ten thousand times a run: few calls of numpy, in place.
            turning, own = slid + speed * share, decays
            if moves:
                seen.speed[inner] = np.abs(turning) * slip
                own = friction.decays(seen)[inner]
            np.cumsum(own * np.tanh(turning), out=logs[1:])
            weights = np.exp(logs - np.maximum.reduce(logs))
            return alive * float(weights[-1 if end else 0]) / float(weights @ part)

        path_rate = float(self.path_rates[rope] + self.wound_rates[rope]) - present
        return WinchReading(tension_ratio=ratio, path_rate=path_rate, path_slope=path_slope)


def work_between(before: ChainState, after: ChainState) -> tuple[float, float]:
    """Energies in J: put in by the winches, less what is wound up; lost by friction, damping.

    The work of a force is its mean at both instants times the displacement: rope wound on a drum,
    rope slipped over a pulley, strain of a rope.  Products of force and rate at the instants alone
    would miss the displacement between them.  Nothing moves while a fault changes the ropes.
    Source: the energy balance of Belytschko, Liu and Moran, Nonlinear Finite Elements for
    Continua and Structures (2000), sec. 6.2.3.
    """
    ropes = after.ropes
    if before.ropes is not ropes:
        return 0.0, 0.0
    wound = after.wound - before.wound
    pulls = 0.5 * (before.winch_forces + after.winch_forces)
    carried = 0.5 * (before.energy_density + after.energy_density) * ropes.per_rope(wound)
    slipped = before.held_beyond - after.held_beyond
    cable = ropes.cable[ropes.of_pulley]
    slipped -= (ropes.of_end[cable, 1] == ropes.of_pulley) * wound[cable, 1]
    friction = 0.5 * (before.friction_forces + after.friction_forces) * slipped
    viscous = 0.5 * (before.viscous_forces + after.viscous_forces)
    viscous = viscous * 0.5 * (before.natural + after.natural) * (after.strains - before.strains)
    driven = float(np.sum(pulls * wound) - np.sum(carried))
    return driven, float(np.sum(friction) + np.sum(viscous))


def pulley_tensions(ropes: Ropes, tensions: Array) -> Array:
    """Mean of both sides of each pulley, N, shape (pulleys,); see ``Pulleys``."""
    behind = ropes.behind
    return np.maximum(0.5 * (tensions[behind - 1] + tensions[behind]), LEAST_TENSION)


# The tension chain of all cables, from positions and velocities of their pulleys.
#
# Spans i = 0 .. n-1 run from the winch to the far end, pulley j = 1 .. n-1 stands between spans
# j-1 and j.  For each rope (metre, newton, second):
#
# Geometry.  L_i and u_i (away from the winch) from the points; the angle between the pulls -u_j-1
# and u_j is a_j = 2 atan2(\|u_j-1 + u_j\|, \|u_j - u_j-1\|), exact near 0 and pi.
#
# Stretch.  S = sum L_i, natural length M = content - wound, mean strain e = (S - M) / M (paper
# 001's element).  Mean tension q = b ln(1 + exp(y / b)) with y = EA (e + t_d de/dt): smooth in
# slack, see ``ringsim.cable.ropes``; de/dt = (dS/dt + (S / M) w) / M with w the rate of winding.
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


class Chain:
    """The cables of a scene, ready to be evaluated at any motion of their pulleys.

    ``points_per_cable`` counts the points of each path: winch, pulleys, far end.

    Raises
    ------
    ValueError
        If a cable has friction coefficients for another number of pulleys.

    Examples
    --------
    A rope of 2 m turns by 90 deg over one pulley; 1 mm of it is wound, at 5 mm/s.  The pulley's
    bearing takes 5.5 % of the tension at the winch.

    >>> from ringsim.cable.friction import BearingFriction
    >>> from ringsim.cable.records import Winch
    >>> from ringsim.cable.winding import ConstantWinding
    >>> winch = Winch(winding=ConstantWinding(speed=0.005))
    >>> chain = Chain([Cable(winch=winch, friction=BearingFriction(coefficient=4e-4))], [3])
    >>> points = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> wound, speed = np.array([[0.001, 0.0]]), np.array([[0.005, 0.0]])
    >>> state = chain.state(chain.start(points), points, np.zeros((3, 3)), wound, speed)
    >>> state.tensions.round(2)
    array([51.44, 48.61])
    >>> float(state.winch_power.sum().round(4)), state.friction_loss.round(4)
    (0.2573, array([0.0071]))
    """

    def __init__(self, cables: Sequence[Cable], points_per_cable: Sequence[int]) -> None:
        self.cables, self._points_per_cable = tuple(cables), tuple(points_per_cable)
        ends = np.cumsum([points - 2 for points in points_per_cable])
        self.pulleys = [slice(*ends_of) for ends_of in pairwise([0, *ends])]
        """Pulleys of each cable."""
        slip = []
        for number, (cable, points) in enumerate(zip(cables, points_per_cable, strict=True), 1):
            given, pulleys = cable.friction.coefficients.shape, points - 2
            if given not in ((), (pulleys,)):
                raise ValueError(
                    f"cable {number}: friction.coefficient has {given[0]} values, but there "
                    f"are {pulleys} pulleys: give one value for all, or one for each"
                )
            slip += [cable.slip_speed_over(pulleys)] * pulleys
        self.slip_speed = np.array(slip)
        """Of all pulleys, m/s, shape (pulleys,)."""
        self.material = np.array(
            [[c.axial_stiffness, c.damping_time, c.slack_width] for c in cables]
        ).T
        """EA (N), Kelvin-Voigt time (s) and slack width (N) of each cable, shape (3, cables)."""
        self.friction = Friction(
            [(c.friction, c.pulley_radius, n) for c, n in zip(cables, self.pulleys, strict=True)]
        )

    def start(self, points: Array) -> Ropes:
        """One rope per cable, as long as its path at the start plus its initial slack.

        The points are those of all cables behind one another, in metre, shape (points, 3).
        """
        spans = np.asarray(self._points_per_cable) - 1
        content = np.array([cable.initial_slack for cable in self.cables])
        alive = np.ones(len(spans), dtype=bool)
        ropes = Ropes(self._points_per_cable, np.cumsum(spans) - spans, content, alive)
        lengths = np.linalg.norm(points[ropes.near + 1] - points[ropes.near], axis=1)
        return replace(ropes, content=ropes.along(lengths) + content)

    def state(
        self, ropes: Ropes, points: Array, velocities: Array, wound: Array, wound_rate: Array
    ) -> ChainState:
        """Evaluate the chain with ropes from ``start``, and after faults.

        Points and velocities are those of all cables behind one another, m and m/s, shape
        (points, 3); rope wound and its rate those of the winches at both ends of each cable, m and
        m/s, shape (cables, 2), zero at a fixed end.

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope.
        """
        lengths, directions, rates = ropes.measured(points, velocities)
        paths, path_rates = ropes.along(lengths), ropes.along(rates)
        natural = ropes.content - ropes.per_rope(wound)
        if not natural.min() > 0.0:
            short = int(np.argmin(natural))
            raise ValueError(
                f"cable {ropes.cable[short] + 1}: {-natural[short]:.4g} m more is wound than "
                "there is rope (limit its winding law, or stop the winch)"
            )
        winding = ropes.per_rope(wound_rate)

        before, behind = directions[ropes.behind - 1], directions[ropes.behind]
        sine, cosine = (
            np.sqrt(np.einsum("ij,ij->i", sides, sides))
            for sides in (before + behind, behind - before)
        )
        angles = 2.0 * np.arctan2(sine, cosine)

        rope = ropes.of_pulley
        last, inner = ropes.ends[rope] - 1, ropes.behind - 1
        total, total_rate = np.cumsum(lengths), np.cumsum(rates)
        beyond = (total[last] - total[inner]) / paths[rope]
        beyond_rate = total_rate[last] - total_rate[inner]
        inflow = np.zeros(len(paths))
        inflow[ropes.of_end[:, 1]] = -wound_rate[:, 1]
        share_rate = (beyond_rate - beyond * path_rates[rope]) * (natural / paths)[rope]
        speeds = (inflow[rope] + winding[rope] * beyond - share_rate) * ropes.slips
        exponents = np.tanh(speeds / self.slip_speed)

        material = stiffness, damping_time, slack_width = self.material[:, ropes.cable]
        strains = paths / natural - 1.0
        strain_rates = (path_rates + paths / natural * winding) / natural
        forces = stiffness * (strains + damping_time * strain_rates)
        tension = ropes.alive * slack.tension(forces, slack_width)

        def shared(log_decays: Array) -> Array:
            """Tension of each span over its rope's mean."""
            steps = np.zeros(ropes.spans)
            steps[ropes.behind] = exponents * log_decays * ropes.slips
            logs = np.cumsum(steps)
            # Relative to the largest decay of the rope: bad pulleys neither overflow nor vanish.
            weights = np.exp(logs - np.maximum.reduceat(logs, ropes.starts)[ropes.of_span])
            return np.asarray(weights / (ropes.along(weights * lengths) / paths)[ropes.of_span])

        even, log_decays = tension[ropes.of_span], np.zeros(len(angles))
        shares = np.ones(ropes.spans)
        for _ in range(MOST_SOLVED):
            seen = Pulleys(angles, np.abs(speeds), pulley_tensions(ropes, shares * even))
            previous, log_decays = log_decays, self.friction.decays(seen)
            shares = shared(log_decays)
            if not self.friction.loads or np.abs(log_decays - previous).max(initial=0.0) < SOLVED:
                break
        else:
            raise ValueError(UNSOLVED)
        return ChainState(
            ropes=ropes,
            material=material,
            lengths=lengths,
            rates=rates,
            directions=directions,
            angles=angles,
            log_decays=log_decays,
            friction=self.friction,
            speeds=speeds,
            exponents=exponents,
            slip_speeds=self.slip_speed,
            shares=shares,
            tensions=shares * even,
            paths=paths,
            path_rates=path_rates,
            natural=natural,
            wound_rates=winding,
            strains=strains,
            strain_rates=strain_rates,
            forces=forces,
            mean_tensions=tension,
            wound=wound,
            wound_rate=wound_rate,
        )


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
# differences of points: no product of full matrices is formed.
#
# ln eta_j / ds_j of a law of speed comes beside (1 - p_j^2) / s_slip.  That laws of tension change
# with what is sought is left out: Newton's method takes up to twice the iterations where a rope is
# nearly slack, so that such a law changes fast (tests/cable_engine/own_laws/stribeck.py).
#
# Where the rope runs straight over a pulley the angle has a kink (the wrap angle cannot be
# negative); its derivative is taken as zero there, the mean of both sides.


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
    sensitivity = state.log_decays[inner] * state.law_slopes(slopes)[inner]
    steadily = float(state.wound_rates[rope]) + ratio * path_rate
    by_length = (sensitivity * (steadily / path))[:, None] * beyond_less_part
    by_length += (sensitivity * (ratio / path) * (part_rate - part * path_rate))[:, None]
    by_rate = (-ratio * sensitivity)[:, None] * beyond_less_part
    by_place = by_length[:, :, None] * unit
    by_place += by_rate[:, :, None] * tangent.swing
    before, behind = _angle_gradients(unit, length)
    turned = (exponent * state.friction.by_angle(state.pulleys)[inner])[:, None]
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
