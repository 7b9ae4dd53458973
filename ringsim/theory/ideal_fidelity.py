"""The ideal fidelity: a scene run with a ring of rigid rods.

What rigid rods cannot represent is refused; the rest is integrated to tolerances far below those of
the full model (``ringsim.theory.ideal_course``): the two differ by what the rods' elasticity does.
"""

import time
from dataclasses import replace

import numpy as np

from ringsim.cable import regularisation
from ringsim.choice import kind_of
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.layout import layout_of
from ringsim.parts.faults.failed_latch import FailedLatch
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.parts.net.hub import SpringNet
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.scene.substituted import strained, substituted
from ringsim.theory.margin_along import with_margin
from ringsim.threads import one_thread
from ringsim.variables import PLANES, Cause, Outcome, Status

_LIGHT_HUB = 1e-3
"""Largest mass of the net's hub over the ring's."""
_CENTRED = 0.05
"""Largest pull of a stretched net on a hub in the middle over the sum of its strings' pulls."""


def refuse_if_not_ideal(scene: Scene) -> None:
    """Refuse what rigid rods cannot represent.

    Raises
    ------
    InputError
        One line with the field, the reason and the cure.
    """
    scene, cure = substituted(scene), "(leave it out, or use the full fidelity)"
    kind = kind_of(scene.structure)
    if kind != "pantograph-ring":
        raise InputError(
            f'structure.kind = "{kind}": the ideal fidelity supports only the pantograph ring '
            "(use the full fidelity)"
        )
    for number, fault in enumerate(scene.faults, 1):
        if isinstance(fault, StuckVJoint):
            raise InputError(
                f'faults[{number}].kind = "{fault.kind}": with rigid rods one stuck V-joint stops '
                f"the whole ring, so the ideal fidelity does not support it {cure}"
            )
        if isinstance(fault, FailedLatch):
            raise InputError(
                f'faults[{number}].kind = "{fault.kind}": with rigid rods the other latches hold '
                f"that joint, too, so the ideal fidelity does not support it {cure}"
            )
    if scene.loads is not None and scene.loads.reversal_time is not None:
        raise InputError(
            f"loads.reversal_time = {scene.loads.reversal_time:g} s: loads of the ideal fidelity "
            f"keep their sign {cure}"
        )
    if scene.latch is not None and np.ptp(scene.latch.min_rate) > 0.0:
        raise InputError(
            "latch.min_rate: latches of the ideal fidelity catch all together: give one value for "
            "all, or use the full fidelity"
        )
    if scene.record.stress:
        raise InputError(
            "record.stress = true: rigid rods carry no stress in the ideal fidelity (set it to "
            "false, or use the full fidelity)"
        )
    if scene.record.positions:
        raise InputError(
            "record.positions = true: the ideal ring's shape follows from its one opening angle, "
            "and what it floats along is not integrated (set it to false: drawings need none, or "
            "use the full fidelity)"
        )
    if scene.record.shape:
        raise InputError(
            "record.shape = true: the ideal ring opens to its drawing (set it to false, or use the "
            "full fidelity)"
        )
    if what := strained(scene):
        raise InputError(
            f"{what}: rods that are not as long as drawn, or held at other angles, strain each "
            "other, or let sections open differently: those of the ideal ring do neither (thermal "
            "expansion makes rods longer, too) " + cure
        )
    if scene.offload is not None:
        raise InputError(
            "offload: lines, trolleys and their friction are no part of the ideal fidelity " + cure
        )
    if not isinstance(scene.net, SpringNet):
        return
    net, layout = scene.net, layout_of(scene)
    corners = np.array([layout.bodies[number].pose.place for number in layout.corners[0]])
    aside = FreeHub(net, len(corners)).imbalance(corners)
    if net.damping > 0.0 and aside > _CENTRED:
        raise InputError(
            f"net.damping = {net.damping:g} N s/m: the net's pulls on its hub are out of balance "
            f"by {100.0 * aside:.0f} % of their sum, and the ideal fidelity finds the hub from the "
            "springs alone (set it to 0, use one net.stiffness and a closed ring, or use the full "
            "fidelity)"
        )
    total = layout.masses()["hinges"]
    if net.hub_mass > _LIGHT_HUB * total:
        raise InputError(
            f"net.hub_mass = {net.hub_mass:g} kg must be at most {_LIGHT_HUB * total:.2g} kg in "
            "the ideal fidelity, which neglects its inertia (lower it, or use the full fidelity)"
        )


@one_thread()
def run_ideal(scene: Scene) -> Outcome:
    """Integrate the ideal ring of a scene; it always ends with a status.

    The outcome has the variables of the full model where they exist; all sections open alike.

    Raises
    ------
    InputError
        If the ideal ring cannot represent the scene.
    """
    scene = substituted(scene)
    refuse_if_not_ideal(scene)
    # Here: only this fidelity needs scipy's integrators and splines, which load in half a second.
    from ringsim.theory.ideal_course import Course
    from ringsim.theory.ideal_outcome import to_outcome

    wall, cpu = time.perf_counter(), time.process_time()
    with np.errstate(all="ignore"):
        try:
            outcome = to_outcome(Course(scene).run(), scene)
        except ValueError as error:  # the cables have no answer at the very start
            reason = f"the ideal ring has no answer: {error}"
            outcome = Outcome(Status.SOLVER_FAILED, reason, cause=Cause.REFUSED)
    outcome.values["wall_time"] = np.array(time.perf_counter() - wall)
    outcome.values["cpu_time"] = np.array(time.process_time() - cpu)
    return with_remark(with_margin(outcome, scene), scene)


def with_remark(outcome: Outcome, scene: Scene) -> Outcome:
    """The outcome; its reason ends with the cables whose pulley friction is reduced, if any.

    A law with feedback finds its speed in the run, and a scene may set the slip speed, so this is
    judged afterwards, by the length wound until deployed; see ``ringsim.cable.regularisation``.
    """
    values = outcome.values
    if scene.cables is None or outcome.status.failed or "wound_length" not in values:
        return outcome
    times, faded = outcome.coordinates["time"], dict[str, tuple[float, float, float]]()
    before = ~(times > values.get("deployment_time", np.nan))
    for plane, cable in scene.cables.present():
        pulleys = scene.pulleys_of(cable)
        slip = cable.slip_speed_over(pulleys)
        speed = regularisation.usual_winding(times[before], values["wound_length"][plane, before])
        right_angle = np.full(pulleys, 0.5 * np.pi)
        decay = -cable.friction.log_decay(right_angle, cable.pulley_radius).min(initial=0.0)
        excess = regularisation.excess(slip, speed, pulleys, float(decay))
        if speed > 0.0 and excess > regularisation.TOLERATED:
            most = regularisation.slip_speed(speed, pulleys)
            faded[f"cables.{PLANES[plane]}.slip_speed"] = slip, most, 100.0 * excess
    if not faded:
        return outcome
    slips, bounds, excesses = zip(*faded.values(), strict=True)
    remark = (
        f"; pulley friction fades, tension up to {max(excesses):.0f} % too high: "
        f"{' and '.join(faded)} = {max(slips):.2g} m/s must be at most {min(bounds):.2g} m/s"
    )
    return replace(outcome, reason=outcome.reason + remark)
