"""Small rings and what the physics tests read from their runs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration
from ringsim.frame.integrate import Integration as Frames
from ringsim.frame.model import FrameModel
from ringsim.outputs.recorder import Recorder
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene
from ringsim.stepping.locks import lock_times

Array = NDArray[np.float64]
UNTIL_LOCKED: dict[str, Any] = {"solver__settling_time": 0.0}
"""For what is read up to the last lock: what comes after it takes as many steps again."""


def ring(sections: int = 6, **values: Any) -> Scene:
    """A ring of the paper's sections on a circle, with its boom, undamped, without a net.

    Keywords name scene fields; two underscores stand for a dot.
    """
    plain = {
        "structure.sections": sections,
        "structure.aspect_ratio": 1.0,
        "rods.damping": 0.0,
        "net": "none",
        "loads.force": 0.03,
        # Closer than the defaults: the tests look for differences below what those promise.
        "solver.tolerance": 1e-4,
        "solver.newton_tolerance": 1e-5,
    }
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18").with_values(plain | chosen)


@dataclass(frozen=True)
class Run:
    """A run at the engine's own steps."""

    scene: Scene
    history: Recorder

    @cached_property
    def times(self) -> Array:
        return np.array(self.history.times)

    @cached_property
    def angles(self) -> Array:
        """Shape (steps + 1, 2, sections), rad."""
        return np.array(self.history.angles)

    @cached_property
    def rates(self) -> Array:
        return np.array(self.history.rates)

    @cached_property
    def locks(self) -> Array:
        return lock_times(self.times, self.angles, self.rates)

    @cached_property
    def mean(self) -> CubicHermiteSpline:
        """Mean opening angle over time, rad."""
        return CubicHermiteSpline(
            self.times, self.angles.mean(axis=(1, 2)), self.rates.mean(axis=(1, 2))
        )

    def reaches(self, angle: float) -> float:
        """Time at which the mean opening angle first is ``angle`` (deg)."""
        return float(self.mean.solve(math.radians(angle), extrapolate=False)[0])

    def balance(self) -> Array:
        """Energy that is missing from the balance at every step over the work so far, largest."""
        energies = np.array(self.history.energies)
        lost = np.cumsum(energies[:, 3])
        missing = energies[:, 0] + energies[:, 1] - energies[0, 1] + lost - energies[:, 2]
        return np.asarray(missing / np.abs(energies[:, 2]).max())

    def before_contact(self) -> NDArray[np.bool_]:
        return np.asarray(self.times < np.nanmin(self.locks))


ENGINES = pytest.mark.parametrize("engine", ["frame", pytest.param("full", marks=pytest.mark.slow)])
"""Frames take a fifth of exudyn's time, and tests/frame/test_frame_laws.py holds both together."""


def run(scene: Scene, engine: str = "full") -> Run:
    if engine == "frame":
        return Run(scene, Frames(FrameModel(scene)).run())
    return Run(scene, Integration(build(scene)).run())


def ideal_time(scene: Scene, angle: float = 180.0) -> float:
    """Time in s at which the ideal ring reaches an opening angle (deg), by quadrature."""
    end = 0.5 * (math.pi - math.radians(angle))
    return opening_time(OneCoordinate(scene), scene.structure.coordinate, end).time
