"""Running the ladder of an accuracy study, as campaigns like any other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ringsim.analysis.accuracy import NEEDED, Truth, judge
from ringsim.analysis.ladder import PATHS, Rung, ladder, standing
from ringsim.campaign.cases import Cases, run_cases
from ringsim.choice import kind_of
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.energy_quadrature import opening_time
from ringsim.theory.ideal_fidelity import refuse_if_not_ideal
from ringsim.theory.ideal_ring import IdealRing

TIMEOUT = 1800.0
"""Longest time of one rung, s."""


def run_ladder(folder: Path, scene: Scene, workers: int) -> xr.Dataset:
    """Errors and cost of all settings of a scene's ladder.

    Parameters
    ----------
    folder
        Where the campaigns' folders go; a study that was interrupted goes on.
    scene
        Any scene that ends well at fine settings.
    workers
        Solver processes.

    A setting that fails is a failed rung: nothing starts anew with smaller steps here.

    Returns
    -------
    xr.Dataset
        See :func:`ringsim.analysis.accuracy.judge`.  The ideal fidelity is a setting too, where
        it can represent the scene.

    Raises
    ------
    InputError
        If the scene is refused, or a reference run does not end well.
    """
    scene = scene.with_values({"solver.restarts": 0, "solver.error_bars": False})
    rungs = ladder(scene)
    truss = kind_of(scene.structure) == "planar-truss"
    parts: list[xr.Dataset] = []
    order: list[int] = []
    # What gives a result its shape is the same within a campaign: stresses, a truss's elements.
    shapes = [(rung.stressed, rung.values["rods.elements"] if truss else 0) for rung in rungs]
    for stressed, elements in dict.fromkeys(shapes):
        own = [k for k, shape in enumerate(shapes) if shape == (stressed, elements)]
        given: dict[str, object] = {"record.stress": stressed and not truss}
        name = "stressed" if stressed else "unstressed"
        if truss:
            name, given["rods.elements"] = f"elements-{elements}", elements
        chosen = scene.with_values(given)
        parts.append(_run(folder, name, chosen, [rungs[k] for k in own], workers, set(given)))
        order += own
    results = xr.concat(parts, "rung").isel(rung=np.argsort(order))
    truths = _quadrature(scene)
    ideal = _ideal(folder, scene, workers)
    if ideal is not None:
        results = xr.concat([ideal, results], "rung")
        rungs = [Rung("fidelity", "ideal", 0.0, standing(scene)), *rungs]
        truths += _truths(ideal)
    try:
        return judge(results, rungs, truths)
    except ValueError as error:
        reasons = [str(r) for r in results.reason.to_numpy()[-3:] if r]
        raise InputError(
            f"{scene.name}: {error}: {'; '.join(reasons)}: choose a scene that ends well"
        ) from error


def _run(
    folder: Path,
    name: str,
    scene: Scene,
    rungs: Sequence[Rung],
    workers: int,
    given: set[str],
) -> xr.Dataset:
    """Run each setting once; rungs that share one share its result."""
    settings: list[dict[str, object]] = []
    places: list[int] = []
    for rung in rungs:
        wanted = {path: rung.values[path] for path in PATHS if path not in given}
        if wanted not in settings:
            settings.append(wanted)
        places.append(settings.index(wanted))
    title = f"Settings of {scene.name} against each other ({name})"
    file = run_cases(folder, Cases(name, title, scene, settings, TIMEOUT), workers)
    return _needed(file).isel(rung=places)


def _needed(file: Path) -> xr.Dataset:
    """What is compared, missing variables as NaN."""
    with xr.open_dataset(file) as dataset:
        found = dataset.rename(sample="rung").drop_vars("rung")
        kept = found[[name for name in (*NEEDED, "reason") if name in found]].load()
    for name in NEEDED:
        if name not in kept:
            kept[name] = ("rung", np.full(kept.sizes["rung"], np.nan))
    return kept


def _ideal(folder: Path, scene: Scene, workers: int) -> xr.Dataset | None:
    """The ideal fidelity's answer as one rung; None if it cannot represent the scene."""
    plain = scene.with_values({"record.stress": False})
    try:
        refuse_if_not_ideal(plain)
    except InputError:
        return None
    case = {"solver.tolerance": scene.solver.tolerance}
    title = f"{scene.name} with rigid rods"
    return _needed(run_cases(folder, Cases("ideal", title, plain, [case], fidelity="ideal"), 1))


def _quadrature(scene: Scene) -> list[Truth]:
    """Deployment time of a ring that only position-dependent loads drive, without losses."""
    if kind_of(scene.structure) != "pantograph-ring" or scene.cables is not None:
        return []
    joints = scene.joints
    losses = (joints.pivot, joints.hinge, joints.vjoint)
    if any(law is not None for law in losses) or scene.faults or scene.loads is None:
        return []
    try:
        found = opening_time(IdealRing.of(scene), scene.structure.initial_phi)
    except ValueError:
        return []
    return [Truth("deployment_time", "energy quadrature of the ideal ring", found.time)]


def _truths(ideal: xr.Dataset) -> list[Truth]:
    one = ideal.isel(rung=0)
    found = []
    if np.isfinite(one.deployment_time):
        source = "one-coordinate equation of the ideal ring"
        found.append(Truth("deployment_time", source, float(one.deployment_time)))
        mean = one.opening_angle.mean(("plane", "section")).to_numpy()
        found.append(Truth("opening_angle", f"{source}, mean angle", mean))
    return found
