"""Engine against energy quadrature: 6, 12, 18 and 30 sections, base free and fixed, net or none.

Run: python benchmarks/engine_accuracy.py [sections ...]

Three relative differences of time are printed for every ring: when the mean opening angle
reaches 175 deg, when the mean V-joint locks, and when the last one does (the deployment time).
A second table takes one ring with stiffer and stiffer rods.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene
from ringsim.stepping.locks import lock_times


@dataclass(frozen=True)
class Difference:
    """Engine time over quadrature time less 1."""

    at_175: float
    first_lock: float
    mean_lock: float
    last_lock: float
    steps: int


def ring(sections: int, *, fixed: bool, net: bool) -> Scene:
    """A ring of the paper's sections that opens for certain; the net grows with it."""
    return load_scene("ring18").with_values(
        {
            "structure.sections": sections,
            "structure.aspect_ratio": 1.0 if sections < 18 else 3.2856 / 3.5184,
            "boom.base": "fixed" if fixed else "free",
            "loads.force": 0.03,
            "solver.end_time": 200.0,
            **({"net.neutral_length": 0.7116 * sections / 18} if net else {"net": "none"}),
        }
    )


def compare(scene: Scene) -> Difference:
    """Run a scene and its quadrature."""
    history = Integration(build(scene)).run()
    if history.status:
        raise RuntimeError(history.reason)
    ideal, start = OneCoordinate(scene), scene.structure.coordinate
    times, angles, rates = (np.array(x) for x in (history.times, history.angles, history.rates))
    mean = CubicHermiteSpline(
        times, angles.mean(axis=(1, 2)) - math.radians(175.0), rates.mean(axis=(1, 2))
    )
    reached = mean.roots(extrapolate=False)[0]
    locks = lock_times(times, angles, rates) / opening_time(ideal, start).time - 1.0
    return Difference(
        reached / opening_time(ideal, start, math.radians(2.5)).time - 1.0,
        locks.min(),
        locks.mean(),
        locks.max(),
        len(times) - 1,
    )


def show(label: str, found: Difference) -> None:
    print(
        f"| {label} | {found.at_175:+.1e} | {found.first_lock:+.1e} | {found.mean_lock:+.1e} | "
        f"{found.last_lock:+.1e} | {found.steps} |",
        flush=True,
    )


def main(counts: list[int]) -> None:
    head = "| at 175 deg | first lock | mean lock | last lock | steps |"
    print(f"| sections, base, net {head}\n|---|---|---|---|---|---|")
    for sections in counts:
        for fixed in (False, True):
            for net in (False, True):
                words = f"{'fixed' if fixed else 'free'}, {'net' if net else 'none'}"
                show(f"{sections}, {words}", compare(ring(sections, fixed=fixed, net=net)))
    print(f"\n| 6 sections, Young's modulus {head}\n|---|---|---|---|---|---|")
    for base in ("free", "fixed"):
        for factor in (1, 10, 100):
            scene = ring(6, fixed=base == "fixed", net=False)
            scene = scene.with_values({"rods.young_modulus": 120e9 * factor})
            show(f"{base}, {120 * factor} GPa", compare(scene))


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [6, 12, 18, 30])
