"""Are the error bars of a run honest?  Random scenes against runs that are finer by far.

Run: python benchmarks/error_bars.py [scenes] [processes]

Each scene is drawn from a seed of its own: closed rings and open arcs, driven by forces or by
cables, free or clamped, soft and stiff, with and without net, friction and damping.  The truth of
a scene is a run with a sixteenth of its tolerance, twice the elements and a hundredth of
Newton's tolerance.  Printed per output: how often the bar covers the error, and the ratios of bar
to error.
"""

from __future__ import annotations

import math
import multiprocessing
import sys
from typing import Any

import numpy as np

from ringsim.scene import Scene, load_scene
from ringsim.simulation import run
from ringsim.variables import Outcome, Status

OUTPUTS = ("deployment_time", "opening_angle", "asynchrony_max", "peak_tension", "peak_rod_stress")


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_scene(seed: int) -> Scene:
    """A scene that nobody has tuned."""
    rng = np.random.default_rng([2026, seed])
    cables = bool(rng.random() < 0.5)
    closed = bool(rng.random() < 0.7)
    values: dict[str, Any] = {
        "structure.sections": int(rng.integers(3, 6) if closed else rng.integers(2, 4)),
        "structure.closed": closed,
        "structure.aspect_ratio": float(rng.uniform(0.8, 1.0)) if closed else 1.0,
        "structure.opening_angle": float(rng.uniform(15.0, 90.0)),
        "rods.young_modulus": log_uniform(rng, 30e9, 400e9),
        "rods.damping": float(rng.choice([0.0, 1e-3])),
        "boom.base": "free" if closed and rng.random() < 0.6 else "fixed",
        "net": "none",
        "record.stress": True,
        "record.interval": 0.05,
    }
    if not closed:
        values |= {"structure.polygon_sections": 18, "joints.hinge.viscous": 1e-3}
    if cables:
        base = load_scene("ring18-cable" if closed else "truss2")
        for end in ("upper", "lower"):
            values |= {
                f"cables.{end}.friction.coefficient": float(rng.uniform(0.0, 8e-4)),
                f"cables.{end}.axial_stiffness": log_uniform(rng, 1e4, 5e5),
            }
        speed = log_uniform(rng, 0.04, 0.15)
        winch = {"kind": "ramp", "speed": speed, "duration": float(rng.uniform(0.3, 2.0))}
        for end in ("upper", "lower"):
            values |= {f"cables.{end}.winch.winding.{name}": v for name, v in winch.items()}
        values["joints.vjoint.viscous"] = log_uniform(rng, 0.02, 0.8)
        values["solver.end_time"] = float(values["structure.sections"]) * 0.25 / speed + 10.0
    else:
        base = load_scene("ring18")
        values["loads.force"] = log_uniform(rng, 0.01, 0.1)
        if rng.random() < 0.5:
            values["joints.vjoint.viscous"] = log_uniform(rng, 1e-4, 3e-3)
    return base.with_values(values)


def finer(scene: Scene) -> Scene:
    """The truth of a scene."""
    return scene.with_values(
        {
            "solver.tolerance": scene.solver.tolerance / 16.0,
            "solver.newton_tolerance": scene.solver.newton_tolerance / 100.0,
            "rods.elements": 2 * scene.rods.elements,
            "solver.step_limit": 200_000,
        }
    )
