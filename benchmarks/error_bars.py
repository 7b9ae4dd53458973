"""Are the error bars of a run honest?  Random scenes against runs that are finer by far.

Run: python benchmarks/error_bars.py [scenes] [processes] [file]

Each scene is drawn from a seed of its own: closed rings and open arcs, driven by forces or by
cables, free or clamped, soft and stiff, with and without net, friction and damping.  The truth of
a scene is a run with a ninth of its tolerance, twice the elements and a hundredth of
Newton's tolerance.  Printed per output: how often the bar covers the error, and the ratios of bar
to error.  What every scene gave is kept in the file (runs/error-bars.json) as it comes; scenes that
are there are not run again.
"""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.scene import Scene, load_scene
from ringsim.simulation import run
from ringsim.variables import Status

OUTPUTS = ("deployment_time", "opening_angle", "asynchrony_max", "peak_tension", "peak_rod_stress")


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_scene(seed: int) -> Scene:
    """A scene that nobody has tuned."""
    rng = np.random.default_rng([2026, seed])
    cables = bool(rng.random() < 0.35)
    closed = bool(rng.random() < 0.7)
    values: dict[str, Any] = {
        "structure.sections": int(
            rng.integers(3, 6) if closed and not cables else 3 if closed else 2
        ),
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
        speed = log_uniform(rng, 0.06, 0.2)
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
            "solver.tolerance": scene.solver.tolerance / 9.0,
            "solver.newton_tolerance": scene.solver.newton_tolerance / 100.0,
            "rods.elements": 2 * scene.rods.elements,
            "solver.step_limit": 200_000,
        }
    )


def compare(seed: int) -> dict[str, Any]:
    """Value, error and bar of every output of one scene."""
    scene = random_scene(seed)
    barred = run(scene.with_values({"solver.error_bars": True}))
    found: dict[str, Any] = {
        "seed": seed,
        "status": barred.status.word,
        "reason": barred.reason,
    }
    if seed % 10 == 0:
        found["cost"] = float(barred.values["cpu_time"] / run(scene).values["cpu_time"])
    if barred.status != Status.OK:
        return found
    truth = run(finer(scene))
    found |= {"truth": truth.status.word, "outputs": {}}
    if truth.status != Status.OK:
        return found
    one, fine = barred.values, truth.values
    for name in OUTPUTS:
        if f"{name}_error" not in one:
            continue
        if name == "opening_angle":
            error = float(np.nanmax(np.abs(one[name] - fine[name])))
            value = 180.0
        else:
            error, value = abs(float(one[name] - fine[name])), abs(float(fine[name]))
        found["outputs"][name] = [value, error, float(one[f"{name}_error"])]
    return found


def summarise(rows: list[dict[str, Any]]) -> None:
    good = [row["outputs"] for row in rows if row.get("outputs")]
    others = [f"{row['seed']}: {row['status']}" for row in rows if not row.get("outputs")]
    cost = np.median([row["cost"] for row in rows if "cost" in row])
    print(f"\n{len(good)} scenes of {len(rows)} ended well{': not ' if others else ''}", end="")
    print(f"{', '.join(others)}; with bars a run costs {cost:.2f} times as much (median)\n")
    print("| output | scenes | median error | covered | bar over error, median | within 10 |")
    print("|---|---|---|---|---|---|")
    for name in OUTPUTS:
        table = np.array([row[name] for row in good if name in row])
        value, error, bar = np.maximum(table.T, 1e-300)
        ratio = bar / error
        print(
            f"| {name} | {len(table)} | {np.median(error / value):.1e} | "
            f"{np.mean(ratio >= 1):.0%} |"
            f" {np.median(ratio):.1f} | {np.mean((ratio < 10) & (ratio > 0.1)):.0%} |"
        )
    every = np.array([cell for row in good for cell in row.values()])
    ratio = every[:, 2] / np.maximum(every[:, 1], 1e-300)
    within = np.mean((ratio < 10) & (ratio > 0.1))
    print(f"| all | {len(every)} | | {np.mean(ratio >= 1):.0%} | {np.median(ratio):.1f} | ", end="")
    print(f"{within:.0%} |")


def main(scenes: int, processes: int, file: Path) -> None:
    rows = json.loads(file.read_text()) if file.exists() else []
    missing = sorted(set(range(scenes)) - {row["seed"] for row in rows})
    file.parent.mkdir(parents=True, exist_ok=True)
    with multiprocessing.Pool(processes, os.nice, (5,), maxtasksperchild=10) as pool:
        for row in pool.imap_unordered(compare, missing):
            rows.append(row)
            file.write_text(json.dumps(rows))
            print(row["seed"], row["status"], flush=True)
    summarise(sorted(rows, key=lambda row: int(row["seed"])))


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 100,
        int(sys.argv[2]) if len(sys.argv) > 2 else 2,
        Path(sys.argv[3]) if len(sys.argv) > 3 else Path("runs/error-bars.json"),
    )
