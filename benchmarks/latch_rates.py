"""How far rates at latches are off by steps, and whether runs say so.

Run: python benchmarks/latch_rates.py

Frames of six scenes at their own tolerance, 0.3 and 0.1 of it, against 0.01 of it: the largest
error of all V-joints and its root mean square, and how many rates that are off by more than 5 %
have steps that leave them uncertain by more than that (``ringsim.outputs.base.uncertain``).
"""

from __future__ import annotations

import numpy as np

from ringsim.frame.integrate import Integration
from ringsim.frame.model import FrameModel
from ringsim.layout.layout import layout_of
from ringsim.outputs.base import SURE, jolted, uncertain
from ringsim.outputs.family import slowest_period
from ringsim.scene import Scene, load_scene
from ringsim.stepping.locks import History, history, lock_times

SCENES = (
    ("ring18-flight", {}), ("ring18-flight", {"structure.sections": 12}),
    ("ring18-cable", {"structure.sections": 6, "boom": "none"}), ("ring18-cable", {}),
    ("ring18-motor", {}), ("ring18-ground", {}),
)  # fmt: skip
SHARES = (1.0, 0.3, 0.1)
FINEST = 0.01


def found(scene: Scene, share: float) -> tuple[History, np.ndarray]:
    """What became of the latches at a share of the scene's tolerance, and the uncertain shares."""
    own = scene.with_values({"solver.tolerance": share * scene.solver.tolerance})
    run = Integration(FrameModel(own)).run()
    times, angles, rates = (np.array(each) for each in (run.times, run.angles, run.rates))
    told = history(own, times, angles, rates)
    locks = lock_times(times, angles, rates)
    return told, uncertain(told, jolted(times, locks, slowest_period(layout_of(own))))


def main() -> None:
    """Print a row a run, and what all say together."""
    off, told, good = 0, 0, np.zeros(2, dtype=int)
    for name, values in SCENES:
        scene = load_scene(name).with_values(values)
        true, _ = found(scene, FINEST)
        for share in SHARES:
            coarse, unsure = found(scene, share)
            errors = np.abs(coarse.rates / true.rates - 1.0)
            wrong, said = errors > SURE, unsure > SURE
            off, told = off + int(wrong.sum()), told + int((wrong & said).sum())
            good += int((~wrong & said).sum()), int((~wrong).sum())
            print(
                f"{name} {values} at {share:g} of its tolerance: largest error "
                f"{errors.max():.3f}, root mean square {np.sqrt(np.mean(errors**2)):.3f}",
                flush=True,
            )
    print(f"told are {told} of {off} rates that are off by more than {SURE:g}, and {good[0]} of "
          f"{good[1]} others")  # fmt: skip


if __name__ == "__main__":
    main()
