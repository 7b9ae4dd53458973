"""The ladder of an accuracy study: which numerical settings of a scene are compared.

Rungs differ in numerical settings only: step size, elements, rod formulation, dissipation of the
integrator, Newton's tolerance, fidelity.  Ladders that are to show an order of convergence
("steps", "constant step", "elements", "formulation") solve each step to a tight tolerance, so
that only the setting they vary has an effect; the others are settings that a user might choose.
The frame engine has rungs of its own (``by_frames``) with the settings of the full one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.choice import kind_of
from ringsim.overrides import field_at
from ringsim.parts.solver import NO_DEVIATIONS
from ringsim.refusal import InputError
from ringsim.scene import Scene

PATHS = (
    "solver.step_control", "solver.step", "solver.tolerance", "solver.deviation_tolerance",
    "solver.spectral_radius", "solver.newton_tolerance", "rods.kind", "rods.elements",
)  # fmt: skip
"""Scene paths that a ladder varies."""
STANDING = "as it stands"
FRAME = "frame"
GRADED = ("steps", "elements")
"""Ladders that the reference is made of."""
_HALVINGS = {"x 2": -1, "x 1": 0, "x 1/2": 1, "x 1/4": 2, "x 1/8": 3, "x 1/16": 4}
"""Rungs of "steps" by the factor on every step, with the exponent of 1/2."""
_OF_ELEMENTS = 1.0 / 8.0
"""Factor on every step of the rungs of "elements"."""
_OF_BRIEF = 1.0 / 4.0
"""The same of a brief study, and of its finest steps."""
_STEPS = ("solver.step", "solver.tolerance", "solver.deviation_tolerance")
_LEVELS = 3
"""Levels from which a limit is extrapolated."""
_TIGHT = 1e-6
"""Newton's tolerance, at most, of ladders that are to show an order."""
_SETTINGS = (
    (10.0, 1.0, 1), (10.0, 0.0, 1), (1.0 / 0.3, 1.0, 1), (1.0 / 0.3, 0.0, 1), (1.0 / 3.0, 1.0, 1),
    (1.0 / 3.0, 0.0, 1), (0.1, 1.0, 1), (0.1, 0.1, 1), (1.0 / 30.0, 0.1, 1), (0.01, 0.1, 1),
    (1.0, 1.0, 2), (1.0 / 3.0, 1.0, 2), (0.1, 0.1, 2), (1.0, 1.0, 4), (1.0, 1.0, 8), (0.1, 0.1, 8),
)  # fmt: skip
"""Settings to choose from: factors on solver.tolerance, on Newton's tolerance (0: ``_TIGHT``), and
on the number of elements."""


@dataclass(frozen=True)
class Rung:
    """One setting: a value for each of ``PATHS``, and a fidelity.

    ``ladder`` says what it varies ("as it stands", "steps", "constant step", "elements",
    "formulation", "dissipation", "newton" or "setting"), ``label`` is unique in a
    ladder, and ``size`` is what an order of convergence refers to: a step in s or over that of the
    scene, or 1 / elements; 0 where none does.
    """

    ladder: str
    label: str
    size: float
    values: Mapping[str, Any]
    fidelity: str = "full"


def shortened(rungs: Sequence[Rung]) -> list[Rung]:
    """The ladder of a brief study: reference and settings to choose from.

    None has steps shorter than a quarter of the scene's, at which its elements are, or more than
    twice the elements, and settings are tried at the scene's own kind of Newton's tolerance.
    """
    finest = next(r for r in rungs if r.ladder == "steps" and r.size == _OF_BRIEF)
    steps = {path: finest.values[path] for path in _STEPS}

    def kept(rung: Rung) -> bool:
        few = rung.values["rods.elements"] <= 2 * finest.values["rods.elements"]
        long = all(rung.values[path] >= least for path, least in steps.items())
        same = rung.ladder != "setting" or rung.values["solver.newton_tolerance"] > _TIGHT
        return few and long and same

    brief = [
        replace(rung, values={**rung.values, **steps}) if rung.ladder == "elements" else rung
        for rung in rungs if rung.ladder in (STANDING, *GRADED, "setting")
    ]  # fmt: skip
    return list(filter(kept, brief))


def frames_alone(rungs: Sequence[Rung]) -> list[Rung]:
    """The ladder of the frame engine by itself: its reference, and settings to choose from."""
    own = (STANDING, *GRADED, "setting")
    return [replace(rung, fidelity=FRAME) for rung in rungs if rung.ladder in own]


def by_frames(rungs: Sequence[Rung]) -> list[Rung]:
    """What the frame engine is tried with, of the rungs of the full one.

    All steps and elements, which tell its own order and limit, and all settings to choose from.
    """
    names = {STANDING: "setting", **{name: name for name in (*GRADED, "setting")}}
    return [
        replace(rung, ladder=names[rung.ladder], fidelity=FRAME)
        for rung in rungs if rung.ladder in names
    ]  # fmt: skip


def ladder(scene: Scene, most: int = 4) -> list[Rung]:
    """All rungs for a scene, those of the reference among them; some ladders share a setting.

    Elements go up to ``most`` (4 or 8) times the scene's own.  Steps that would end at a bound of
    ``scene.solver`` are no halvings of others and left out (``left_out``).
    """
    base, solver, one, found = standing(scene), scene.solver, scene.rods.elements, []
    tight = {"solver.newton_tolerance": min(solver.newton_tolerance, _TIGHT)}
    follows = solver.step_control == "motion"

    def add(name: str, label: str, size: float, changes: Mapping[str, Any]) -> None:
        found.append(Rung(name, label, size, {**base, **changes}))

    add(STANDING, STANDING, 0.0, {})
    for label, halvings in _HALVINGS.items():
        if not _bound_at(scene, 0.5**halvings):
            add("steps", label, 0.5**halvings, _scaled(scene, 0.5**halvings) | tight)
    for step in (_rounded(share * solver.step) for share in (0.1, 0.05, 0.025) if follows):
        constant = {"solver.step_control": "constant", "solver.step": step}
        add("constant step", f"{step:g} s", step, constant | tight)
    meshes = [("elements", "", _scaled(scene, _OF_ELEMENTS))]
    if scene.structure.locks and scene.cables is None:
        other = "ancf" if kind_of(scene.rods) != "ancf" else "geometrically-exact"
        rods = _scaled(scene, 1.0 / 4.0) | {"rods.kind": other}
        meshes.append(("formulation", f"{other}, ", rods))
    for name, rods_are, changes in meshes:
        for elements in (k * one for k in (1, 2, 4, 8) if k <= (most if name == "elements" else 4)):
            own = changes | tight | {"rods.elements": elements}
            add(name, f"{rods_are}{elements}", 1.0 / elements, own)
    for radius in (0.5, 0.8, 0.9, 0.95):
        add("dissipation", f"{radius:g}", 0.0, {"solver.spectral_radius": radius})
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        add("newton", f"{tolerance:g}", 0.0, {"solver.newton_tolerance": tolerance})
    for coarser, newtons, more in (each for each in _SETTINGS if each[2] <= most):
        newton = _rounded(max(newtons * solver.newton_tolerance, *tight.values()))
        scaled = _scaled(scene, coarser**0.5)
        if follows:
            del scaled["solver.step"]
            tolerance = scaled["solver.tolerance"]
            if tolerance != _rounded(coarser * solver.tolerance):
                continue  # beyond the end of what is allowed
            label = f"tolerance {tolerance:g}"
        else:
            step = solver.step if coarser == 1.0 else float(f"{scaled['solver.step']:.2g}")
            scaled["solver.step"], label = step, f"step {step:g} s"
        label += f", newton {newton:g}" if newton != solver.newton_tolerance else ""
        label += f", {more * one} elements" if more > 1 else ""
        scaled |= {"solver.newton_tolerance": newton, "rods.elements": more * one}
        add("setting", label, 0.0, scaled)
    return found


def standing(scene: Scene) -> dict[str, Any]:
    """The settings that a scene has."""
    found = {path: field_at(scene, path) for path in PATHS}
    # A study records the stresses of every scene, which must not change the scene's steps.
    return found if scene.record.stress else found | {"solver.deviation_tolerance": NO_DEVIATIONS}


def left_out(scene: Scene) -> list[str]:
    """What the ladder has no rungs for, in words.

    InputError if a bound leaves too few for a reference.
    """
    solver, bounds = scene.solver, {h: _bound_at(scene, 0.5**h) for h in _HALVINGS.values()}
    if path := _bound_at(scene, _OF_ELEMENTS):
        share = _OF_ELEMENTS ** (1 if path == "solver.step" else 2)
        least = getattr(solver.scaled(_OF_ELEMENTS), path.removeprefix("solver."))
        raise InputError(
            f"{path} = {field_at(scene, path):g}: a study refines it to {share:.3g} of that, and "
            f"it must be at least {least:g}: study the scene with {least / share:.3g} or more"
        )
    return [
        f"steps {label} are left out: {bounds[halvings]} would be at its bound (step_control = "
        f'"{solver.step_control}", end_time = {solver.end_time:g} s)'
        for label, halvings in _HALVINGS.items()
        if bounds[halvings]
    ]


def references(
    rungs: Sequence[Rung],
    good: Sequence[bool] | NDArray[np.bool_] | None = None,
    fidelity: str = "full",
) -> tuple[list[int], list[int]]:
    """Places of a fidelity's finest three rungs whose steps halve, and whose elements double.

    The first of these has as many elements as the steps' rungs, and there are two at least.
    ``good`` says which rungs may be used, all of them if None.  ValueError if too few may.
    """
    usable = [True] * len(rungs) if good is None else list(good)
    own = {
        name: [k for k, r in enumerate(rungs) if (r.ladder, r.fidelity) == (name, fidelity)]
        for name in GRADED
    }
    # Nobody would believe a reference that is coarser than the scene's own steps.
    in_time = [k for k in own["steps"] if rungs[k].size <= 1.0 and usable[k]]
    in_space = [k for k in own["elements"] if usable[k]]
    threes = [in_time[k : k + _LEVELS] for k in range(len(in_time) - _LEVELS + 1)]
    halved = [t for t in threes if rungs[t[0]].size == 2.0 ** (_LEVELS - 1) * rungs[t[-1]].size]
    if not halved or in_space[:1] != own["elements"][:1] or len(in_space) < 2:
        raise ValueError("too few runs were completed for a reference")
    return halved[-1], in_space


def _scaled(scene: Scene, factor: float) -> dict[str, Any]:
    """What makes every step so many times as long."""
    solver = scene.solver.scaled(factor)
    found = {"solver.step": _rounded(solver.step)}
    if solver.step_control == "motion":
        found["solver.tolerance"] = _rounded(solver.tolerance)
        if scene.record.stress:
            found["solver.deviation_tolerance"] = _rounded(solver.deviation_tolerance)
    return found


def _bound_at(scene: Scene, factor: float) -> str:
    """The path of a setting whose bound keeps steps from being so many times as long, if any."""
    old, new = scene.solver, scene.solver.scaled(factor)
    follows = old.step_control == "motion"
    wanted = {"step": factor} | ({"tolerance": factor**2} if follows else {})
    if follows and scene.record.stress and old.deviation_tolerance < NO_DEVIATIONS:
        wanted["deviation_tolerance"] = factor**2
    for name, ratio in wanted.items():
        if not np.isclose(getattr(new, name), ratio * getattr(old, name), rtol=1e-6, atol=0.0):
            return f"solver.{name}"
    return ""


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")
