"""The ladder of an accuracy study: which numerical settings of a scene are compared.

Every rung changes what numbers say and nothing of what is simulated: step size, elements, rod
formulation, dissipation of the integrator, Newton's tolerance, fidelity.  Ladders that are to
show an order ("steps", "constant step", "elements", "formulation") solve each step so well that
nothing but the knob they turn is left; the others are settings that somebody might choose.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ringsim.choice import kind_of
from ringsim.parts.solver import NO_DEVIATIONS
from ringsim.scene import Scene

PATHS = (
    "solver.step_control",
    "solver.step",
    "solver.tolerance",
    "solver.deviation_tolerance",
    "solver.spectral_radius",
    "solver.newton_tolerance",
    "rods.kind",
    "rods.elements",
)
"""Scene paths that a ladder varies."""
STANDING = "as it stands"
_IN_TIME = ("x 1/4", "x 1/8", "x 1/16")
"""Labels of the three rungs of "steps" that the reference is made of."""
_HALVINGS = {"x 2": -1, "x 1": 0, "x 1/2": 1, "x 1/4": 2, "x 1/8": 3, "x 1/16": 4}
"""Rungs of "steps", by the factor on every step: the exponent of 1/2."""
_FINE, _MIDDLE = 3, 2
"""Halvings of the steps at which elements and rod formulations are compared."""
_TIGHT = 1e-6
"""Newton's tolerance, at most, of ladders that are to show an order."""
_TOLERANCE = (1e-8, 0.1)
_NEWTON = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
_RADII = (0.5, 0.8, 0.9, 0.95)
_CONSTANT_STEPS = (0.1, 0.05, 0.025)
"""Constant steps over solver.step, for scenes whose step moves."""
_SETTINGS = (
    (10.0, 1.0, 1), (10.0, 0.0, 1), (1.0 / 0.3, 1.0, 1), (1.0 / 0.3, 0.0, 1), (1.0 / 3.0, 1.0, 1),
    (1.0 / 3.0, 0.0, 1), (0.1, 1.0, 1), (0.1, 0.1, 1), (1.0 / 30.0, 0.1, 1), (0.01, 0.1, 1),
    (1.0, 1.0, 2), (1.0 / 3.0, 1.0, 2), (0.1, 0.1, 2), (1.0, 1.0, 4),
)  # fmt: skip
"""Settings to choose from: factors on solver.tolerance, on Newton's (0: as good as the ladders
that are to show an order have it), and on the elements."""


@dataclass(frozen=True)
class Rung:
    """One setting.

    Attributes
    ----------
    ladder
        Which knob it turns: "as it stands", "steps", "constant step", "elements",
        "formulation", "dissipation", "newton", "setting", or "fidelity".
    label
        In words, unique in a ladder.
    size
        What an order of convergence refers to: a step in s or over that of the scene, or
        1 / elements; 0 where none does.
    values
        All of ``PATHS``.
    """

    ladder: str
    label: str
    size: float
    values: Mapping[str, Any]

    @property
    def stressed(self) -> bool:
        """Whether the rods' formulation tells stresses."""
        return str(self.values["rods.kind"]) != "ancf"


def ladder(scene: Scene) -> list[Rung]:
    """All rungs for a scene; some ladders share a setting.

    Among them are those that a reference is made of (see :func:`references`).
    """
    base = standing(scene)
    found = [Rung(STANDING, STANDING, 0.0, base)]
    found += _steps(scene, base)
    if _moves(scene):
        found += _constant_steps(scene, base)
    found += _elements(scene, base)
    for radius in _RADII:
        found.append(_rung(base, "dissipation", f"{radius:g}", solver__spectral_radius=radius))
    for tolerance in _NEWTON:
        found.append(_rung(base, "newton", f"{tolerance:g}", solver__newton_tolerance=tolerance))
    return found + list(_settings(scene, base))


def standing(scene: Scene) -> dict[str, Any]:
    """The settings that a scene has."""
    solver = scene.solver
    return {
        "solver.step_control": solver.step_control,
        "solver.step": solver.step,
        "solver.tolerance": solver.tolerance,
        "solver.deviation_tolerance": _deviations(scene),
        "solver.spectral_radius": solver.spectral_radius,
        "solver.newton_tolerance": solver.newton_tolerance,
        "rods.kind": kind_of(scene.rods),
        "rods.elements": scene.rods.elements,
    }


def references(rungs: list[Rung]) -> tuple[list[int], list[int]]:
    """Places of the three rungs with ever finer steps, and of the three with ever more elements.

    Steps halve and elements double from one to the next.
    """
    in_time = [k for k, rung in enumerate(rungs) if rung.ladder == "steps"]
    in_time = [k for k in in_time if rungs[k].label in _IN_TIME]
    in_space = [k for k, rung in enumerate(rungs) if rung.ladder == "elements"]
    return in_time, in_space


def _moves(scene: Scene) -> bool:
    return scene.solver.step_control == "motion"


def _rung(
    base: Mapping[str, Any], name: str, label: str, size: float = 0.0, **changes: Any
) -> Rung:
    values = {path.replace("__", "."): value for path, value in changes.items()}
    return Rung(name, label, size, {**base, **values})


def _halved(scene: Scene, times: int) -> dict[str, Any]:
    """Every step halved so often, and each solved well; negative: doubled."""
    solver = scene.solver
    found: dict[str, Any] = {
        "solver__step": _short(min(solver.step * 0.5**times, solver.end_time)),
        "solver__newton_tolerance": min(solver.newton_tolerance, _TIGHT),
    }
    if _moves(scene):
        found["solver__tolerance"] = _within(solver.tolerance * 0.25**times)
        found["solver__deviation_tolerance"] = _deviations(scene, 0.25**times)
    return found


def _steps(scene: Scene, base: Mapping[str, Any]) -> list[Rung]:
    return [
        _rung(base, "steps", label, 0.5**times, **_halved(scene, times))
        for label, times in _HALVINGS.items()
    ]


def _constant_steps(scene: Scene, base: Mapping[str, Any]) -> list[Rung]:
    newton = min(scene.solver.newton_tolerance, _TIGHT)
    return [
        _rung(
            base, "constant step", f"{step:g} s", step,
            solver__step_control="constant", solver__step=step, solver__newton_tolerance=newton,
        )
        for step in (_short(share * scene.solver.step) for share in _CONSTANT_STEPS)
    ]  # fmt: skip


def _elements(scene: Scene, base: Mapping[str, Any]) -> list[Rung]:
    """More elements with fine steps; the other rod formulation with all but as fine ones."""
    one, own = scene.rods.elements, kind_of(scene.rods)
    other = "ancf" if own != "ancf" else "geometrically-exact"
    comparable = kind_of(scene.structure) == "pantograph-ring" and scene.cables is None
    found = []
    for name, kind, halvings in (("elements", own, _FINE), ("formulation", other, _MIDDLE)):
        if kind != own and not comparable:
            continue
        for elements in (one, 2 * one, 4 * one):
            label = f"{elements}" if kind == own else f"{kind}, {elements}"
            changes = {"rods__kind": kind, "rods__elements": elements}
            found.append(
                _rung(base, name, label, 1.0 / elements, **_halved(scene, halvings), **changes)
            )
    return found


def _settings(scene: Scene, base: Mapping[str, Any]) -> Iterator[Rung]:
    """What somebody might choose: coarser or finer steps, Newton to match, more elements."""
    solver = scene.solver
    for coarser, newtons, more in _SETTINGS:
        tight = min(solver.newton_tolerance, _TIGHT)
        newton = float(f"{max(newtons * solver.newton_tolerance, tight):.6g}")
        elements = more * scene.rods.elements
        changes: dict[str, Any] = {"solver__newton_tolerance": newton, "rods__elements": elements}
        if _moves(scene):
            tolerance = _within(coarser * solver.tolerance)
            if tolerance == solver.tolerance and coarser != 1.0:
                continue  # the scene stands at the end of what is allowed
            changes["solver__tolerance"] = tolerance
            changes["solver__deviation_tolerance"] = _deviations(scene, coarser)
            label = f"tolerance {tolerance:g}"
        else:
            step = min(coarser**0.5 * solver.step, solver.end_time)
            step = solver.step if coarser == 1.0 else float(f"{step:.2g}")
            changes["solver__step"] = step
            label = f"step {step:g} s"
        if newton != solver.newton_tolerance:
            label += f", newton {newton:g}"
        if more > 1:
            label += f", {elements} elements"
        yield _rung(base, "setting", label, 0.0, **changes)


def _deviations(scene: Scene, factor: float = 1.0) -> float:
    """``solver.deviation_tolerance`` times a factor; not followed where the scene has no stress.

    A study looks at the stresses of every scene, which must not change the scene's steps.
    """
    if not scene.record.stress:
        return NO_DEVIATIONS
    return _short(scene.solver.deviations_scaled(factor))


def _within(tolerance: float) -> float:
    """A tolerance that a scene may have, in few digits."""
    low, high = _TOLERANCE
    return float(f"{min(max(tolerance, low), high):.6g}")


def _short(step: float) -> float:
    return float(f"{step:.6g}")
