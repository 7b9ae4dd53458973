"""Running the ladder of an accuracy study, as campaigns like any other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from ringsim.analysis.accuracy import NEEDED, Truth, judge
from ringsim.analysis.ladder import (  # fmt: skip
    FRAME,
    PATHS,
    Rung,
    by_frames,
    frames_alone,
    ladder,
    left_out,
    references,
    shortened,
)
from ringsim.campaign.run import run_cases
from ringsim.refusal import InputError
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene
from ringsim.simulation import why_not_frame
from ringsim.variables import GOALS, Fate, Status

_STEP_LIMIT = 1_000_000
"""Steps of one rung: its time is limited instead."""


class ReferenceRunError(Exception):
    """A scene has no reference to compare with: its message names setting, reason and cure."""


def run_ladder(
    folder: Path, scene: Scene, workers: int, timeout: float, most_elements: int = 4,
    *, brief: bool = False, fidelity: str = "full",
) -> xr.Dataset:  # fmt: skip
    """Errors and cost of all settings of a scene's ladder (``judge``).

    A setting that fails is a failed rung: nothing starts anew with smaller steps here.  The
    cheapest run of the reference goes first, then the whole reference, then the rest, so that a
    scene which cannot be studied costs little.  The frame engine is a setting too, where it can
    represent the scene.  ``folder`` holds the campaigns, and a study that was interrupted goes on,
    also with rungs that took longer than ``timeout``, the longest time of one rung, s;
    ``most_elements`` (4 or 8) is how many times more than the scene's are tried; ``brief`` is for a
    quarter of the cost (``shortened``).  ``fidelity`` "frame" tries that engine alone, whose limit
    is then the reference.  What the study had to do without is in the attribute ``remarks``.
    InputError if the scene is refused, ReferenceRunError if too few runs for a reference end well.
    """
    plain = {"solver.restarts": 0, "solver.error_bars": False, "solver.step_limit": _STEP_LIMIT}
    scene = scene.with_values(plain)
    remarks = left_out(scene)
    late = frozenset({Status.TIMEOUT})
    study = _Study(scene, partial(run_cases, folder, workers=workers, timeout=timeout, again=late))
    why, rungs = why_not_frame(scene), ladder(scene, most_elements)
    if fidelity == FRAME:
        if why:
            raise InputError(f"--fidelity {FRAME}: {why}")
        rungs = frames_alone(rungs)
        remarks.append("a study of the frame engine alone: the reference is its own limit")
    if brief:
        rungs = shortened(rungs)
        remarks.append("a brief study: steps down to a quarter, elements up to twice the scene's")
    for rung in rungs:
        scene.with_values(dict(rung.values))  # refused before anything has run
    in_time, in_space = references(rungs, fidelity=fidelity)
    failed: dict[int, str] = {}
    for stage, places in (("first", in_time[:1]), ("reference", in_time + in_space)):
        own = [rungs[k] for k in places]
        found = study.run(stage, own)
        failed |= {places[k]: told for k, told in _failures(own, found).items()}
        _require_references(rungs, failed, fidelity)
    remarks += [f"{told}; the reference is made of other runs" for told in failed.values()]
    if why:
        remarks.append(f"the frame engine is left out: {why}")
    elif fidelity != FRAME:
        rungs += by_frames(rungs)
    results = study.run("settings", rungs)
    failed |= _failures(rungs, results)
    _require_references(rungs, failed, fidelity)
    judged = judge(results, rungs, _quadrature(scene))
    return judged.assign_attrs(remarks="\n".join(f"- {each}" for each in remarks))


def _failures(rungs: Sequence[Rung], found: xr.Dataset) -> dict[int, str]:
    """How each of the runs ended that cannot be a reference, by its place."""
    told = {}
    ends = zip(*(found[name].values for name in ("status", "outcome", "reason")), strict=True)
    for k, (code, fate, reason) in enumerate(ends):
        if fate not in GOALS:
            word = (Fate(int(fate)) if code == Status.OK else Status(code)).word
            settings = ", ".join(f"{path} = {value}" for path, value in rungs[k].values.items())
            why = reason or "no reason given"
            told[k] = f"the reference run with {settings} ended as {word}: {why}"
    return told


def _require_references(rungs: Sequence[Rung], failed: dict[int, str], fidelity: str) -> None:
    """Raise ReferenceRunError if without the rungs that failed too few are left to compare with."""
    try:
        references(rungs, [k not in failed for k in range(len(rungs))], fidelity)
    except ValueError:
        raise ReferenceRunError(
            f"{next(iter(failed.values()))}: change the scene so that it ends well with fine "
            "steps, or give it more time (--timeout)"
        ) from None


@dataclass
class _Study:
    """Runs settings in stages, each setting once."""

    scene: Scene
    cases: Callable[..., Path]
    """``run_cases`` for all but name, scene, cases, title and fidelity."""
    known: dict[tuple[object, ...], xr.Dataset] = field(default_factory=dict)

    def run(self, stage: str, rungs: Sequence[Rung]) -> xr.Dataset:
        """Results over the rungs, those that earlier stages ran among them."""
        shared = [path for path in self.scene.structure.shaping if path in PATHS]
        paths = [path for path in PATHS if path not in shared]
        keys = [(rung.fidelity, *(rung.values[path] for path in PATHS)) for rung in rungs]
        missing: dict[tuple[str, bool, str], dict[tuple[object, ...], Rung]] = {}
        for key, rung in zip(keys, rungs, strict=True):
            if key not in self.known:
                missing.setdefault(self._campaign(stage, rung), {})[key] = rung
        for (name, stress, fidelity), own in missing.items():
            given = {path: next(iter(own.values())).values[path] for path in shared}
            scene = self.scene.with_values(given | {"record.stress": stress})
            cases = [{path: rung.values[path] for path in paths} for rung in own.values()]
            title = f"Settings of {scene.name} against each other ({name})"
            found = _needed(self.cases(name, scene, cases, title=title, fidelity=fidelity))
            self.known |= {key: found.isel(rung=[k]) for k, key in enumerate(own)}
        return xr.concat([self.known[key] for key in keys], "rung")

    def _campaign(self, stage: str, rung: Rung) -> tuple[str, bool, str]:
        """Name, ``record.stress`` and fidelity of a rung's campaign: all in one have results of one
        shape.
        """
        if rung.fidelity == FRAME:
            return f"{stage}-{FRAME}", True, FRAME
        if self.scene.structure.gauge:  # a strain for each of its elements
            return f"{stage}-elements-{rung.values['rods.elements']}", False, rung.fidelity
        stressed = rung.values["rods.kind"] != "ancf"  # whose elements report no forces
        return stage if stressed else f"{stage}-unstressed", stressed, rung.fidelity


def _needed(file: Path) -> xr.Dataset:
    """What is compared of a campaign's results, missing variables as NaN."""
    with xr.open_dataset(file) as dataset:
        found = dataset.rename(sample="rung").drop_vars("rung")
        kept = found[[name for name in (*NEEDED, "reason") if name in found]].load()
    nothing = ("rung", np.full(kept.sizes["rung"], np.nan))
    return kept.assign({name: nothing for name in NEEDED if name not in kept})


def _quadrature(scene: Scene) -> list[Truth]:
    """Deployment time of a ring that only position-dependent loads drive, without losses."""
    conservative = not scene.joints.present() and (scene.net is None or scene.net.lossless)
    if not scene.structure.locks or not scene.structure.closed:
        return []  # the quadrature keeps an arc's end assemblies upright, but they swing
    if not conservative or scene.cables is not None or scene.faults:
        return []
    if scene.loads is None or scene.loads.reversal_time is not None:
        return []
    try:
        found = opening_time(OneCoordinate(scene), scene.structure.coordinate)
    except ValueError:  # the loads do not open it
        return []
    return [Truth("deployment_time", "energy quadrature of the ideal ring", found.time)]
