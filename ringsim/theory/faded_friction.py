"""Whether the slip speed of a run reduced pulley friction, judged by the length wound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ringsim.cable import regularisation
from ringsim.scene import Scene
from ringsim.variables import PLANES, Outcome


def with_remark(outcome: Outcome, scene: Scene) -> Outcome:
    """The outcome; its reason names every cable whose pulley friction is reduced.

    A law with feedback finds its speed in the run, and a scene may set the slip speed, so this is
    judged afterwards, up to the deployment time; see ``ringsim.cable.regularisation``.
    """
    values = outcome.values
    if scene.cables is None or outcome.status.failed or "wound_length" not in values:
        return outcome
    times = outcome.coordinates["time"]
    deployed = float(values.get("deployment_time", np.array(np.nan)))
    before = times <= (deployed if np.isfinite(deployed) else np.inf)
    reason = outcome.reason
    for plane, cable in scene.cables.present():
        pulleys = scene.pulleys_of(cable)
        slip = cable.slip_speed_over(pulleys)
        wound = values["wound_length"][plane, before]
        speed = regularisation.usual_winding(times[before], wound)
        right_angle = np.full(pulleys, 0.5 * np.pi)
        decay = -cable.friction.log_decay(right_angle, cable.pulley_radius).min(initial=0.0)
        if speed == 0.0 or decay == 0.0:
            continue
        excess = regularisation.excess(slip, speed, pulleys, float(decay))
        if excess > regularisation.TOLERATED:
            reason += (
                f"; cables.{PLANES[plane]}.slip_speed = {slip:.2g} m/s is too fast for rope wound "
                f"at {speed:.2g} m/s: pulley friction fades, and the smallest tension is up to "
                f"{100.0 * excess:.0f} % too high (set it to at most "
                f"{regularisation.slip_speed(speed, pulleys):.2g} m/s)"
            )
    return replace(outcome, reason=reason)
