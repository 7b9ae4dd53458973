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
in how the stretch is distributed, is of second order in strain.  Energy is conserved identically:
see docs/cables.md.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from ringsim.cable import slack
from ringsim.cable.records import Cable
from ringsim.cable.ropes import Array, Ropes
from ringsim.cable.state import ChainState


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

    >>> from ringsim.cable.friction.bearing import BearingFriction
    >>> from ringsim.cable.records import Winch
    >>> from ringsim.cable.winding.constant import ConstantWinding
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
        log_decays = self.log_decays(angles)

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

        steps = np.zeros(ropes.spans)
        steps[ropes.behind] = exponents * log_decays * ropes.slips
        logs = np.cumsum(steps)
        # Relative to the largest decay of the rope: bad pulleys neither overflow nor vanish.
        weights = np.exp(logs - np.maximum.reduceat(logs, ropes.starts)[ropes.of_span])
        shares = weights / (ropes.along(weights * lengths) / paths)[ropes.of_span]

        material = stiffness, damping_time, slack_width = self.material[:, ropes.cable]
        strains = paths / natural - 1.0
        strain_rates = (path_rates + paths / natural * winding) / natural
        forces = stiffness * (strains + damping_time * strain_rates)
        tension = ropes.alive * slack.tension(forces, slack_width)
        return ChainState(
            ropes=ropes,
            material=material,
            lengths=lengths,
            rates=rates,
            directions=directions,
            angles=angles,
            log_decays=log_decays,
            friction_slopes=partial(self.log_slopes, angles),
            speeds=speeds,
            exponents=exponents,
            slip_speeds=self.slip_speed,
            shares=shares,
            tensions=shares * tension[ropes.of_span],
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

    def log_decays(self, angles: Array) -> Array:
        """Logarithms of the full decay at angles (rad) of all pulleys, shape (pulleys,)."""
        own = zip(self.cables, self.pulleys, strict=True)
        return np.concatenate([c.friction.log_decay(angles[n], c.pulley_radius) for c, n in own])

    def log_slopes(self, angles: Array) -> Array:
        """Their derivatives after the angles, 1/rad."""
        own = zip(self.cables, self.pulleys, strict=True)
        return np.concatenate([c.friction.log_slope(angles[n], c.pulley_radius) for c, n in own])
