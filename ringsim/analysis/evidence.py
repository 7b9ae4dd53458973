"""Settings that were measured to be worth their cost, and picking one for a wanted accuracy.

An accuracy study leaves the efficient frontier of the motion behind as a small table; those of
the built-in scenes come with the package.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.accuracy import GROUPS
from ringsim.analysis.ladder import PATHS
from ringsim.choice import kind_of
from ringsim.refusal import InputError
from ringsim.scene import Scene

JUDGED_BY = "motion"
"""The errors that a setting is picked by: deployment time, opening angle and asynchrony."""


@dataclass(frozen=True)
class Setting:
    """One setting with what it was measured to give.

    Attributes
    ----------
    values
        By scene path; the largest step of a moving one is the scene's own affair.
    errors
        Relative, by output.
    seconds
        Processor time of the run, s.
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
    """The settings on the frontier of one scene, cheapest first.

    Attributes
    ----------
    scene
        Its name.
    references
        Extrapolated values of its main numbers, SI units and degrees.
    """

    scene: str
    references: Mapping[str, float]
    settings: tuple[Setting, ...]

    def pick(self, accuracy: float) -> Setting:
        """The cheapest setting whose motion is as accurate as that.

        Raises
        ------
        InputError
            If none was measured to be.
        """
        for setting in self.settings:
            if setting.errors[JUDGED_BY] <= accuracy:
                return setting
        best = 1.1 * min(setting.errors[JUDGED_BY] for setting in self.settings)
        raise InputError(
            f"--accuracy {accuracy:g}: the best setting measured with {self.scene} gives "
            f"{best:.2g}: ask for that, or set solver.tolerance yourself"
        )


def evidence_of(found: xr.Dataset) -> Evidence:
    """The frontier of a study's motion (of its opening angle, if nothing locks).

    Parameters
    ----------
    found
        From :func:`ringsim.analysis.accuracy.judge`; its scene is the attribute ``scene``.
    """
    outputs = [str(name) for name in found.output.values]
    column = outputs.index(JUDGED_BY)
    kept = np.flatnonzero(_best(found, column))
    settings: list[Setting] = []
    for rung in kept[np.argsort(found.cpu_time.values[kept])]:
        errors = {
            name: float(f"{found.error.values[rung, k]:.2e}")
            for k, name in enumerate(outputs)
            if np.isfinite(found.error.values[rung, k])
        }
        seconds = float(f"{found.cpu_time.values[rung]:.3g}")
        residuals = int(found.residual_evaluations.values[rung])
        values = _values(found, int(rung))
        if all(values != known.values for known in settings):  # ladders share settings
            settings.append(Setting(values, errors, seconds, residuals))
    known = zip(outputs, found.reference.values, strict=True)
    references = {name: float(f"{value:.8g}") for name, value in known if np.isfinite(value)}
    name = str(tomllib.loads(found.attrs["scene"])["name"])
    return Evidence(name, references, tuple(settings))


def _best(found: xr.Dataset, column: int) -> NDArray[np.bool_]:
    """The frontier among full runs of the scene's own rods."""
    others = np.isin(found.ladder.values, ["fidelity", "formulation"])
    error = np.where(others, np.inf, np.nan_to_num(found.error.values[:, column], nan=np.inf))
    cost = found.cpu_time.values
    beaten = [((cost < cost[k]) & (error <= error[k])).any() for k in range(len(error))]
    return np.asarray(np.isfinite(error) & ~np.array(beaten))


def _values(found: xr.Dataset, rung: int) -> dict[str, Any]:
    values = {path: found[path.replace(".", "_")].values[rung] for path in PATHS}
    values = {path: getattr(value, "item", lambda v=value: v)() for path, value in values.items()}
    del values["rods.kind"]
    if values["solver.step_control"] == "motion":
        del values["solver.step"]
    return values


def to_toml(evidence: Evidence) -> str:
    """As a file."""
    table = {
        "scene": evidence.scene,
        "judged_by": [JUDGED_BY, *GROUPS[JUDGED_BY]],
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
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    return _from_toml(text, str(path))


def evidence_for(scene: Scene) -> Evidence:
    """What the package knows of the built-in scene that is most like a scene.

    Raises
    ------
    InputError
        If the scene has rods of another formulation.
    """
    if kind_of(scene.rods) != "geometrically-exact":
        raise InputError(
            f'rods.kind = "{kind_of(scene.rods)}": the settings that come with ringsim were '
            "measured with geometrically-exact rods: use these, or give --evidence from "
            "ringsim accuracy on your scene"
        )
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
    try:
        table = tomllib.loads(text)
        settings = tuple(
            Setting(
                dict(s["values"]),
                {name: float(error) for name, error in s["errors"].items()},
                float(s["seconds"]),
                int(s["residuals"]),
            )
            for s in table["settings"]
        )
        if not settings or any(JUDGED_BY not in s.errors for s in settings):
            raise KeyError(JUDGED_BY)
        return Evidence(str(table["scene"]), dict(table["references"]), settings)
    except (tomllib.TOMLDecodeError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{name}: not the settings of an accuracy study ({error}): make it with "
            "ringsim accuracy"
        ) from None
