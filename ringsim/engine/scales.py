"""Scales of a scene that the step control starts from."""

from __future__ import annotations

import math

import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.cables import CableDrive
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.parts.persection import spread
from ringsim.scene import Scene
from ringsim.theory.ideal_ring import IdealRing


def usual_rate(scene: Scene) -> float:
    """Mean opening rate in rad/s if the initial acceleration of the ideal ring lasted."""
    ring = scene.structure
    travel = math.pi - math.radians(ring.opening_angle)
    pull = 2.0 * abs(IdealRing.of(scene).acceleration_from_rest(ring.initial_phi))
    return max(math.sqrt(0.5 * pull * travel), travel / scene.solver.end_time)


def usual_energy(scene: Scene) -> float:
    """Kinetic energy in J of the ideal ring, as stowed, at its usual rate."""
    ring = scene.structure
    inertia = float(IdealRing.of(scene).motion(ring.initial_phi).inertia)
    return 0.5 * inertia * (0.5 * usual_rate(scene)) ** 2


def slight_energy(cables: CableDrive) -> float:
    """Energy in J that does not matter: a tenth of the slack width pulled along every path."""
    content = np.abs(cables.ropes.content)
    widths = np.array([cable.slack_width for cable in cables.chain.cables])
    return 0.1 * float(np.sum(widths * content))


def contact_step(built: Built) -> float:
    """Step that resolves a V-joint's bounce: a twentieth of its period on the stop's spring."""
    scene = built.ring.scene
    if scene.stop is None:
        return scene.solver.step
    rods, ring = scene.rods, scene.structure
    half = rods.density * rods.bar.area * ring.half_bar**3 / 3.0
    inertia = 2.0 * half + ring.vjoint_mass * ring.half_bar**2
    return 2.0 * math.pi * math.sqrt(inertia / scene.stop.stiffness) / 20.0


def rope_step(built: Built) -> float:
    """Step that resolves how the ring, as stowed, swings on taut ropes: a fiftieth of the period.

    A winch that starts at once throws the ring into that swing, often with the largest tension of
    the run; the first V-joint moves before the others, so that it is faster than the ideal ring's.
    Infinite without cables.
    """
    scene = built.ring.scene
    if built.cables is None:
        return math.inf
    ring = scene.structure
    inertia = 0.25 * float(IdealRing.of(scene).motion(ring.initial_phi).inertia)
    cables, content = built.cables.chain.cables, np.abs(built.cables.ropes.content)
    opening = math.pi - 2.0 * ring.initial_phi
    stiffness = sum(
        cable.axial_stiffness
        / float(length)
        * (ring.sections * float(cable.path_slope(ring.half_bar, opening))) ** 2
        for cable, length in zip(cables, content, strict=True)
    )
    return 2.0 * math.pi * math.sqrt(inertia / stiffness) / 50.0


def residual_tolerance(built: Built) -> float:
    """Residual norm in N at which Newton stops.

    ``newton_tolerance`` times the driving forces, but above what round-off lets the residual
    reach: the stiffest element's rate EA / L times coordinates of order 1 m, per coordinate.
    """
    scene = built.ring.scene
    drive = float(np.linalg.norm(built.forces))
    if scene.net is not None:
        stiffness = spread(scene.net.stiffness, len(built.ring.hinges[0]))
        drive += float(np.linalg.norm(stiffness)) * scene.net.neutral_length
    stiffest = max(
        np.max(scene.rods.young_modulus) * tube.area * scene.rods.elements / length
        for tube, length in (
            (scene.rods.diagonal, scene.structure.half_diagonal),
            (scene.rods.bar, scene.structure.half_bar),
        )
    )
    if scene.rods.damping > 0.0:
        stiffest *= STIFFENING
    size = built.ring.assembly.system.systemData.ODE2Size()
    round_off = 4.0 * np.finfo(float).eps * float(stiffest) * math.sqrt(size)
    return max(scene.solver.newton_tolerance * drive, round_off)
