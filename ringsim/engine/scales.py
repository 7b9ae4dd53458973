"""Scales of a scene that the step control starts from."""

from __future__ import annotations

import math

import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.cables import CableDrive
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.layout.bodies import OnRod
from ringsim.layout.joints import JointOpening
from ringsim.layout.of_scene import layout_of
from ringsim.scene import Scene
from ringsim.theory.one_coordinate import OneCoordinate

_SLIGHT = 1e-3
"""Energy that does not matter, over the largest force of a structure's springs along a rod."""


def usual_rate(scene: Scene) -> float:
    """Mean opening rate in rad/s if the initial acceleration of the ideal structure lasted."""
    angles, rates = layout_of(scene).opening_angles()
    travel = math.pi - float(angles.mean())
    pull = abs(float(rates.mean())) * abs(_ideal(scene)[0])
    return max(math.sqrt(0.5 * pull * travel), travel / scene.solver.end_time)


def usual_energy(scene: Scene) -> float:
    """Kinetic energy in J of the ideal structure, as stowed, at its usual rate.

    Springs of its own set their own scale: what they would do along a rod.
    """
    if scene.structure.push > 0.0:
        return _SLIGHT * scene.structure.push * scene.structure.reach
    rate = float(layout_of(scene).opening_angles()[1].mean())
    return 0.5 * _ideal(scene)[1] * (usual_rate(scene) / rate) ** 2


def _ideal(scene: Scene) -> tuple[float, float]:
    """Acceleration (rad/s^2) and inertia (kg m^2) of the one coordinate at the start."""
    ideal, q = OneCoordinate(scene), scene.structure.coordinate
    return ideal.acceleration_from_rest(q), ideal.motion(q).inertia


def slight_energy(cables: CableDrive) -> float:
    """Energy in J that does not matter: a tenth of the slack width pulled along every path."""
    content = np.abs(cables.ropes.content)
    widths = np.array([cable.slack_width for cable in cables.chain.cables])
    return 0.1 * float(np.sum(widths * content))


def contact_step(built: Built) -> float:
    """Step that resolves a V-joint's bounce: a twentieth of its period on the stop's spring."""
    model, scene = built.model, built.model.scene
    joints = [joint for plane in model.layout.openings for joint in plane]
    if scene.stop is None or not isinstance(joints[0], JointOpening):
        return scene.solver.step
    joint = model.layout.joints[joints[0].joint]
    inertia = 0.0
    for mount in (joint.first, joint.second):
        if isinstance(mount, OnRod):
            rod = model.layout.rods[mount.rod]
            ends = sum(mass for _, mass in rod.masses)
            inertia += (rod.mass / 3.0 + ends) * rod.length**2
    return 2.0 * math.pi * math.sqrt(inertia / scene.stop.stiffness) / 20.0


def rope_step(built: Built) -> float:
    """Step that resolves how the structure, as stowed, swings on taut ropes: a fiftieth of it.

    A winch that starts at once throws the ring into that swing, often with the largest tension of
    the run; the first V-joint moves before the others, so that it is faster than the ideal ring's.
    Infinite without cables.
    """
    scene, layout = built.model.scene, built.model.layout
    if built.cables is None:
        return math.inf
    angles, rates = layout.opening_angles()
    inertia = _ideal(scene)[1] / float(rates.mean()) ** 2
    cables, content = built.cables.chain.cables, np.abs(built.cables.ropes.content)
    stiffness = sum(
        cable.axial_stiffness
        / float(length)
        * scene.structure.path_slope(cable, angles[plane]) ** 2
        for plane, cable, length in zip(built.cables.planes, cables, content, strict=True)
    )
    return 2.0 * math.pi * math.sqrt(inertia / stiffness) / 50.0


def residual_tolerance(built: Built) -> float:
    """Residual norm in N at which Newton stops.

    ``newton_tolerance`` times the driving forces, but above what round-off lets the residual
    reach: the stiffest element's rate EA / L times coordinates of order 1 m, per coordinate.
    """
    scene, layout = built.model.scene, built.model.layout
    drive = float(np.linalg.norm([force for _, force in layout.forces])) + scene.structure.push
    if scene.net is not None and layout.net is not None:
        drive += float(np.linalg.norm(layout.net.stiffness)) * scene.net.neutral_length
    stiffest = max(rod.young_modulus * rod.tube.area / rod.shortest for rod in layout.rods)
    if scene.rods.damping > 0.0:
        stiffest *= STIFFENING
    size = built.model.assembly.system.systemData.ODE2Size()
    round_off = 4.0 * np.finfo(float).eps * float(stiffest) * math.sqrt(size)
    return max(scene.solver.newton_tolerance * drive, round_off)
