"""Reference numbers of a ring, as its run's control needs them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.stepping import scales
from ringsim.theory.ideal_ring import IdealRing


def ring_scales(built: Built) -> scales.Scales:
    """What the ideal ring, as stowed, the stops and the cables of a model say before its run."""
    scene = built.ring.scene
    ring, rods, ideal = scene.structure, scene.rods, IdealRing.of(scene)
    travel = math.pi - math.radians(ring.opening_angle)
    # The opening angle is pi - 2 phi: twice the rates of the ideal ring, a quarter of its inertia.
    acceleration = 2.0 * ideal.acceleration_from_rest(ring.initial_phi)
    inertia = 0.25 * ideal.motion(ring.initial_phi).inertia
    rate = scales.reference_rate(acceleration, travel, scene.solver.end_time)
    found = scales.Scales(rate, 0.5 * inertia * rate**2, travel, ring.half_bar)
    if scene.stop is not None:
        half = rods.density * rods.bar.area * ring.half_bar**3 / 3.0
        bouncing = 2.0 * half + ring.vjoint_mass * ring.half_bar**2
        step = scales.contact_step(bouncing, scene.stop.stiffness)
        found = replace(found, contact_step=step)
    if built.cables is not None:
        cables, lengths = built.cables.chain.cables, np.abs(built.cables.ropes.content)
        widths = np.array([cable.slack_width for cable in cables])
        opening = math.pi - 2.0 * ring.initial_phi
        stiffness = sum(
            cable.axial_stiffness
            / float(length)
            * (ring.sections * float(cable.path_slope(ring.half_bar, opening))) ** 2
            for cable, length in zip(cables, lengths, strict=True)
        )
        found = replace(
            found,
            first_step=scales.rope_step(inertia, stiffness),
            slack_tension=float(widths.max()),
            slack_energy=0.1 * float(np.sum(widths * lengths)),  # a tenth of it along every path
        )
    return found


def residual_tolerance(built: Built) -> float:
    """Residual norm in N at which Newton stops, from loads, net and the stiffest element."""
    scene = built.ring.scene
    drive = float(np.linalg.norm(built.forces))
    if scene.net is not None and built.net is not None:
        drive += float(np.linalg.norm(built.net.stiffness)) * scene.net.neutral_length
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
    share = scene.solver.newton_tolerance
    return scales.residual_tolerance(share, drive, float(stiffest), size)
