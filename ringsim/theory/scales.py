"""Reference numbers of a scene, from which the control of its run starts."""

import math

import numpy as np

from ringsim.layout.bodies import OnRod
from ringsim.layout.joints import JointOpening
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array
from ringsim.parts.persection import spread
from ringsim.scene import Scene
from ringsim.stepping.instant import Scales
from ringsim.theory.one_coordinate import OneCoordinate

_MEASURED = 0.2889
"""Reach of ``ring18``, m."""


def scales_of(scene: Scene, layout: Layout, ideal: OneCoordinate, ropes: Array | None) -> Scales:
    """What the ideal structure, as stowed, the stops and the cables say before a run.

    ``ropes`` are the natural lengths of the cables' ropes, shape (cables,), m; None without cables.
    """
    structure = scene.structure
    angles, rates = layout.opening_angles()
    per_angle = float(rates.mean())
    start = structure.coordinate
    folding = ideal.motion(start).inertia
    acceleration = per_angle * (ideal.work_rate(start) / folding)
    inertia = folding / per_angle**2
    travel = math.pi - float(angles.mean())
    if acceleration < 0.0 and scene.cables is None:  # it folds, which may be a far longer way
        stowed = 0.0 if scene.stop is None else math.radians(scene.stop.stowed_angle)
        travel = max(float(angles.mean()) - stowed, travel)
    # The mean rate if the first acceleration lasted, at least that of the longest run.
    rate = max(math.sqrt(0.5 * abs(acceleration) * travel), travel / scene.solver.end_time)
    # Springs of its own set the scale: a thousandth of their force times a rod does not matter.
    pushed = 1e-3 * structure.push * structure.reach
    energy = pushed or 0.5 * inertia * rate**2
    contact = _contact_step(scene, layout)
    found = Scales(rate, energy, travel, structure.reach, contact_step=contact)
    if scene.cables is None or ropes is None:
        return found
    cables, lengths = scene.cables.present(), np.abs(ropes)
    widths = np.array([cable.slack_width for _, cable in cables])
    stiffness = sum(
        cable.axial_stiffness / float(length) * structure.path_slope(cable, angles[plane]) ** 2
        for (plane, cable), length in zip(cables, lengths, strict=True)
    )
    return found._replace(
        first_step=_swing_step(inertia, stiffness, 50),
        slack_tension=float(widths.max()),
        slack_energy=0.1 * float(np.sum(widths * lengths)),
    )


def coordinates(scene: Scene) -> float:
    """Size of coordinates, m, that round-off goes with: 1 m for a ring as ``ring18``, for which
    what it leaves of residuals was measured, and else as its reach.
    """
    return scene.structure.reach / _MEASURED


def residual_tolerance(scene: Scene, layout: Layout, reached: float) -> float:
    """Residual norm in N at which Newton stops: a share of the driving forces, but above what
    round-off lets it reach.

    ``reached`` is that norm over the rate EA / L (N/m) of the stiffest element, for coordinates of
    1 m.
    """
    drive = float(np.linalg.norm([force for _, force in layout.forces])) + scene.structure.push
    if layout.net is not None:
        net, springs = layout.net.law, len(layout.net.bodies)
        drive += float(np.linalg.norm(spread(net.stiffness, springs))) * net.neutral_length
    if drive == 0.0 and layout.gravity is not None:
        drive = sum(layout.masses().values()) * float(np.linalg.norm(layout.gravity))
    stiffest = max(rod.young_modulus * rod.tube.area / rod.lengths.min() for rod in layout.rods)
    return max(
        scene.solver.newton_tolerance * drive, reached * float(stiffest) * coordinates(scene)
    )


def rope_reach(scene: Scene, rate_by_place: float = 0.0) -> float:
    """Residual norm over the round-off of coordinates of order 1 m that ropes leave, N.

    The strain S / M - 1 of a rope is rounded as S / M, about 1, and its tension pulls on both ends
    of every span; damped ropes feel rates, rounded as much as their derivative after places (1/s).
    """
    if scene.cables is None:
        return 0.0
    pulls = [
        cable.axial_stiffness
        * (1.0 + cable.damping_time * rate_by_place)
        * math.sqrt(2 * (scene.pulleys_of(cable) + 1))
        for _, cable in scene.cables.present()
    ]
    return math.hypot(*pulls)


def _swing_step(inertia: float, stiffness: float, steps: int) -> float:
    """Step in s that takes so many to the period 2 pi sqrt(I / k) of a swing (kg m^2, N m/rad).

    20 for a bounce on a stop: the period is right to (w h)^2 / 12 = 0.8 %.  50 for ropes: a winch
    that starts at once throws the structure into its swing on them, often with the largest tension
    of the run, and the first V-joint moves before the others, that is faster than the period says.
    """
    return 2.0 * math.pi * math.sqrt(inertia / stiffness) / steps


def _contact_step(scene: Scene, layout: Layout) -> float:
    """Of the first V-joint with its two rods; infinite without stops or V-joints."""
    opening, stop = layout.openings[0][0], scene.stop
    if stop is None or not isinstance(opening, JointOpening):
        return math.inf
    joint = layout.joints[opening.joint]
    sides = [mount for mount in (joint.first, joint.second) if isinstance(mount, OnRod)]
    rods = [(r, sum(mass for _, mass, _ in r.masses)) for r in (layout.rods[s.rod] for s in sides)]
    inertia = sum((rod.mass / 3.0 + ends) * rod.length**2 for rod, ends in rods)
    return _swing_step(inertia, stop.stiffness, 20)
