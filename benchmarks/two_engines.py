"""Do the two engines agree on random scenes to within their error bars?

    python benchmarks/two_engines.py run --out FILE.json [--scenes 40 --first 0]
    python benchmarks/two_engines.py run --out FILE.json --scenes 20 --first 1000   (or 2000)
    python benchmarks/two_engines.py run --out FILE.json --seeds 8 16 1014
    python benchmarks/two_engines.py table FILE.json
    python benchmarks/two_engines.py look SEED [--finer 16]

``run`` solves random scenes of rings and arcs (benchmarks/random_scenes.py: forces and cables, all
laws of friction and winding, booms, nets, faults; from seed 1000 on
benchmarks/random_load_scenes.py: motors, springs, weight on lines, spacecraft; from 2000 on
benchmarks/random_part_scenes.py: edge nets, latches, scatter of parts) by exudyn and in joint
coordinates, each with the error bars of its own two runs, and keeps what it finds as it
comes.  Scenes on which exudyn takes more than ``DEAR`` are left out: that says nothing about
agreement.  ``table`` compares all that has a bar: the difference over the sum of both bars, of
series where it is largest.  Both engines have the same elements, so that the part of a bar that
stands for one element a half says nothing about them; it is left out.  How the base turns, and what
it carries, have no bars: each engine runs such scenes once more with steps twice as long, and what
that changes stands for one.
``look`` runs one scene again in both at a tolerance divided by so much, to see whose a difference
is.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import random_load_scenes as loads
import random_part_scenes as parts
from random_scenes import random_scene

from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.outputs.balance import differences, error_bars, largest, rules
from ringsim.parts.solver import Solver
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.stepping.ending import run_with_restarts
from ringsim.variables import Outcome

ENGINES = {"exudyn": by_exudyn, "frames": by_frames}
DEAR = 25.0
"""Processor time of exudyn's run without bars, s."""
REPRESENTED = ("forces-ring", "forces-arc", "cables-ring", "cables-arc", "cable-faults",
               "constant-steps", *loads.FAMILIES, *parts.FAMILIES)  # fmt: skip
BASE = ("base_rotation", "base_force", "base_torque")
ROUND_OFF = 1e-12
"""Of them where nothing moves or pulls, as the turn of a fixed base, deg."""
LEAST = {"asynchrony": 1e-6}
"""Difference that is round-off: at the start of a run deviations and their bars are."""
ONE_ELEMENT = 10**6
"""Elements of a half at which a bar has no part for one element."""


def scene_of(seed: int) -> tuple[str, Scene] | None:
    """A seed's name and scene; None if frames do not represent its kind."""
    if seed < loads.FIRST:
        drawn = random_scene(seed)
    elif seed < parts.FIRST:
        drawn = loads.random_load_scene(seed)
    else:
        drawn = parts.random_part_scene(seed)
    kind = drawn["name"].split("-", 1)[1]
    if kind not in REPRESENTED:
        return None
    return drawn["name"], load_scene(drawn["scene"]).with_values(drawn["values"])


def outcome_of(engine: str, scene: Scene) -> Outcome:
    def start(solver: Solver) -> Outcome:
        return ENGINES[engine](scene.model_copy(update={"solver": solver}))

    return run_with_restarts(start, scene.solver, partial(error_bars, elements=ONE_ELEMENT))


def told(outcome: Outcome) -> dict[str, Any]:
    """How a run went."""
    steps = int(outcome.values.get("steps", 0))
    return {"status": outcome.status.word, "reason": outcome.reason, "steps": steps}


def apart(one: Outcome, two: Outcome) -> dict[str, tuple[float, float, float]]:
    """Value, difference and sum of both bars of everything that has bars; of a function of time
    where the difference over the bars is largest.
    """
    found = {}
    for name, difference in differences(one, two).items():
        bar = f"{name}_error"
        if bar not in one.values or bar not in two.values:
            continue
        bars = np.atleast_1d(one.values[bar] + two.values[bar])
        there = np.isfinite(bars) & (difference > LEAST.get(name, 0.0))
        if there.any():
            own, value = np.atleast_1d(difference), np.atleast_1d(largest(name, one.values[name]))
            worst = int(np.argmax(np.where(there, own / np.maximum(bars, 1e-300), -1.0)))
            found[name] = (float(value[worst]), float(own[worst]), float(bars[worst]))
    return found


def base_apart(scene: Scene, both: list[Outcome]) -> dict[str, tuple[float, float, float]]:
    """The same of the base, for all of its series that are long enough to be compared."""
    double = scene.with_values({"solver.error_bars": False})
    double = double.model_copy(update={"solver": double.solver.scaled(2.0)})
    coarse = [engine(double) for engine in ENGINES.values()]
    found = {}
    for name in BASE:
        if all(name in outcome.values for outcome in (*both, *coarse)):
            one, two, *others = (outcome.values[name] for outcome in (*both, *coarse))
            value = float(np.nanmax(np.abs(one)))
            bars = sum(_farthest(x, y) for x, y in zip((one, two), others, strict=True))
            if value > ROUND_OFF:
                found[name] = value, _farthest(one, two), bars
    return found


def _farthest(one: Any, two: Any) -> float:
    """Largest difference of two series as long as both run."""
    return float(np.nanmax(np.abs(one - two)))


def run(asked: argparse.Namespace) -> None:
    rows: list[dict[str, Any]] = []
    if asked.out.exists():
        rows = json.loads(asked.out.read_text())
    known = {row["seed"] for row in rows}
    for seed in asked.seeds or count(asked.first):
        if sum("exudyn" in row for row in rows) >= asked.scenes:
            break
        found = None if seed in known else scene_of(seed)
        if found is not None:
            name, scene = found
            row = {"seed": seed, "name": name} | compare(scene)
            rows.append(row)
            asked.out.write_text(json.dumps(rows, indent=1))
            print(name, row.get("left_out", row.get("cpu")), flush=True)


def compare(scene: Scene) -> dict[str, Any]:
    if scene.boom is not None or scene.structure.supported:
        scene = scene.with_values({"record.reactions": True})
    begin = time.process_time()
    try:
        by_frames(scene.with_values({"solver.step_limit": 1}))
    except InputError as error:
        return {"left_out": f"refused: {error}"}
    begin = time.process_time()
    one = by_exudyn(scene)
    if (taken := time.process_time() - begin) > DEAR:
        return {"left_out": f"{taken:.0f} s", "reason": one.reason}
    begin = time.process_time()
    one = outcome_of("exudyn", scene)
    half = time.process_time()
    two = outcome_of("frames", scene)
    cpu = [half - begin, time.process_time() - half]
    found = apart(one, two) | base_apart(scene, [one, two])
    return {"exudyn": told(one), "frames": told(two), "cpu": cpu, "apart": found}


def table(asked: argparse.Namespace) -> None:
    rows = json.loads(asked.out.read_text())
    both = [row for row in rows if "exudyn" in row]
    shares: dict[str, list[tuple[float, float]]] = {}
    print("| scene | exudyn | frames | steps | processor time, s | difference over both bars |")
    print("|---|---|---|---|---|---|")
    for row in both:
        one, two = row["exudyn"], row["frames"]
        found = {n: far / max(bar, 1e-300) for n, (_, far, bar) in row["apart"].items()}
        for name, (value, difference, _) in row["apart"].items():
            own = (found[name], difference / max(abs(value), 1e-300))
            shares.setdefault(name, []).append(own)
        steps = f"{one['steps']} / {two['steps']}"
        cpu = " / ".join(f"{t:.1f}" for t in row["cpu"])
        cells = ", ".join(f"{name} {ratio:.2g}" for name, ratio in found.items())
        print(f"| {row['name']} | {one['status']} | {two['status']} | {steps} | {cpu} | {cells} |")
    print("\n| output | scenes | within both bars | median difference over bars | over value |")
    print("|---|---|---|---|---|")
    every: list[tuple[float, float]] = []
    for name, own in shares.items():
        every += own
        print(f"| {name} | {cells_of(own)} |")
    print(f"| all | {cells_of(every)} |")
    left = [f"{row['name']} ({row['left_out']})" for row in rows if "left_out" in row]
    print(f"\nLeft out: {', '.join(left) or 'none'}.")


def cells_of(own: list[tuple[float, float]]) -> str:
    ratio, share = np.array(own).T
    within, middle = np.mean(ratio <= 1.0), np.median(ratio)
    return f"{len(own)} | {within:.0%} | {middle:.2g} | {np.median(share):.1e}"


def look(asked: argparse.Namespace) -> None:
    found = scene_of(asked.seed)
    assert found is not None, "frames do not represent this kind of scene"
    scene = found[1].with_values({"solver.error_bars": False, "solver.step_limit": 100_000})
    for divisor in (1.0, asked.finer):
        changes: dict[str, Any] = {
            "solver.tolerance": max(scene.solver.tolerance / divisor, 1e-8),
            "solver.step": scene.solver.step / divisor**0.5,
            "solver.newton_tolerance": scene.solver.newton_tolerance / divisor,
        }
        outcomes = {n: engine(scene.with_values(changes)) for n, engine in ENGINES.items()}
        for name in ("steps", "energy_error", *rules()):
            values = [o.values.get(name) for o in outcomes.values()]
            if any(v is None or np.ndim(v) for v in values):
                continue
            print(f"{divisor:6g} {name:24s}", *(f"{float(v):.8g}" for v in values))
        print(*(f"{n}: {o.status.word}, {o.reason}" for n, o in outcomes.items()), sep="\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    verbs = parser.add_subparsers(required=True)
    runs = verbs.add_parser("run")
    runs.add_argument("--out", type=Path, required=True)
    runs.add_argument("--scenes", type=int, default=40)
    runs.add_argument("--first", type=int, default=0, help="seed of the first scene")
    runs.add_argument("--seeds", type=int, nargs="+", help="these alone")
    runs.set_defaults(act=run)
    tables = verbs.add_parser("table")
    tables.add_argument("out", type=Path)
    tables.set_defaults(act=table)
    looks = verbs.add_parser("look")
    looks.add_argument("seed", type=int)
    looks.add_argument("--finer", type=float, default=16.0)
    looks.set_defaults(act=look)
    asked = parser.parse_args()
    asked.act(asked)


if __name__ == "__main__":
    main()
