"""Time per sample of the ideal fidelity: many samples at once against one at a time.

Usage: python benchmarks/ideal_many.py [samples]
"""

from __future__ import annotations

import sys
import time

import numpy as np

from ringsim.scene import Scene, load_scene
from ringsim.simulation import run_ideal, run_ideal_many

ALONE = 4
"""Samples that are also run one at a time."""


def samples(count: int) -> list[Scene]:
    """ring18-cable with drawn pulley friction, cable stiffness and joint damping."""
    random = np.random.default_rng(1)
    base, found = load_scene("ring18-cable"), []
    for _ in range(count):
        friction, stiffness = float(random.uniform(0.0, 1e-3)), float(10 ** random.uniform(4, 6))
        values = {"joints.vjoint.viscous": float(random.uniform(0.2, 0.6))}
        for plane in ("upper", "lower"):
            values[f"cables.{plane}.friction.coefficient"] = friction
            values[f"cables.{plane}.axial_stiffness"] = stiffness
        found.append(base.with_values(values))
    return found


def main() -> None:
    scenes = samples(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
    start = time.process_time()
    together = run_ideal_many(scenes)
    many = (time.process_time() - start) / len(scenes)
    start = time.process_time()
    alone = [run_ideal(scene) for scene in scenes[:ALONE]]
    one = (time.process_time() - start) / ALONE
    apart = max(
        abs(float(a.values["deployment_time"] - b.values["deployment_time"]))
        for a, b in zip(alone, together, strict=False)
    )
    print(f"{len(scenes)} at once {many:.3f} s, one at a time {one:.3f} s per sample")
    print(f"gain {one / many:.1f}, deployment times differ by at most {apart:.1e} s")


if __name__ == "__main__":
    main()
