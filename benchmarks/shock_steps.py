"""What steps at locks cost, and what they make of the shocks there.

Run: python benchmarks/shock_steps.py [--random N]

For each scene, number of steps in the slowest rod's period at a lock and time since it over the
next step (``FRONT`` and ``GRADE`` of ``ringsim.stepping.repeats``): steps, processor time over that
of steps that follow the mean motion alone, and by how much the largest base force, base torque,
impulse of a stop and acceleration are larger than with 512, 128 and a tenth of the tolerance.
With ``--random`` instead the errors of the random rings on held bases among the first N of
benchmarks/error_bars.py: their median and third quartile, against a 64th of the tolerance, and the
median ratio of steps to those of the first rule that follows shocks.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from error_bars import random_scene

import ringsim
from ringsim.stepping import repeats

LARGE = {
    "structure.sections": 12, "structure.aspect_ratio": 1.0, "structure.half_bar": 1.0287,
    "structure.half_diagonal": 1.522, "structure.corner_mass": 0.15, "structure.vjoint_mass": 0.1,
    "rods.diagonal.outer_diameter": 0.025, "rods.diagonal.inner_diameter": 0.023,
    "rods.bar.outer_diameter": 0.030, "rods.bar.inner_diameter": 0.028, "boom.length": 3.2,
    "joints.vjoint.coulomb": 0.05, "joints.vjoint.viscous": 2.0, "joints.pivot.coulomb": 0.02,
    "stop.stiffness": 1000.0, "stop.damping": 2.5, "latch.peak_torque": 0.05,
    "cables.upper.winch.winding.speed": 400.0, "cables.lower.winch.winding.speed": 380.0,
}  # fmt: skip
"""A ring of 8 m, which opens in flight within 17 minutes."""
SCENES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("ring18-ground", {}), ("ring18-ground", {"structure.sections": 6}), ("ring18-flight", {}),
    ("ring18-flight", LARGE),
)  # fmt: skip
NAMES = "peak_base_force", "peak_base_torque", "peak_lock_impulse", "peak_acceleration_max"
RULES = (1e-9, 1e-9), (32.0, 4.0), (64.0, 16.0), (64.0, 32.0), (128.0, 32.0)
"""The first is none: steps follow the mean motion alone."""
FINEST = 512.0, 128.0


def found(
    scene: ringsim.Scene, front: float, grade: float
) -> tuple[dict[str, float], int, float]:  # fmt: skip
    """Largest values, steps and processor time of a run with such steps."""
    repeats.FRONT, repeats.GRADE, begun = front, grade, time.process_time()
    run = ringsim.simulate(scene, fidelity="frame")
    taken = time.process_time() - begun
    return {name: float(run[name]) for name in NAMES}, int(run["steps"]), taken


def random_rings(count: int) -> None:
    """Print a row a rule."""
    errors: list[list[list[float]]] = [[] for _ in RULES]
    steps: list[list[int]] = [[] for _ in RULES]
    for seed in range(count):
        scene = random_scene(seed)
        if not scene.held or "peak_base_force" not in ringsim.simulate(scene, fidelity="frame"):
            continue
        solver = scene.solver
        fine = {
            "solver.tolerance": solver.tolerance / 64.0, "solver.step": solver.step / 8.0,
            "solver.newton_tolerance": solver.newton_tolerance / 100.0,
            "solver.step_limit": 200_000,
        }  # fmt: skip
        true, *_ = found(scene.with_values(fine), 128.0, 32.0)
        for rule, own, taken in zip(RULES, errors, steps, strict=True):
            largest, number, _ = found(scene, *rule)
            own.append([abs(largest[n] / true[n] - 1.0) for n in NAMES])
            taken.append(number)
    print(f"{len(errors[0])} rings")
    print(f"| steps in a period | time over step | steps | {' | '.join(NAMES)} |")
    print("|---|---|---|" + "---|" * len(NAMES))
    for (front, grade), own, taken in zip(RULES, errors, steps, strict=True):
        ratio = np.median(np.array(taken) / np.array(steps[1]))
        middle, upper = (np.nanquantile(own, share, axis=0) for share in (0.5, 0.75))
        cells = [f"{a:.1%} and {b:.0%}" for a, b in zip(middle, upper, strict=True)]
        print(f"| {front:g} | {grade:g} | {ratio:.2f} | {' | '.join(cells)} |")


def main() -> None:
    """Print a row a scene and rule."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--random", type=int, default=0)
    if count := parser.parse_args().random:
        random_rings(count)
        return
    head = "scene", "steps in a period", "time over step", "steps", "time", *NAMES
    print(f"| {' | '.join(head)} |")
    print("|---|---|---|---|---|" + "---|" * len(NAMES))
    for name, values in SCENES:
        plain = {"record.reactions": True, "record.accelerations": True}
        scene = ringsim.load_scene(name).with_values(values | plain)
        fine = {"solver.tolerance": 0.1 * scene.solver.tolerance, "solver.step_limit": 200_000}
        true, *_ = found(scene.with_values(fine), *FINEST)
        once = 0.0
        for front, grade in RULES:
            own, steps, taken = found(scene, front, grade)
            once = once or taken
            errors = " | ".join(f"{100.0 * (own[n] / true[n] - 1.0):+.0f} %" for n in NAMES)
            words = f"{name}, {scene.structure.sections} sections" + ", 8 m" * (values is LARGE)
            count = "none" if front < 1.0 else f"{front:g}"
            cells = words, count, "-" if front < 1.0 else f"{grade:g}", steps, f"{taken / once:.2f}"
            print(f"| {' | '.join(map(str, cells))} | {errors} |", flush=True)


if __name__ == "__main__":
    main()
