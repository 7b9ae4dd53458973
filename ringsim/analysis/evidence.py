"""Settings that were measured to be worth their cost, and picking one for a wanted accuracy.

An accuracy study leaves what is on one of its efficient frontiers behind as a small table; those
of the built-in scenes come with the package.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.errors import GROUPS, OUTPUTS
from ringsim.analysis.frontier import WORTH_A_CHANGE
from ringsim.analysis.ladder import PATHS, STANDING
from ringsim.choice import kind_of
from ringsim.files import parse_toml, read_text
from ringsim.parts.solver import NO_DEVIATIONS
from ringsim.refusal import InputError
from ringsim.scene import Scene, scene_from_toml

JUDGED_BY = "motion"
"""The errors that a setting is picked by, unless others are named: deployment time and angle."""
CHOICES = (*GROUPS, *OUTPUTS, "energy")
"""What a setting may be picked by."""


@dataclass(frozen=True)
class Setting:
    """One setting with what it was measured to give.

    Attributes
    ----------
    values
        By scene path.
    errors
        What the setting is good for, relative, by output and group of outputs.
    seconds
        Processor time of a run, s.
    residuals
        Residuals that Newton evaluated in accepted steps, and the steps: a cost that does not
        depend on the machine's load, but leaves out factorisations.
    """

    values: Mapping[str, Any]
    errors: Mapping[str, float]
    seconds: float
    residuals: int


@dataclass(frozen=True)
class Evidence:
    """The settings of one scene that are worth their cost, cheapest first.

    That which the scene has goes before others that are hardly cheaper.

    Attributes
    ----------
    scene
        Its name.
    kind
        What it is, see :func:`kind_of_scene`.
    references
        Extrapolated values of its main numbers, SI units and degrees.
    """

    scene: str
    kind: Mapping[str, Any]
    references: Mapping[str, float]
    settings: tuple[Setting, ...]

    def pick(self, accuracy: float, of: str = JUDGED_BY) -> Setting:
        """The cheapest setting that is good for such an error.

        Parameters
        ----------
        accuracy
            Relative error.
        of
            One of ``CHOICES``.

        Raises
        ------
        InputError
            If none is, or the scene has no such output.
        """
        errors = [setting.errors.get(of, np.inf) for setting in self.settings]
        if not np.isfinite(errors).any():
            there = ", ".join(name for name in CHOICES if name in self.settings[0].errors)
            raise InputError(f"--of {of}: {self.scene} has no such output: choose from {there}")
        for setting, error in zip(self.settings, errors, strict=True):
            if error <= accuracy:
                return setting
        best = float(f"{1.006 * min(errors):.2e}")
        raise InputError(
            f"--accuracy {accuracy:g}: the best setting measured with {self.scene} is good for "
            f"{best:.3g} in {of.replace('_', ' ')}: ask for that, or set solver.tolerance yourself"
        )

    def values_for(self, setting: Setting, scene: Scene) -> dict[str, Any]:
        """A setting's values for a scene: no fewer elements than it has, no step beyond its end."""
        values = dict(setting.values)
        values["solver.step"] = min(values["solver.step"], scene.solver.end_time)
        values["rods.elements"] = max(values["rods.elements"], scene.rods.elements)
        return values

    def require_like(self, scene: Scene) -> None:
        """Refuse evidence of another kind of scene.

        Raises
        ------
        InputError
            One line with what differs.
        """
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
    """The settings of a study, each better in some output than every cheaper one.

    Parameters
    ----------
    found
        From :func:`ringsim.analysis.accuracy.judge`; its scene is the attribute ``scene``.
    """
    scene = scene_from_toml(found.attrs["scene"], source="the study's scene")
    outputs = [str(name) for name in found.output.values]
    settings: list[Setting] = []
    for rung in _by_cost(found):
        bounds = dict(zip(outputs, found.bound.values[rung], strict=True))
        errors = {name: _rounded_up(bound) for name, bound in bounds.items() if np.isfinite(bound)}
        if all(any(errors[name] < known.errors[name] for name in errors) for known in settings):
            seconds = float(f"{found.cost.values[rung]:.3g}")
            residuals = int(found.residual_evaluations.values[rung])
            settings.append(Setting(_values(found, int(rung)), errors, seconds, residuals))
    references = {
        name: float(f"{value:.8g}")
        for name, value in zip(outputs, found.reference.values, strict=True)
        if np.isfinite(value)
    }
    return Evidence(scene.name, kind_of_scene(scene), references, tuple(settings))


def _by_cost(found: xr.Dataset) -> NDArray[np.int64]:
    """Good runs of the full model with the scene's own rods and step control, cheapest first."""
    own = np.flatnonzero(found.eligible.values & np.isfinite(found.bound.values).any(axis=1))
    stands = found.ladder.values[own] == STANDING
    cost = found.cost.values[own] * np.where(stands, WORTH_A_CHANGE, 1.0)
    return np.asarray(own[np.argsort(cost, kind="stable")])


def _rounded_up(error: float) -> float:
    return float(f"{1.0049 * error:.2e}")


def _values(found: xr.Dataset, rung: int) -> dict[str, Any]:
    values = {path: found[path.replace(".", "_")].values[rung] for path in PATHS}
    values = {path: getattr(value, "item", lambda v=value: v)() for path, value in values.items()}
    del values["rods.kind"], values["solver.step_control"]
    if values["solver.deviation_tolerance"] >= NO_DEVIATIONS:
        del values["solver.deviation_tolerance"]  # not followed by this scene, perhaps by others
    return values


def to_toml(evidence: Evidence) -> str:
    """As a file."""
    table = {
        "scene": evidence.scene,
        "kind": dict(evidence.kind),
        "references": dict(evidence.references),
        "settings": [
            {
                "seconds": s.seconds,
                "residuals": s.residuals,
                "values": dict(s.values),
                "errors": dict(s.errors),
            }
            for s in evidence.settings
        ],
    }
    return tomli_w.dumps(table)


def read_evidence(path: Path) -> Evidence:
    """The settings.toml of a study.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    return _from_toml(read_text(path), str(path))


def evidence_for(scene: Scene) -> Evidence:
    """What the package knows of the built-in scene that is most like a scene.

    Raises
    ------
    InputError
        If it knows nothing of such scenes.
    """
    name = likest(scene)
    file = resources.files("ringsim") / "scenes" / "evidence" / f"{name}.toml"
    if not file.is_file():
        raise InputError(
            f"--accuracy: no settings for scenes like {name} come with ringsim: give --evidence "
            "from ringsim accuracy on your scene"
        )
    return _from_toml(file.read_text(encoding="utf-8"), file.name)


def likest(scene: Scene) -> str:
    """Name of the built-in scene with the same kind of structure and drive."""
    if kind_of(scene.structure) == "planar-truss":
        return "planar-truss"
    if scene.cables is None:
        return "ring18"
    return "ring18-cable" if scene.structure.closed else "truss2"


def _from_toml(text: str, name: str) -> Evidence:
    table = parse_toml(text, name)
    try:
        settings = tuple(
            Setting(
                dict(s["values"]),
                {name: float(error) for name, error in s["errors"].items()},
                float(s["seconds"]),
                int(s["residuals"]),
            )
            for s in table["settings"]
        )
        if not settings or any("solver.step" not in s.values for s in settings):
            raise KeyError("settings")
        name_of = str(table["scene"])
        return Evidence(name_of, dict(table["kind"]), dict(table["references"]), settings)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{name}: not the settings of an accuracy study ({error}): make it with "
            "ringsim accuracy"
        ) from None
