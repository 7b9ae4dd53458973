"""The tension chain in plain numpy, span by span, from the equations of docs/theory/cables.md."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ringsim.cable.friction import Pulleys

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS


def plain_tension(force, width):
    """b ln(1 + exp(y / b)), N."""
    return width * np.logaddexp(0.0, force / width)


def plain_energy(force, width):
    """Its integral after the force from -inf, N^2: -Li2(-s) = integral of ln(1 + s v) / v dv over
    (0, 1) by 24 Gauss-Legendre nodes (error below 1e-14 for s <= 1), beyond that by its inversion.
    """
    z = force / width
    tail = float(np.log1p(np.exp(-abs(z)) * NODES) / NODES @ WEIGHTS)
    return width**2 * (0.5 * z**2 + np.pi**2 / 6.0 - tail if z > 0.0 else tail)


@dataclass
class Plain:
    """What a rope tells: spans from the winch on, and the pulleys between them; ``losses`` are
    tensions lost at these times the stretch, ``beyond`` natural lengths behind them.
    """

    tensions: list[float]
    speeds: list[float]
    exponents: list[float]
    mean: float
    viscous: float
    density: float
    losses: list[float]
    beyond: list[float]


def plain_rope(cable, slip, points, velocities, content, wound, rates, alive=1.0, numbers=None):
    """A rope over its points, (n + 1, 3); ``rates`` are what winches at both ends take up, m/s.

    ``numbers`` are those of its pulleys among all of its cable, for a friction of each.
    """
    n = len(points) - 1
    apart, moving = np.diff(points, axis=0), np.diff(velocities, axis=0)
    length = [float(np.linalg.norm(each)) for each in apart]
    unit = [each / size for each, size in zip(apart, length, strict=True)]
    growing = [float(u @ v) for u, v in zip(unit, moving, strict=True)]
    path, path_rate, natural = sum(length), sum(growing), content - alive * wound
    winding = sum(rates)
    strain = alive * (path - natural) / natural
    strain_rate = (path_rate + path / natural * winding) / natural
    force = cable.axial_stiffness * (strain + cable.damping_time * strain_rate)
    width = cable.slack_width
    mean = alive * plain_tension(force, width)
    elastic = cable.axial_stiffness * strain
    viscous = mean - alive * plain_tension(elastic, width)
    density = alive * plain_energy(elastic, width) / cable.axial_stiffness
    angle = [np.pi - np.arccos(np.clip(unit[j] @ unit[j + 1], -1.0, 1.0)) for j in range(n - 1)]
    speeds, exponents = [], []
    for j in range(1, n):
        beyond = sum(length[j:]) / path
        speed = -rates[1] + winding * beyond
        speed -= natural / path * (sum(growing[j:]) - beyond * path_rate)
        speeds.append(speed)
        exponents.append(np.tanh(speed / slip))
    tensions = [mean] * n
    law, radius = cable.friction, cable.pulley_radius
    numbers = range(n - 1) if numbers is None else numbers
    for _ in range(60 if law.loads else 1):
        shares = [1.0]
        for j in range(n - 1):
            both = max(0.5 * (tensions[j] + tensions[j + 1]), 1e-6)
            seen = np.array([[angle[j]], [abs(speeds[j])], [both]]).repeat(numbers[-1] + 1, axis=1)
            decay = np.broadcast_to(law.decay(Pulleys(*seen), radius), seen[0].shape)
            shares.append(shares[-1] * float(np.exp(exponents[j] * decay[numbers[j]])))
        even = sum(c * size for c, size in zip(shares, length, strict=True)) / path
        tensions = [mean * c / even for c in shares]
    losses = [(a - b) * (1.0 + strain) for a, b in pairwise(tensions)]
    beyond = [sum(length[j:]) * natural / path for j in range(1, n)]
    return Plain(tensions, speeds, exponents, mean, viscous, density, losses, beyond)


def plain_state(case):
    """Of all ropes of a case of ``cable_cases``, one after the other."""
    ropes, chain = case.ropes, case.chain
    found = []
    for rope, (first, last) in enumerate(zip(ropes.starts, ropes.ends, strict=True)):
        near, k = int(ropes.near[first]), int(ropes.cable[rope])
        begins, ends = first == ropes.cable_starts[k], last == ropes.cable_starts[k + 1]
        own = np.array([begins, ends], dtype=float)
        points = slice(near, near + last - first + 1)
        before = first - ropes.cable_starts[k]
        slip = chain.slip_speed[chain.pulleys[k]][0]
        found.append(
            plain_rope(
                chain.cables[k], slip, case.points[points], case.velocities[points],
                ropes.content[rope], float(own @ case.wound[k]), own * case.wound_rate[k],
                float(ropes.alive[rope]), range(before, before + last - first - 1),
            )
        )  # fmt: skip
    return found
