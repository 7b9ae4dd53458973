"""A scene with what its temperatures make of it in place of them.

Engines know no temperature: they run the scene that this gives, so that a run at a temperature
equals, bit by bit, one whose values were written down.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from ringsim.parts.rods import LengthError
from ringsim.parts.temperature import RodTemperature
from ringsim.structures.family import HingeError

if TYPE_CHECKING:
    from ringsim.scene import Scene

Values = float | tuple[float, ...] | list[float]


def substituted(scene: "Scene") -> "Scene":
    """The scene without ``temperature``; itself if it has none."""
    heat = scene.temperature
    if heat is None:
        return scene
    values: dict[str, Any] = {}
    errors = scene.rods.length_error or LengthError()
    for group, warm in heat.rods():
        if warm.expansion != 0.0:
            for name, error in errors:
                if name.startswith(group):
                    values[f"rods.length_error.{name}"] = _longer(error, warm, heat.reference)
        if warm.stiffness is not None:
            path = "rods.young_modulus" if group == "diagonal" else "rods.bar_young_modulus"
            values[path] = _times(scene.rods.young_of(group), warm.stiffness.at(warm.value))
    if heat.diagonal is not None and heat.diagonal.stiffness is not None:
        # The bars' modulus is that of the diagonals unless it stands there.
        values.setdefault("rods.bar_young_modulus", _plain(scene.rods.young_of("bar")))
    ring: Any = scene.structure
    pins = "hinge_error" in type(ring).model_fields
    if pins and heat.hinge is not None and heat.hinge.expansion != 0.0:
        for name, error in ring.hinge_error or HingeError():
            grown = np.asarray(heat.hinge.value) - heat.reference
            more = (ring.hinge_offset + np.asarray(error)) * heat.hinge.expansion * grown
            values[f"structure.hinge_error.{name}"] = _plain(np.asarray(error) + more)
    if heat.joint is not None:
        factors = heat.joint.friction.at(heat.joint.value)
        for family, law in scene.joints.present().items():
            for name in law.proportional:
                path = f"joints.{family}.{name}"
                values[path] = _times(getattr(law, name), factors)
    if heat.pulley is not None and scene.cables is not None:
        factor = heat.pulley.friction.at(heat.pulley.value)
        for plane, cable in scene.cables.present():
            if "coefficient" in type(cable.friction).model_fields:
                path = f"cables.{scene.structure.planes[plane]}.friction.coefficient"
                values[path] = _times(cable.friction.coefficients, factor)
    return scene.with_values(values | {"temperature": "none"})


def strained(scene: "Scene") -> str:
    """What a scene names that strains its rods before they move; empty if nothing."""
    if scene.rods.length_error is not None:
        return "rods.length_error"
    if field := scene.structure.strained_by():
        return f"structure.{field}"
    return "temperature" if scene.temperature is not None and scene.temperature.expands else ""


def _longer(error: Values, warm: RodTemperature, reference: float) -> Values:
    """Length errors with thermal expansion, (1 + e) (1 + a (T - T_0)) - 1."""
    heat = warm.expansion * (np.asarray(warm.value) - reference)
    return _plain(np.asarray(error) + heat + np.asarray(error) * heat)


def _times(value: Any, factors: Any) -> Values:
    return _plain(np.asarray(value) * np.asarray(factors))


def _plain(value: Any) -> Values:
    found = np.asarray(value, dtype=float)
    return found.tolist() if found.ndim else float(found)
