"""Friction of the joint families and the stops of the V-joints."""

from __future__ import annotations

import math
from typing import Any

from ringsim.engine.laws import SYMBOLIC, TORSION, symbolic_law
from ringsim.engine.model import Model
from ringsim.layout.pose import turned_about_z
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.parts.stop.family import Stop


def add_friction(model: Model) -> None:
    """Friction connectors for the families that the scene names, and for no other."""
    laws = model.scene.joints.present()
    for joint in model.joints:
        if joint.family in laws:
            _add_friction(model, joint.markers, at_section(laws[joint.family], joint.section))


def _add_friction(model: Model, markers: tuple[Any, Any], law: JointFriction) -> None:
    damping = law.linear_damping()
    if damping is None:
        settings = symbolic_law(
            model.assembly, TORSION, law, lambda _angle, rate, _: law.torque(rate, SYMBOLIC)
        )
        model.assembly.torsion_spring(*markers, **settings)
    elif damping > 0.0:
        model.assembly.torsion_spring(*markers, damping=damping)


def add_stops(model: Model) -> list[list[Any]]:
    """A stop on every V-joint; returns the connectors, [plane][section].

    The angle is measured from the half-open joint, a quarter turn away, so that neither end of
    the range lies near the jump of the measured angle at 180 deg.
    """
    stop = model.scene.stop
    if stop is None:
        return []
    stops: list[list[Any]] = []
    for plane in model.openings():
        stops.append([])
        for joint, sense in plane:
            first = model.assembly.node_marker(
                joint.nodes[0], turned_about_z(sense * 0.5 * math.pi)
            )
            settings = _stop_law(model, stop, sense)
            stops[-1].append(model.assembly.torsion_spring(first, joint.markers[1], **settings))
    return stops


def latch(model: Model, connector: Any) -> None:
    """Make a stop act from both sides from now on."""
    # A stop has no use for the connector's offset; its law reads it as the latch's switch.
    model.assembly.system.SetObjectParameter(connector, "offset", 1.0)


def _stop_law(model: Model, stop: Stop, sense: float) -> dict[str, Any]:
    def torque(angle: Any, rate: Any, offset: Any) -> Any:
        folded = sense * angle + 0.5 * math.pi
        return sense * stop.torque(folded, sense * rate, offset > 0.5, SYMBOLIC).total

    return symbolic_law(model.assembly, TORSION, ("stop", sense), torque)
