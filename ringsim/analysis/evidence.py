"""Settings that an accuracy study found worth their cost, and picking one for an accuracy."""

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
from pydantic import ConfigDict, Field, ValidationError

from ringsim.analysis.accuracy import in_favour, settings_at
from ringsim.analysis.errors import GROUPS, OUTPUTS
from ringsim.choice import kind_of
from ringsim.files import parse_toml, read_text
from ringsim.parts.solver import NO_DEVIATIONS
from ringsim.refusal import InputError
from ringsim.scene import Scene, scene_from_toml
from ringsim.units import ListIn, Model

JUDGED_BY = "motion"
"""The errors that a setting is picked by, unless others are named: deployment time and angle."""
CHOICES = (*GROUPS, *OUTPUTS, "energy")
"""What a setting may be picked by."""


class Setting(Model):
    """An engine and one setting by scene path, with measured errors and cost."""

    model_config = ConfigDict(extra="ignore")  # files of earlier versions hold more
    seconds: float
    """Processor time of a run, s."""
    fidelity: Literal["full", "frame"] = "full"
    values: dict[str, Any]
    errors: dict[str, float]
    """What the setting is good for, relative, by output and group of outputs."""


class Evidence(Model):
    """The settings of one scene and either engine that are worth their cost, cheapest first.

    The scene's own setting comes before others that are hardly cheaper.
    """

    model_config = ConfigDict(extra="ignore")
    scene: str
    kind: dict[str, Any]
    """See :func:`kind_of_scene`."""
    settings: Annotated[tuple[Setting, ...], ListIn, Field(min_length=1)]

    def pick(self, accuracy: float, of: str = JUDGED_BY, fidelity: str | None = None) -> Setting:
        """The cheapest setting of a fidelity, of any if None, that is good for a relative error of
        one of ``CHOICES``.

        Raises InputError if none is, or the scene has no such output.
        """
        settings = [s for s in self.settings if fidelity in (None, s.fidelity)]
        if not settings:
            raise InputError(
                f"--fidelity {fidelity}: no settings of it were measured with {self.scene}: give "
                "--evidence from ringsim accuracy on a scene that it represents, or leave out "
                "--fidelity"
            )
        errors = [setting.errors.get(of, np.inf) for setting in settings]
        if min(errors) == np.inf:
            there = ", ".join(name for name in CHOICES if name in settings[0].errors)
            raise InputError(f"--of {of}: {self.scene} has no such output: choose from {there}")
        if min(errors) <= accuracy:
            return next(s for s, e in zip(settings, errors, strict=True) if e <= accuracy)
        best = float(f"{1.006 * min(errors):.2e}")  # rounded up, so that asking for it succeeds
        raise InputError(
            f"--accuracy {accuracy:g}: the best setting measured with {self.scene} is good for "
            f"{best:.3g} in {of.replace('_', ' ')}: ask for that, or set solver.tolerance yourself"
        )

    def values_for(self, setting: Setting, scene: Scene) -> dict[str, Any]:
        """A setting's values for a scene: no fewer elements than it has, no step beyond its end."""
        return setting.values | {
            "solver.step": min(setting.values["solver.step"], scene.solver.end_time),
            "rods.elements": max(setting.values["rods.elements"], scene.rods.elements),
        }

    def require_like(self, scene: Scene) -> None:
        """Raise InputError, with what differs, if this is evidence of another kind of scene."""
        for name, value in kind_of_scene(scene).items():
            if value != self.kind.get(name):
                raise InputError(
                    f"--accuracy: its settings were measured with {self.scene}, {name} = "
                    f"{self.kind.get(name)}, and {scene.name} has {name} = {value}: give "
                    "--evidence from ringsim accuracy on a scene of its kind"
                )


def kind_of_scene(scene: Scene) -> dict[str, Any]:
    """What settings depend on most: structure, rods, drive, and how steps are chosen."""
    return {
        "structure": kind_of(scene.structure),
        "rods": kind_of(scene.rods),
        "cables": scene.cables is not None,
        "step_control": scene.solver.step_control,
    }


def evidence_of(found: xr.Dataset) -> Evidence:
    """The settings of a study that some accuracy picks: each is best so far in some output, among
    those of its engine.

    ``found`` is from :func:`ringsim.analysis.accuracy.judge`; its attribute ``scene`` is its scene.
    """
    scene = scene_from_toml(found.attrs["scene"], source="the study's scene")
    usable = found.eligible.values & np.isfinite(found.bound.values).any(axis=1)
    cost = np.where(usable, in_favour(found.cost.values, found.ladder.values), np.inf)
    settings: list[Setting] = []
    known: dict[str, dict[str, float]] = {}
    for rung in np.argsort(cost, kind="stable")[: usable.sum()].tolist():
        bounds = found.bound[rung].to_series().dropna().items()
        # Rounded up: a setting is good for no less.
        errors = {str(name): float(f"{1.0049 * e:.2e}") for name, e in bounds}
        best = known.setdefault(found.fidelity.values[rung], {})
        if better := {name: e for name, e in errors.items() if e < best.get(name, np.inf)}:
            best |= better
            values = settings_at(found, rung)
            del values["rods.kind"], values["solver.step_control"]
            if values["solver.deviation_tolerance"] >= NO_DEVIATIONS:
                del values["solver.deviation_tolerance"]  # another scene may follow them
            seconds = float(f"{found.cost.values[rung]:.3g}")
            fidelity = found.fidelity.values[rung]
            settings.append(
                Setting(seconds=seconds, fidelity=fidelity, values=values, errors=errors)
            )
    return Evidence(scene=scene.name, kind=kind_of_scene(scene), settings=tuple(settings))


def read_evidence(path: Path | Traversable) -> Evidence:
    """The settings.toml of a study; InputError if it cannot be read, or holds something else."""
    try:
        found = Evidence.model_validate(parse_toml(read_text(path), str(path)))
        if not all({"solver.step", "rods.elements"} <= set(s.values) for s in found.settings):
            raise ValueError("a setting without solver.step or rods.elements")
        return found
    except ValueError as error:  # also that of pydantic
        first = error.errors()[0] if isinstance(error, ValidationError) else None
        fault = f"{'.'.join(map(str, first['loc']))}: {first['msg']}" if first else error
        raise InputError(
            f"{path}: not the settings of an accuracy study ({fault}): make it with "
            "ringsim accuracy"
        ) from None


def evidence_for(scene: Scene) -> Evidence:
    """The evidence of the built-in scene with the same kind of structure and drive."""
    if scene.structure.gauge:
        name = "planar-truss"
    elif scene.cables is None:
        name = "ring18"
    else:
        name = "ring18-cable" if scene.structure.closed else "truss2"
    return read_evidence(resources.files("ringsim") / "scenes" / "evidence" / f"{name}.toml")
