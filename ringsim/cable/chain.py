r"""The tension chain of all cables, from positions and velocities of their pulleys.

Spans i = 0 .. n-1 run from the winch to the far end, pulley j = 1 .. n-1 stands between spans
j-1 and j.  For each rope (metre, newton, second):

Geometry.  L_i and u_i (away from the winch) from the points; the angle between the pulls -u_j-1
and u_j is a_j = 2 atan2(\|u_j-1 + u_j\|, \|u_j - u_j-1\|), exact near 0 and pi.

Stretch.  S = sum L_i, natural length M = content - wound, mean strain e = (S - M) / M (paper
001's element).  Mean tension q = b ln(1 + exp(y / b)) with y = EA (e + t_d de/dt): smooth in
slack, see ``ringsim.cable.slack``; de/dt = (dS/dt + (S / M) w) / M with w the rate of winding.

Friction.  T_i = c_i T_0, c_i = product over j <= i of eta_j^p_j, p_j = tanh(s_j / s_slip):
full decay towards the far end while the rope runs to the winch (s_j > 0), inverted where it runs
back, uniform tension at rest.  The stretch of span i, T_i L_i M / (S EA), summed over the spans
must be S - M; hence T_i = q c_i / (sum c_k L_k / S), that is T_0 = EA (S - M) (S / M) /
sum c_k L_k when taut.  To first order of strain these are paper 000's eqs 22-26 corrected (their
products of lengths and shifted indices are misprints); for c = 1 it is exactly
EA (S - M) / M.  Sums are taken with c relative to its largest value, so that long chains with high
friction neither overflow nor divide by zero.

Speed of the rope over the pulleys.  Span i holds the natural length m_i.  Rope enters it over
pulley i+1 and leaves it over pulley i, so dm_i/dt = s_i+1 - s_i with s_0 = winding at the winch
and s_n = -(winding at the far end), 0 where it is fixed.  Summed over the spans beyond pulley j:

    s_j = s_n - d/dt sum_{i >= j} m_i        (the rate of length less elongation).

With m_i = L_i M / S (each span at the mean strain) and b_j = sum_{i >= j} L_i / S that is

    s_j = s_n + w b_j - (M / S) (d/dt sum_{i >= j} L_i - b_j dS/dt).

It gives s_0 and s_n exactly, and needs no rate of the tension.  What it leaves out, the change
in how the stretch is distributed, is of second order in strain.  It also closes the energy:
multiply dL_i/dt = (1 + e) dm_i/dt + m_i de/dt by T_i and sum up,

    (1 + e) (T_0 s_0 - T_n-1 s_n) = - sum T_i dL_i/dt + (1 + e) sum (T_j-1 - T_j) s_j + M q de/dt

winch power = power into the structure + friction + elastic energy and damping, an identity of
the model.  T_j-1 - T_j has the sign of s_j: friction never feeds energy in.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ringsim.cable import slack
from ringsim.cable.records import Cable
from ringsim.cable.ropes import Ropes
from ringsim.cable.state import ChainState, RopeMaterial

Array = NDArray[np.float64]

SHORTEST = 1e-9
"""Length in metre below which a span has no direction."""


class Chain:
    """The cables of a scene, ready to be evaluated at any motion of their pulleys.

    Parameters
    ----------
    cables
        The record of each cable.
    points_per_cable
        Points of each cable's path: winch, pulleys, far end.

    Raises
    ------
    ValueError
        If a cable has friction coefficients for another number of pulleys.

    """

    def __init__(self, cables: Sequence[Cable], points_per_cable: Sequence[int]) -> None:
        self.cables = tuple(cables)
        self.points_per_cable = tuple(points_per_cable)
        for number, (cable, points) in enumerate(zip(cables, points_per_cable, strict=True), 1):
            given, pulleys = cable.friction.coefficients.shape, points - 2
            if given not in ((), (pulleys,)):
                raise ValueError(
                    f"cable {number}: friction.coefficient has {given[0]} values, but there "
                    f"are {pulleys} pulleys: give one value for all, or one for each"
                )
        pulleys_per_cable = [points - 2 for points in points_per_cable]
        slip = [c.slip_speed_over(n) for c, n in zip(cables, pulleys_per_cable, strict=True)]
        self._slip_speed = np.repeat(slip, pulleys_per_cable)
        self._ropes: Ropes | None = None
        self._material = self._per_rope(np.arange(len(cables)))

    def start(self, points: Array) -> Ropes:
        """One rope per cable, as long as its path at the start plus its initial slack.

        Parameters
        ----------
        points
            Points of all cables behind one another, in metre, shape (points, 3).

        """
        ropes = Ropes.whole(self.points_per_cable, np.zeros(len(self.cables)))
        lengths = np.linalg.norm(points[ropes.far] - points[ropes.near], axis=1)
        extra = np.array([c.initial_slack for c in self.cables])
        return Ropes.whole(self.points_per_cable, np.add.reduceat(lengths, ropes.starts) + extra)

    def state(
        self, ropes: Ropes, points: Array, velocities: Array, wound: Array, wound_rate: Array
    ) -> ChainState:
        """Evaluate the chain.

        Parameters
        ----------
        ropes
            From ``start``, and after faults.
        points, velocities
            Of all cables behind one another, m and m/s, shape (points, 3).
        wound, wound_rate
            Of the winches at both ends of each cable, m and m/s, shape (cables, 2); zero at a
            fixed end.

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope.

        """
        near, far, starts = ropes.near, ropes.far, ropes.starts
        apart = points[far] - points[near]
        lengths = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        if not lengths.min() > SHORTEST:
            raise ValueError(_no_length(ropes, lengths))
        directions = apart / lengths[:, None]
        rates = np.einsum("ij,ij->i", directions, velocities[far] - velocities[near])
        paths, path_rates = np.add.reduceat(lengths, starts), np.add.reduceat(rates, starts)
        natural = ropes.content - ropes.per_rope(wound)
        if not natural.min() > 0.0:
            short = int(np.argmin(natural))
            raise ValueError(
                f"cable {ropes.cable[short] + 1}: {-natural[short]:.4g} m more is wound than "
                "there is rope (limit its winding law, or stop the winch)"
            )
        winding = ropes.per_rope(wound_rate)

        angles = _angles(directions, ropes)
        log_decays = self._log_decays(angles, ropes)
        speeds = _speeds(ropes, lengths, rates, paths, path_rates, natural, winding, wound_rate)
        exponents = np.tanh(speeds / self._slip_speed)

        steps = np.zeros(ropes.spans)
        steps[ropes.behind] = exponents * log_decays * ropes.slips
        logs = np.cumsum(steps)
        weights = np.exp(logs - np.maximum.reduceat(logs, starts)[ropes.of_span])
        mean = np.add.reduceat(weights * lengths, starts) / paths
        shares = weights / mean[ropes.of_span]

        material = self._rope_material(ropes)
        strain_rate = (path_rates + paths / natural * winding) / natural
        forces = material.axial_stiffness * (
            paths / natural - 1.0 + material.damping_time * strain_rate
        )
        tension = ropes.alive * slack.tension(forces, material.slack_width)
        return ChainState(
            ropes=ropes,
            material=material,
            lengths=lengths,
            rates=rates,
            directions=directions,
            angles=angles,
            log_decays=log_decays,
            friction_slopes=partial(self._log_slopes, angles, ropes),
            speeds=speeds,
            exponents=exponents,
            slip_speeds=self._slip_speed,
            shares=shares,
            tensions=shares * tension[ropes.of_span],
            paths=paths,
            path_rates=path_rates,
            natural=natural,
            wound_rates=winding,
            forces=forces,
            mean_tensions=tension,
            wound=wound,
            wound_rate=wound_rate,
        )

    def _log_decays(self, angles: Array, ropes: Ropes) -> Array:
        found = np.empty_like(angles)
        for number, cable in enumerate(self.cables):
            own = ropes.pulleys(number)
            found[own] = cable.friction.log_decay(angles[own], cable.pulley_radius)
        return found

    def _log_slopes(self, angles: Array, ropes: Ropes) -> Array:
        found = np.empty_like(angles)
        for number, cable in enumerate(self.cables):
            own = ropes.pulleys(number)
            found[own] = cable.friction.log_slope(angles[own], cable.pulley_radius)
        return found

    def _rope_material(self, ropes: Ropes) -> RopeMaterial:
        if self._ropes is not ropes:
            self._ropes, self._material = ropes, self._per_rope(ropes.cable)
        return self._material

    def _per_rope(self, cable: NDArray[np.intp]) -> RopeMaterial:
        return RopeMaterial(
            axial_stiffness=np.array([c.axial_stiffness for c in self.cables])[cable],
            damping_time=np.array([c.damping_time for c in self.cables])[cable],
            slack_width=np.array([c.slack_width for c in self.cables])[cable],
        )


def _angles(directions: Array, ropes: Ropes) -> Array:
    before, behind = directions[ropes.behind - 1], directions[ropes.behind]
    total, change = before + behind, behind - before
    sine = np.sqrt(np.einsum("ij,ij->i", total, total))
    cosine = np.sqrt(np.einsum("ij,ij->i", change, change))
    return np.asarray(2.0 * np.arctan2(sine, cosine))


def _speeds(
    ropes: Ropes,
    lengths: Array,
    rates: Array,
    paths: Array,
    path_rates: Array,
    natural: Array,
    winding: Array,
    wound_rate: Array,
) -> Array:
    rope, last = ropes.of_pulley, ropes.ends[ropes.of_pulley] - 1
    total, total_rate = np.cumsum(lengths), np.cumsum(rates)
    beyond = (total[last] - total[ropes.behind - 1]) / paths[rope]
    beyond_rate = total_rate[last] - total_rate[ropes.behind - 1]
    inflow = np.zeros(len(paths))
    inflow[ropes.last] = -wound_rate[:, 1]
    share_rate = (beyond_rate - beyond * path_rates[rope]) * (natural / paths)[rope]
    return np.asarray((inflow[rope] + winding[rope] * beyond - share_rate) * ropes.slips)


def _no_length(ropes: Ropes, lengths: Array) -> str:
    span = int(np.argmin(lengths)) if np.all(np.isfinite(lengths)) else -1
    if span < 0:
        return "the points of the cables are not finite"
    cable = int(np.searchsorted(ropes.cable_starts, span, side="right")) - 1
    number = span - int(ropes.cable_starts[cable]) + 1
    return f"cable {cable + 1}: span {number} has no length, its two points coincide"
