"""Are the error bars of a run honest?  Random scenes against runs that are finer by far.

Run: python benchmarks/error_bars.py [--first SEED] [--scenes N] [--processes N] [--file F] [--fit]
         [--fidelity full] [--motors]

Each scene is drawn from a seed of its own: closed rings and open arcs, one in eight of 8 to 18
sections, driven by forces or by cables with a winch at one end or at both, free or clamped, soft
and stiff, slow and fast, with and without friction, damping and latches, at tolerances from 3e-4
to 3e-3; with ``--motors`` rings of 4 to 8 sections with an edge net, that motors open.  One in
three is ended before it has deployed.  The frame engine runs them, or the full
one: both have the same integrator and bars.  The truth of a scene is a run with steps shorter by 6
to 16, four or six times the elements and a hundredth of Newton's tolerance: the finest that is not
too dear for its scene.  Printed per output: how often the bar covers the error, and the ratios of
error to bar; of the asynchrony over time, at the output time where its bar is worst.

What every scene gave is kept in the file (runs/error-bars-FIRST.json) as it comes; scenes that are
there are not run again, so that other factors (``ErrorBar`` in ringsim/outputs) are judged at once.
``--fit`` prints the factors that suit these scenes; judge them by scenes that they have not seen.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.outputs.balance import OF_DIFFERENCE, bar, differences, largest, refined, rules
from ringsim.scene import Scene, load_scene
from ringsim.simulation import FIDELITIES
from ringsim.variables import Outcome, Status

TRUTHS = ((256.0, 6), (100.0, 4), (64.0, 4), (36.0, 4))
"""Divisor of the tolerance and factor on the elements, finest first: the second run has 4 and 2."""
DEAR = 200_000
"""Residuals times sections times elements (twice that with cables) of a truth; about 10 s of the
frame engine."""
ENDED = 1.0 / 3.0
"""Share of the scenes that end before they have deployed, at 30 to 95 % of the time it takes."""
FRICTIONS = ("bearing", "bearing-exact", "capstan")
COVERED = 0.95
"""Share of errors that fitted factors cover: more than promised, for scenes not seen."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_scene(seed: int) -> Scene:
    """A scene that nobody has tuned."""
    rng = np.random.default_rng([2028, seed])
    large = bool(rng.random() < 0.125)
    cables = bool(rng.random() < (0.3 if large else 0.5))
    closed = large or bool(rng.random() < 0.7)
    if large:
        sections = int(rng.integers(8, 11 if cables else 19))
    else:
        sections = int(rng.integers(3, 6)) if closed else int(rng.integers(1, 4))
    values: dict[str, Any] = {
        "structure.sections": sections,
        "structure.closed": closed,
        "structure.aspect_ratio": float(rng.uniform(0.8, 1.0)) if closed else 1.0,
        "structure.opening_angle": float(rng.uniform(15.0, 90.0)),
        "rods.young_modulus": log_uniform(rng, 30e9, 400e9),
        "rods.damping": float(rng.choice([0.0, 1e-4, 1e-3])),
        "structure.corner_mass": log_uniform(rng, 0.01, 0.1),
        "stop.stiffness": log_uniform(rng, 15.0, 700.0),
        "stop.damping": log_uniform(rng, 0.05, 1.0),
        "stop.latch": bool(rng.random() < 0.7),
        "rods.elements": 2 if not large and rng.random() < 0.2 else 1,
        "boom.base": "free" if closed and rng.random() < 0.6 else "fixed",
        "net": "none",
        "record.stress": bool(rng.random() < 0.7),
        "record.interval": 0.05,
        "record.reactions": True,
        "record.accelerations": True,
        "solver.tolerance": log_uniform(rng, 1e-3 if large and cables else 3e-4, 3e-3),
    }
    if not closed:
        values |= {"structure.polygon_sections": 18, "joints.hinge.viscous": 1e-3}
    if cables:
        base = load_scene("ring18-cable" if closed else "truss2")
        speed = log_uniform(rng, 0.015, 0.2)
        winch: dict[str, Any] = {
            "kind": "ramp",
            "speed": speed,
            "duration": float(rng.uniform(0.3, 2.0)),
        }
        if rng.random() < 0.15:
            target = log_uniform(rng, 0.3, 3.0)
            winch = {"kind": "tension-feedback", "target": target, "max_speed": 3.0 * speed}
        end, kind = str(rng.choice(["first", "first", "both"])), str(rng.choice(FRICTIONS))
        for plane in ("upper", "lower"):
            coefficient = float(rng.uniform(0.0, 0.08 if kind == "capstan" else 8e-4))
            values |= {
                f"cables.{plane}.friction": {"kind": kind, "coefficient": coefficient},
                f"cables.{plane}.axial_stiffness": log_uniform(rng, 4e3, 5e5),
                f"cables.{plane}.slack_width": log_uniform(rng, 5e-3, 5e-2),
                f"cables.{plane}.end": end,
                f"cables.{plane}.winch.winding": winch,
            }
        values["joints.vjoint.viscous"] = log_uniform(rng, 0.02, 0.8)
        ends = 2.0 if end == "both" else 1.0
        values["solver.end_time"] = float(sections) * 0.3 / speed / ends + 10.0
    else:
        base = load_scene("ring18")
        values["loads.force"] = log_uniform(rng, 0.01, 0.1)
        if rng.random() < 0.5:
            values["joints.vjoint.viscous"] = log_uniform(rng, 1e-4, 3e-3)
    return base.with_values(values)


def motor_scene(seed: int) -> Scene:
    """A ring with a net that motors open, which nobody has tuned."""
    rng = np.random.default_rng([2030, seed])
    speed = log_uniform(rng, 100.0, 500.0)
    values: dict[str, Any] = {
        "structure.sections": int(rng.integers(4, 9)),
        "structure.opening_angle": float(rng.uniform(15.0, 60.0)),
        "structure.corner_mass": log_uniform(rng, 0.01, 0.1),
        "joints.vjoint.coulomb": log_uniform(rng, 1e-3, 2e-2),
        "joints.vjoint.viscous": log_uniform(rng, 0.02, 0.8),
        "stop.latch": bool(rng.random() < 0.7),
        "net.axial_stiffness": log_uniform(rng, 100.0, 5000.0),
        "net.strain": float(rng.uniform(0.001, 0.01)),
        "margin": "none",
        "record.interval": 0.05,
        "solver.end_time": 100.0,
        "solver.tolerance": log_uniform(rng, 3e-4, 3e-3),
    }
    inertia = log_uniform(rng, 1e-8, 1e-6) if rng.random() < 0.5 else 0.0
    ramp = float(rng.uniform(0.3, 3.0)) if rng.random() < 0.5 else 0.0
    for plane in ("upper", "lower"):
        winding = f"cables.{plane}.winch.winding"
        values |= {
            f"{winding}.stall_torque": log_uniform(rng, 2e-3, 2e-2),
            f"{winding}.speed": speed,
            f"{winding}.torque_constant": 0.02,
            f"{winding}.no_load_current": 0.01,
            f"cables.{plane}.friction.coefficient": float(rng.uniform(0.0, 8e-4)),
        }
        values |= {f"{winding}.rotor_inertia": inertia} if inertia else {}
        values |= {f"{winding}.ramp": ramp} if ramp else {}
    if not values["stop.latch"]:
        values["latch"] = "none"
    return load_scene("ring18-motor").with_values(values)


def truth_of(scene: Scene, found: Outcome) -> Scene:
    """The finest run of a scene that is not too dear, judged by what a plain one took."""
    residuals = int(found.values["steps"] + found.values["newton_iterations"])
    size = scene.structure.sections * (1 if scene.cables is None else 2)
    for divisor, more in TRUTHS:
        elements = scene.rods.elements * more
        if residuals * size * math.sqrt(divisor) * elements <= DEAR:
            break
    return scene.with_values(
        {
            "solver.tolerance": scene.solver.tolerance / divisor,
            "solver.step": scene.solver.step / math.sqrt(divisor),
            "solver.newton_tolerance": scene.solver.newton_tolerance / 100.0,
            "rods.elements": elements,
            "solver.step_limit": 200_000,
        }
    )


def compare(seed: int, fidelity: str, motors: bool) -> dict[str, Any]:
    """Value, error and difference of the two runs, for every output of one scene."""
    begin, run = time.process_time(), FIDELITIES[fidelity]
    scene = motor_scene(seed) if motors else random_scene(seed)
    one = run(scene)
    rng = np.random.default_rng([2029, seed])
    deployed, part = one.values.get("deployment_time", np.nan), rng.uniform(0.3, 0.95)
    if rng.random() < ENDED and np.isfinite(deployed) and part * deployed > scene.solver.step:
        scene = scene.with_values({"solver.end_time": round(float(part * deployed), 2)})
        one = run(scene)
    found: dict[str, Any] = {
        "seed": seed,
        "status": one.status.word,
        "fate": one.fate.word,
        "reason": one.reason,
        "sections": scene.structure.sections,
        "elements": scene.rods.elements,
        "tolerance": scene.solver.tolerance,
    }
    if one.status == Status.OK:
        used = scene.solver.refined(int(one.values["restarts"]))
        finer = run(refined(scene.model_copy(update={"solver": used})))
        finest = truth_of(scene, one)
        truth = run(finest)
        found |= {
            "finer": finer.status.word,
            "truth": truth.status.word,
            "finest": [scene.solver.tolerance / finest.solver.tolerance, finest.rods.elements],
            "cost": 1.0 + float(finer.values["cpu_time"] / one.values["cpu_time"]),
        }
        if finer.status == truth.status == Status.OK:
            found["outputs"] = outputs_of(one, finer, truth)
    return found | {"seconds": time.process_time() - begin}


def outputs_of(one: Outcome, finer: Outcome, truth: Outcome) -> dict[str, list[float]]:
    """Value, error and difference of every output; of the asynchrony at the time that is worst."""
    apart = differences(one, finer)
    errors = {n: largest(n, np.abs(one.values[n] - truth.values[n])) for n in apart}
    values = {name: largest(name, one.values[name]) for name in apart}
    found = {n: [values[n], errors[n], apart[n]] for n in apart if n != "asynchrony"}
    if "asynchrony" in apart:
        error = np.abs(one.values["asynchrony"] - truth.values["asynchrony"])
        bars = bar("asynchrony", apart["asynchrony"])
        there = np.isfinite(error) & (apart["asynchrony"] > 0.0)
        worst = int(np.argmax(np.where(there, error / np.maximum(bars, 1e-300), 0.0)))
        series = (values["asynchrony"], error, apart["asynchrony"])
        found["asynchrony"] = [s[worst] for s in series]
    return {
        name: [float(each) for each in row] for name, row in found.items() if np.isfinite(row).all()
    }


def columns(rows: list[dict[str, Any]], name: str) -> np.ndarray:
    """Value, error and difference of an output, shape (3, scenes)."""
    cells = [row["outputs"][name] for row in rows if name in row.get("outputs", {})]
    return np.array(cells, dtype=float).reshape(-1, 3).T


def ratios(name: str, table: np.ndarray) -> np.ndarray:
    """Error over bar of an output."""
    _, error, apart = table
    return np.maximum(error, 1e-300) / np.maximum(bar(name, apart), 1e-300)


def shares(ratio: np.ndarray) -> str:
    """Cells of a table: covered, median ratio, share of ratios within a factor 10."""
    within = np.mean((ratio < 10.0) & (ratio > 0.1))
    return f"{np.mean(ratio <= 1.0):.0%} | {np.median(ratio):.2f} | {within:.0%}"


def summarise(rows: list[dict[str, Any]]) -> None:
    good = [row for row in rows if row.get("outputs")]
    print(f"\n{len(good)} scenes of {len(rows)} have error bars and a truth.", end=" ")
    for row in rows:
        if not row.get("outputs"):
            steps = ", ".join(f"{k} {row[k]}" for k in ("status", "finer", "truth") if k in row)
            print(f"Not {row['seed']} ({steps}).", end=" ")
    seconds = sum(row["seconds"] for row in rows)
    print(f"All took {seconds / 60.0:.1f} minutes of processor time.", end=" ")
    if good:
        cost = np.median([row["cost"] for row in good])
        print(f"With bars a run costs {cost:.2f} times as much (median).", end=" ")
        large = sum(row["sections"] >= 8 for row in good)
        ended = sum(row["fate"] != "deployed" for row in good)
        print(f"{large} scenes have 8 sections or more, {ended} did not deploy.")
    print("\n| output | scenes | median error | covered | error over bar, median | within 10 |")
    print("|---|---|---|---|---|---|")
    every = []
    for name in rules():
        table = columns(good, name)
        if table.size == 0:
            print(f"| {name} | 0 | | | | |")
            continue
        ratio = ratios(name, table)
        every.append(ratio)
        error = np.median(table[1] / np.maximum(table[0], 1e-300))
        print(f"| {name} | {len(ratio)} | {error:.1e} | {shares(ratio)} |")
    if every:
        ratio = np.concatenate(every)
        print(f"| all | {len(ratio)} | | {shares(ratio)} |")


def fit(rows: list[dict[str, Any]]) -> None:
    """Print the least factors that cover enough errors."""
    print("\n| output | safety | covered | error over bar, median | within 10 |")
    print("|---|---|---|---|---|")
    for name in rules():
        table = columns(rows, name)
        if table.size == 0:
            continue
        _, error, apart = np.maximum(table, 1e-300)
        needed = error / (OF_DIFFERENCE * apart)
        safety = float(np.quantile(needed, COVERED, method="higher"))
        print(f"| {name} | {safety:.2g} | {shares(needed / safety)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--file", type=Path)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--fidelity", choices=["frame", "full"], default="frame")
    parser.add_argument("--motors", action="store_true")
    asked = parser.parse_args()
    file = asked.file or Path(f"runs/error-bars{'-motors' * asked.motors}-{asked.first}.json")
    wanted = range(asked.first, asked.first + asked.scenes)
    rows = json.loads(file.read_text()) if file.exists() else []
    missing = [seed for seed in wanted if seed not in {row["seed"] for row in rows}]
    file.parent.mkdir(parents=True, exist_ok=True)
    of_one = partial(compare, fidelity=asked.fidelity, motors=asked.motors)
    with multiprocessing.Pool(asked.processes, os.nice, (5,), maxtasksperchild=10) as pool:
        for row in pool.imap_unordered(of_one, missing):
            rows.append(row)
            file.write_text(json.dumps(rows))
            print(row["seed"], row["status"], f"{row['seconds']:.0f} s", flush=True)
    rows = sorted((row for row in rows if row["seed"] in wanted), key=lambda row: int(row["seed"]))
    summarise(rows)
    if asked.fit:
        fit(rows)


if __name__ == "__main__":
    main()
