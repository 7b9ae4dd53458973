"""Friction of the joint families and the stops of the V-joints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ringsim.engine.laws import SYMBOLIC, TORSION, symbolic_law
from ringsim.engine.pantograph_ring import RingModel
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.parts.stop.family import Stop


def add_friction(model: RingModel) -> None:
    """Friction connectors for the families that the scene names, and for no other."""
    laws = model.scene.joints.present()
    for joint in model.joints:
        if joint.family in laws:
            _add_friction(model, joint.markers, at_section(laws[joint.family], joint.section))


def _add_friction(model: RingModel, markers: tuple[Any, Any], law: JointFriction) -> None:
    damping = law.linear_damping()
    if damping is None:
        settings = symbolic_law(
            model.assembly, TORSION, law, lambda _angle, rate, _: law.torque(rate, SYMBOLIC)
        )
        model.assembly.torsion_spring(*markers, **settings)
    elif damping > 0.0:
        model.assembly.torsion_spring(*markers, damping=damping)


def add_stops(model: RingModel) -> list[list[Any]]:
    """A stop on every V-joint; returns the connectors, [plane][section].

    The angle is measured from the half-open joint, a quarter turn away, so that neither end of
    the range lies near the jump of the measured angle at 180 deg.
    """
    stop = model.scene.stop
    if stop is None:
        return []
    stops: list[list[Any]] = [[], []]
    for plane, sense in enumerate((1.0, -1.0)):
        c, s = math.cos(0.5 * math.pi), sense * math.sin(0.5 * math.pi)
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        settings = _stop_law(model, stop, sense)
        for joint in model.vjoints[plane]:
            first = model.assembly.node_marker(joint.gap[0], turned)
            stops[plane].append(model.assembly.torsion_spring(first, joint.markers[1], **settings))
    return stops


def latch(model: RingModel, connector: Any) -> None:
    """Make a stop act from both sides from now on."""
    # A stop has no use for the connector's offset; its law reads it as the latch's switch.
    model.assembly.system.SetObjectParameter(connector, "offset", 1.0)


def _stop_law(model: RingModel, stop: Stop, sense: float) -> dict[str, Any]:
    def torque(angle: Any, rate: Any, offset: Any) -> Any:
        folded = sense * angle + 0.5 * math.pi
        return sense * stop.torque(folded, sense * rate, offset > 0.5, SYMBOLIC).total

    return symbolic_law(model.assembly, TORSION, ("stop", sense), torque)
