"""The ladder of an accuracy study: which numerical settings of a scene are compared.

Every rung changes what numbers say and nothing of what is simulated: step size, elements, rod
formulation, dissipation of the integrator, Newton's tolerance, fidelity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ringsim.choice import kind_of
from ringsim.scene import Scene

PATHS = (
    "solver.step_control",
    "solver.step",
    "solver.tolerance",
    "solver.spectral_radius",
    "solver.newton_tolerance",
    "rods.kind",
    "rods.elements",
)
"""Scene paths that a ladder varies."""
_TOLERANCES = (3e-3, 1e-3, 3e-4, 1e-4, 3e-5)
_FINE = 1e-5
"""Tolerance of the reference runs."""
_MOVING_STEPS = (0.4, 0.2, 0.1)
_CONSTANT_STEPS = (4.0, 2.0, 1.0)
"""Constant steps over solver.step, for scenes whose step moves and for those whose does not."""


@dataclass(frozen=True)
class Rung:
    """One setting.

    Attributes
    ----------
    ladder
        Which knob it turns: "as it stands", "tolerance", "constant step", "elements",
        "formulation", "dissipation", "newton", "combined", or "reference".
    label
        In words, unique in a ladder.
    size
        What an order of convergence refers to: a step in s, the root of a tolerance, or
        1 / elements; 0 where none does.
    values
        All of ``PATHS``.
    """

    ladder: str
    label: str
    size: float
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def stressed(self) -> bool:
        """Whether the rods' formulation tells stresses."""
        return str(self.values["rods.kind"]) != "ancf"


def ladder(scene: Scene) -> list[Rung]:
    """All rungs for a scene, the references last; some ladders share a setting.

    The references are a run with fine steps, the same with half the steps (``solver.tolerance``
    over 4), and the same with twice the elements: what Richardson's extrapolation in time and
    in space needs.
    """
    base = standing(scene)
    moving = scene.solver.step_control == "motion"
    found = [Rung("as it stands", "as it stands", 0.0, base)]

    def add(name: str, label: str, size: float, **changes: Any) -> None:
        values = base | {path.replace("__", "."): value for path, value in changes.items()}
        found.append(Rung(name, label, size, values))

    steps = _MOVING_STEPS if moving else _CONSTANT_STEPS
    for share in steps:
        step = float(f"{share * scene.solver.step:.6g}")
        add(
            "constant step",
            f"{step:g} s",
            step,
            solver__step_control="constant",
            solver__step=step,
        )
    if moving:
        for tolerance in _TOLERANCES:
            add("tolerance", f"{tolerance:g}", tolerance**0.5, solver__tolerance=tolerance)
    one = scene.rods.elements
    for elements in (one, 2 * one, 4 * one):
        add("elements", f"{elements}", 1.0 / elements, rods__elements=elements)
    if kind_of(scene.structure) == "pantograph-ring" and scene.cables is None:
        other = "ancf" if kind_of(scene.rods) != "ancf" else "geometrically-exact"
        for elements in (one, 2 * one):
            label = f"{other}, {elements}"
            add("formulation", label, 1.0 / elements, rods__kind=other, rods__elements=elements)
    for radius in (0.5, 0.8, 0.9, 0.95):
        add("dissipation", f"{radius:g}", 0.0, solver__spectral_radius=radius)
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        add("newton", f"{tolerance:g}", 0.0, solver__newton_tolerance=tolerance)
    if moving:
        for tolerance, newton in ((1e-3, 1e-3), (3e-4, 1e-3), (1e-4, 1e-3), (3e-5, 1e-4)):
            add(
                "combined",
                f"{tolerance:g}, newton {newton:g}",
                0.0,
                solver__tolerance=tolerance,
                solver__newton_tolerance=newton,
            )
    return found + _references(scene, base)


def standing(scene: Scene) -> dict[str, Any]:
    """The settings that a scene has."""
    solver = scene.solver
    return {
        "solver.step_control": solver.step_control,
        "solver.step": solver.step,
        "solver.tolerance": solver.tolerance,
        "solver.spectral_radius": solver.spectral_radius,
        "solver.newton_tolerance": solver.newton_tolerance,
        "rods.kind": kind_of(scene.rods),
        "rods.elements": scene.rods.elements,
    }


def _references(scene: Scene, base: Mapping[str, Any]) -> list[Rung]:
    elements, step = 2 * scene.rods.elements, scene.solver.step
    fine = {"rods.elements": elements, "solver.newton_tolerance": 1e-7}
    if scene.solver.step_control == "motion":
        coarse, halved = {"solver.tolerance": _FINE}, {"solver.tolerance": _FINE / 4.0}
    else:
        coarse, halved = {"solver.step": step / 4.0}, {"solver.step": step / 8.0}
    more = {"rods.elements": 2 * elements}
    return [
        Rung("reference", "fine", 0.0, {**base, **fine, **coarse}),
        Rung("reference", "half the steps", 0.0, {**base, **fine, **halved}),
        Rung("reference", "twice the elements", 0.0, {**base, **fine, **coarse, **more}),
    ]
