"""The ideal fidelity: a scene answered by its one coordinate, in a fraction of a second.

With rigid rods the ring has one degree of freedom.  What that cannot represent is refused; what
it can is integrated to tolerances far below those of the full model
(``ringsim.theory.ideal_steps``), so that the difference of the two is what the rods' elasticity
does.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from ringsim.cable.bracket.bisector import BisectorBracket
from ringsim.choice import kind_of
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.parts.persection import spread
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.faded_friction import with_remark
from ringsim.theory.ideal_batch import Batch, equal_cables
from ringsim.theory.ideal_outcome import to_outcome
from ringsim.theory.ideal_ring import IdealRing
from ringsim.theory.ideal_steps import Integration
from ringsim.variables import Outcome

MOST_AT_ONCE = 64
"""Samples that are integrated together; more would only take memory."""
_LIGHT_HUB = 1e-3
"""Largest mass of the net's hub over the ring's."""
_CENTRED = 0.05
"""Largest pull of a stretched net on a hub in the middle over the sum of its strings' pulls."""


def refuse_if_not_ideal(scene: Scene) -> None:
    """Refuse what one coordinate cannot represent.

    Raises
    ------
    InputError
        One line with the field, the reason and the cure.
    """
    cure = "(leave it out, or use the full fidelity)"
    kind = kind_of(scene.structure)
    if kind != "pantograph-ring":
        raise InputError(
            f'structure.kind = "{kind}": the ideal fidelity knows the pantograph ring alone, whose '
            "rigid rods leave one coordinate (use the full fidelity)"
        )
    for number, fault in enumerate(scene.faults, 1):
        if isinstance(fault, StuckVJoint):
            raise InputError(
                f'faults[{number}].kind = "{fault.kind}": with rigid rods one stuck V-joint stops '
                f"the whole ring, so the ideal fidelity has no answer {cure}"
            )
    for _, cable in [] if scene.cables is None else scene.cables.present():
        if not isinstance(cable.bracket, BisectorBracket):
            raise InputError(
                f'cables: bracket.kind = "{kind_of(cable.bracket)}": the ideal fidelity knows '
                'pulleys on the bisector alone (choose "bisector", or use the full fidelity)'
            )
    if scene.record.stress:
        raise InputError(
            "record.stress = true: rigid rods carry no stress in the ideal fidelity (set it to "
            "false, or use the full fidelity)"
        )
    if scene.net is not None:
        _refuse_net(scene)


def _refuse_net(scene: Scene) -> None:
    ring, net = IdealRing.of(scene), scene.net
    if net is None:
        return
    plan = ring.geometry.plan
    arms = plan - plan.mean(axis=0)
    arms = arms / np.linalg.norm(arms, axis=1)[:, None]
    stiffness = spread(net.stiffness, len(plan))
    aside = float(np.linalg.norm(stiffness @ arms))
    if aside > _CENTRED * float(stiffness.sum()):
        raise InputError(
            f"net.stiffness: its pulls on the hub are out of balance by "
            f"{100.0 * aside / stiffness.sum():.0f} % of their sum, and the ideal fidelity keeps "
            "the hub in the middle (use one stiffness and a closed ring, or the full fidelity)"
        )
    total = 2.0 * len(plan) * scene.structure.corner_mass
    if net.hub_mass > _LIGHT_HUB * total:
        raise InputError(
            f"net.hub_mass = {net.hub_mass:g} kg must be at most {_LIGHT_HUB * total:.2g} kg in "
            "the ideal fidelity, which leaves its inertia out (lower it, or use the full fidelity)"
        )


def run_ideal(scene: Scene) -> Outcome:
    """Integrate the ideal ring of a scene.

    Returns
    -------
    Outcome
        The variables of the full model where they exist; all sections open alike.

    Raises
    ------
    InputError
        If the ideal ring cannot represent the scene.
    """
    return run_ideal_many([scene])[0]


def run_ideal_many(scenes: Sequence[Scene]) -> list[Outcome]:
    """Integrate many scenes, those with the same structure of the problem together.

    Together go scenes with the same number of sections, cables at the same ends with the same
    kinds of friction, and faults of the same kinds at the same places in the same order; any
    number in them may differ.  Each sample keeps its own steps, so its numbers do not depend on
    its company but for round-off (feedback laws: nothing at all).

    Parameters
    ----------
    scenes
        In any order.

    Returns
    -------
    list of Outcome
        In the order of ``scenes``.  ``wall_time`` and ``cpu_time`` of a sample are its share of
        its batch's.

    Raises
    ------
    InputError
        If the ideal ring cannot represent one of the scenes.
    """
    groups: dict[str, list[int]] = {}
    for number, scene in enumerate(scenes):
        refuse_if_not_ideal(scene)
        groups.setdefault(_likeness(scene), []).append(number)
    found: dict[int, Outcome] = {}
    for members in groups.values():
        for first in range(0, len(members), MOST_AT_ONCE):
            own = members[first : first + MOST_AT_ONCE]
            found.update(zip(own, _run_alike([scenes[k] for k in own]), strict=True))
    return [found[number] for number in range(len(scenes))]


def _run_alike(scenes: list[Scene]) -> list[Outcome]:
    wall, cpu = time.perf_counter(), time.process_time()
    courses = Integration(Batch(scenes)).run()
    common_wall = (time.perf_counter() - wall) / len(scenes)
    common_cpu = (time.process_time() - cpu) / len(scenes)
    outcomes = []
    for course, scene in zip(courses, scenes, strict=True):
        wall, cpu = time.perf_counter(), time.process_time()
        outcome = to_outcome(course, scene, wall_time=0.0, cpu_time=0.0)
        outcome.values["wall_time"] = np.array(common_wall + time.perf_counter() - wall)
        outcome.values["cpu_time"] = np.array(common_cpu + time.process_time() - cpu)
        outcomes.append(with_remark(outcome, scene))
    return outcomes


def _likeness(scene: Scene) -> str:
    """What two scenes must have in common to be integrated together."""
    structure, cables = scene.structure, scene.cables
    present = [] if cables is None else cables.present()
    faults = [
        (kind_of(f), sorted(f.model_dump(exclude={"time", "kind"}).items()))
        for f in sorted(scene.faults, key=lambda f: f.time)
    ]
    return repr(
        (
            structure.sections,
            structure.closed,
            [(plane, cable.end, kind_of(cable.friction)) for plane, cable in present],
            equal_cables(scene),
            faults,
        )
    )
