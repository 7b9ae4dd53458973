"""Reference numbers of a structure, as its run's control needs them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.layout.bodies import OnRod
from ringsim.layout.joints import JointOpening
from ringsim.layout.layout import Layout
from ringsim.stepping import scales
from ringsim.theory.one_coordinate import OneCoordinate

_SLIGHT = 1e-3
"""Energy that does not matter, over the largest force of a structure's springs along a rod."""


def scales_of(built: Built) -> scales.Scales:
    """What the structure with rigid rods, its stops and its cables say before the run."""
    scene, layout = built.model.scene, built.model.layout
    structure, ideal = scene.structure, OneCoordinate(scene)
    angles, rates = layout.opening_angles()
    travel, turn = math.pi - float(angles.mean()), abs(float(rates.mean()))
    acceleration = turn * ideal.acceleration_from_rest(structure.coordinate)
    inertia = ideal.motion(structure.coordinate).inertia / turn**2
    rate = scales.reference_rate(acceleration, travel, scene.solver.end_time)
    # Springs of its own set a scale of their own: what they would do along a rod.
    energy = _SLIGHT * structure.push * structure.reach or 0.5 * inertia * rate**2
    found = scales.Scales(rate, energy, travel, structure.reach)
    if scene.stop is not None:
        step = scales.contact_step(_bouncing(layout), scene.stop.stiffness)
        found = replace(found, contact_step=step)
    if built.cables is not None and scene.cables is not None:
        cables, lengths = scene.cables.present(), np.abs(built.cables.ropes.content)
        widths = np.array([cable.slack_width for _, cable in cables])
        stiffness = sum(
            cable.axial_stiffness / float(length) * structure.path_slope(cable, angles[plane]) ** 2
            for (plane, cable), length in zip(cables, lengths, strict=True)
        )
        found = replace(
            found,
            first_step=scales.rope_step(inertia, stiffness),
            slack_tension=float(widths.max()),
            slack_energy=0.1 * float(np.sum(widths * lengths)),  # a tenth of it along every path
        )
    return found


def _bouncing(layout: Layout) -> float:
    """Inertia of the two rods of the first joint that opens, about it, kg m^2."""
    opening = layout.openings[0][0]
    if not isinstance(opening, JointOpening):
        return math.inf
    joint, inertia = layout.joints[opening.joint], 0.0
    for mount in (joint.first, joint.second):
        if isinstance(mount, OnRod):
            rod = layout.rods[mount.rod]
            ends = sum(mass for _, mass in rod.masses)
            inertia += (rod.mass / 3.0 + ends) * rod.length**2
    return inertia


def residual_tolerance(built: Built) -> float:
    """Residual norm in N at which Newton stops, from loads, springs and the stiffest element."""
    scene, layout = built.model.scene, built.model.layout
    drive = float(np.linalg.norm([force for _, force in layout.forces])) + scene.structure.push
    if scene.net is not None and layout.net is not None:
        drive += float(np.linalg.norm(layout.net.stiffness)) * scene.net.neutral_length
    stiffest = max(rod.young_modulus * rod.tube.area / rod.shortest for rod in layout.rods)
    if scene.rods.damping > 0.0:
        stiffest *= STIFFENING
    size = built.model.assembly.system.systemData.ODE2Size()
    return scales.residual_tolerance(scene.solver.newton_tolerance, drive, stiffest, size)
