"""How far rates at latches are off by steps, and whether runs say so.

Run: python benchmarks/latch_rates.py

Frames of scenes at their own tolerance, 0.3 and 0.1 of it, against 0.01 of it: the largest error
of all V-joints and its root mean square, and how many rates that are off by more than 5 % have
steps that leave them uncertain by more than that (``ringsim.outputs.base.uncertain``).  The rule
was fitted to the first scenes, and is judged by the others.
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

LONG = {
    "structure.sections": 12, "structure.aspect_ratio": 1.0, "structure.half_bar": 1.0287,
    "structure.half_diagonal": 1.5222, "boom.length": 3.2, "latch.min_rate": 0.2,
    "rods.diagonal": {"outer_diameter": 0.016, "inner_diameter": 0.0145},
    "rods.bar": {"outer_diameter": 0.020, "inner_diameter": 0.0185},
    **{f"cables.{plane}.friction.coefficient": 0.0002 for plane in ("upper", "lower")},
    **{f"cables.{plane}.winch.winding.stall_torque": 0.013 for plane in ("upper", "lower")},
    "solver.end_time": 120.0,
}  # fmt: skip
"""A ring of 8 m and two motors: locks follow one another within a period of its rods."""
UPPER, LOWER = (f"cables.{plane}.winch.winding.stall_torque" for plane in ("upper", "lower"))
FITTED = (
    ("ring18-flight", {}), ("ring18-flight", {"structure.sections": 12}),
    ("ring18-cable", {"structure.sections": 6, "boom": "none"}), ("ring18-cable", {}),
    ("ring18-motor", {}), ("ring18-ground", {}), ("ring18-motor", {"structure.sections": 12}),
    ("ring18-motor", {"structure.sections": 8}), ("ring18-motor", LONG),
    ("ring18-motor", LONG | {UPPER: 0.009, LOWER: 0.008}),
    ("ring18-motor", LONG | {"joints.vjoint.coulomb": 0.05}),
    ("ring18-motor", LONG | {"rods.young_modulus": 60e9}),
)  # fmt: skip
OTHERS = (
    ("ring18-motor", LONG | {"structure.sections": 18, UPPER: 0.02, LOWER: 0.02}),
    ("ring18-motor", LONG | {"structure.sections": 8}),
    ("ring18-motor", LONG | {"joints.vjoint.viscous": 0.2}),
    ("ring18-motor", LONG | {"net.axial_stiffness": 3000.0}),
    ("ring18-motor", LONG | {"rods.young_modulus": 300e9}),
    ("ring18-motor", LONG | {"boom.base": "fixed"}),
    ("ring18-cable", {"structure.sections": 12}), ("ring18-motor", {"structure.sections": 6}),
    ("ring18-flight", {"structure.sections": 8}), ("ring18-motor", {"rods.young_modulus": 30e9}),
    ("ring18-cable", {"rods.young_modulus": 30e9, "structure.sections": 9}),
)  # fmt: skip
SHARES = (1.0, 0.3, 0.1)
FINEST = 0.01


def found(scene: Scene, share: float) -> tuple[History, np.ndarray]:
    """What became of the latches at a share of the scene's tolerance, and the uncertain shares."""
    own = scene.with_values({"solver.tolerance": share * scene.solver.tolerance})
    run = Integration(FrameModel(own)).run()
    times, angles, rates = (np.array(each) for each in (run.times, run.angles, run.rates))
    period, locks = slowest_period(layout_of(own)), lock_times(times, angles, rates)
    told = history(own, times, angles, rates, period)
    return told, uncertain(told, jolted(times, locks, period))


def judge(scenes: tuple[tuple[str, dict[str, object]], ...]) -> None:
    """Print a row a run, and what all say together."""
    off, told, good = 0, 0, np.zeros(2, dtype=int)
    for name, values in scenes:
        scene = load_scene(name).with_values(values)
        true, _ = found(scene, FINEST)
        for share in SHARES:
            coarse, unsure = found(scene, share)
            errors = np.abs(coarse.rates / true.rates - 1.0)
            wrong, said = errors > SURE, unsure > SURE
            off, told = off + int(wrong.sum()), told + int((wrong & said).sum())
            good += int((~wrong & said).sum()), int((~wrong).sum())
            long = values.get("structure.half_bar") == LONG["structure.half_bar"]
            own = {k: v for k, v in values.items() if not long or LONG.get(k) != v}
            print(
                f"{name}{' long' * long} {own} at {share:g} of its tolerance: largest error "
                f"{errors.max():.3f}, root mean square {np.sqrt(np.mean(errors**2)):.3f}",
                flush=True,
            )
    print(f"told are {told} of {off} rates that are off by more than {SURE:g}, and {good[0]} of "
          f"{good[1]} others")  # fmt: skip


if __name__ == "__main__":
    judge(FITTED)
    judge(OTHERS)
