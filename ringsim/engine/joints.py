"""Friction of the joint families and the stops of the V-joints."""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.model import Model
from ringsim.parts.joints import JointFriction, Stop
from ringsim.parts.persection import spread

Array = NDArray[np.float64]
_TORSION = "ObjectConnectorTorsionalSpringDamper"
_ONSET = 1e-3
"""Depth in rad over which the damping of a stop comes in, so that contact starts smoothly."""


def add_friction(model: Model) -> None:
    """Friction connectors for the families that the scene names, and for no other."""
    sections = model.scene.structure.sections
    laws = model.scene.joints
    families: dict[str, JointFriction | None] = {
        "pivot": laws.pivot,
        "hinge": laws.hinge,
        "vjoint": laws.vjoint,
    }
    for joint in model.joints:
        law = families.get(joint.family)
        if law is None:
            continue
        viscous = float(spread(law.viscous, sections)[joint.section])
        coulomb = float(spread(law.coulomb, sections)[joint.section])
        if coulomb > 0.0:
            function = model.assembly.symbolic(
                ("friction", viscous, coulomb, law.rate),
                _friction_law(viscous, coulomb, law.rate),
                _TORSION,
                "springTorqueUserFunction",
            )
            model.assembly.torsion_spring(*joint.markers, springTorqueUserFunction=function)
        elif viscous > 0.0:
            model.assembly.torsion_spring(*joint.markers, damping=viscous)


def friction_torque(
    law: JointFriction, section: NDArray[np.int64], sections: int, rate: Array
) -> Array:
    """The same law in numpy, for the energy balance; N m, against ``rate`` in rad/s."""
    viscous = spread(law.viscous, sections)[section]
    coulomb = spread(law.coulomb, sections)[section]
    return np.asarray(viscous * rate + coulomb * np.tanh(rate / law.rate))


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
            first = model.assembly.node_marker(joint.nodes[0], _about_z(sense * 0.5 * math.pi))
            function = model.assembly.symbolic(
                ("stop", sense), _stop_law(stop, sense), _TORSION, "springTorqueUserFunction"
            )
            stops[-1].append(
                model.assembly.torsion_spring(
                    first, joint.markers[1], springTorqueUserFunction=function
                )
            )
    return stops


def latch(model: Model, connector: Any) -> None:
    """Make a stop act from both sides from now on."""
    model.assembly.system.SetObjectParameter(connector, "offset", 1.0)


def stop_torque(stop: Stop, folded: Array, rate: Array, latched: Array) -> Array:
    """The same law in numpy; torque in N m that opens (> 0) or folds (< 0) the joint.

    Parameters
    ----------
    folded, rate
        Angle by which the halves are folded (pi - opening angle, rad) and its rate.
    latched
        Whether the latch holds, bool.

    """
    stowed = math.pi - math.radians(stop.stowed_angle)
    deep, high = np.maximum(-folded, 0.0), np.maximum(folded - stowed, 0.0)
    k, d = stop.stiffness, stop.damping
    ends = np.maximum(k * deep - d * rate * np.minimum(deep / _ONSET, 1.0), 0.0) - np.maximum(
        k * high + d * rate * np.minimum(high / _ONSET, 1.0), 0.0
    )
    return -np.where(latched, -(k * folded + d * rate), ends)


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _friction_law(viscous: float, coulomb: float, regular: float) -> Any:
    def law(
        mbs: Any, t: Any, itemNumber: Any, rotation: Any, angularVelocity: Any,  # noqa: N803
        stiffness: Any, damping: Any, offset: Any,
    ) -> Any:  # fmt: skip
        rate = angularVelocity
        return viscous * rate + coulomb * exu.symbolic.tanh(rate / regular)

    return law


def _stop_law(stop: Stop, sense: float) -> Any:
    k, d = stop.stiffness, stop.damping
    stowed = math.pi - math.radians(stop.stowed_angle)

    def law(
        mbs: Any, t: Any, itemNumber: Any, rotation: Any, angularVelocity: Any,  # noqa: N803
        stiffness: Any, damping: Any, offset: Any,
    ) -> Any:  # fmt: skip
        least, most, choose = exu.symbolic.min, exu.symbolic.max, exu.symbolic.IfThenElse
        folded = sense * rotation + 0.5 * math.pi
        rate = sense * angularVelocity
        deep, high = most(-folded, 0.0), most(folded - stowed, 0.0)
        ends = most(k * high + d * rate * least(high / _ONSET, 1.0), 0.0) - most(
            k * deep - d * rate * least(deep / _ONSET, 1.0), 0.0
        )
        return sense * choose(offset > 0.5, k * folded + d * rate, ends)

    return law
