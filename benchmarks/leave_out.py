"""What each part of a scene costs, and what changes without it.

Run: python benchmarks/leave_out.py [scene ...]

Parts are removed (or added, where the scene leaves them out) one by one.  For each variant:
degrees of freedom and constraints, time to build, processor time and steps of the run, and how far
the main results are from those of the scene as it stands, beside the error bars of that.  A part
whose removal changes results by more than the bars is one that the scene needs.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from ringsim.choice import kind_of
from ringsim.engine.build import build
from ringsim.engine.planar_truss import build_truss
from ringsim.refusal import InputError
from ringsim.scene import Scene, builtin_scenes, load_scene
from ringsim.simulation import run

VARIANTS: dict[str, dict[str, Any]] = {
    "no boom": {"boom": "none"},
    "no net": {"net": "none"},
    "no stops": {"stop": "none"},
    "upper cable alone": {"cables.lower": "none"},
    "cables without friction": {
        "cables.upper.friction": {"kind": "none"},
        "cables.lower.friction": {"kind": "none"},
    },
    "no rod damping": {"rods.damping": 0.0},
    "with stress output": {"record.stress": True},
    "two elements": {"rods.elements": 2},
    "three elements": {"rods.elements": 3},
    "ten times the output": {"record.interval": 0.01},
}
SHOWN = {
    "deployment_time": ("deployment time", "s"),
    "asynchrony_max": ("asynchrony", "deg"),
    "peak_tension": ("peak tension", "N"),
    "peak_bending_strain": ("peak strain", ""),
}


def size_of(scene: Scene) -> tuple[int, int, float]:
    """Coordinates, constraint equations and the time to build, s (the shortest of three)."""
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        truss = kind_of(scene.structure) == "planar-truss"
        assembly = build_truss(scene).assembly if truss else build(scene).ring.assembly
        seconds.append(time.process_time() - begin)
    data = assembly.system.systemData
    return data.ODE2Size(), data.AEsize(), min(seconds)


def row(name: str, scene: Scene, standing: dict[str, Any]) -> dict[str, Any]:
    coordinates, constraints, building = size_of(scene)
    found = run(scene)
    values = found.values
    cells = []
    for output in SHOWN:
        if output not in standing:
            continue
        change = values.get(output, np.array(np.nan)) - standing[output]
        cells.append(f"{float(change):+.1e}" if np.isfinite(change) else "")
    print(
        f"| {name} | {coordinates} | {constraints} | {1e3 * building:.0f} ms | "
        f"{float(values['cpu_time']):.2f} s | {int(values['steps'])} | {found.status.word} | "
        + " | ".join(cells)
        + " |",
        flush=True,
    )
    return values


def show(name: str) -> None:
    scene = load_scene(name)
    barred = run(scene.with_values({"solver.error_bars": True})).values
    there = [output for output in SHOWN if output in barred]
    head = " | ".join(f"change of {SHOWN[o][0]} ({SHOWN[o][1] or '1'})" for o in there)
    print(f"\n## {name}\n")
    print(f"| variant | coordinates | constraints | build | run | steps | status | {head} |")
    print("|---|---|---|---|---|---|---|" + "---|" * len(there))
    bars = [f"bar {float(barred.get(f'{o}_error', np.nan)):.1e}" for o in there]
    values = row("as it stands", scene, {})
    print(f"| its error bars | | | | | | | {' | '.join(bars)} |")
    for words, changes in VARIANTS.items():
        try:
            variant = scene.with_values(changes)
        except InputError as error:
            print(
                f"| {words} | refused: {str(error).partition(': ')[2]} |" + " |" * (5 + len(there))
            )
            continue
        if variant.to_toml() != scene.to_toml():
            row(words, variant, values)


if __name__ == "__main__":
    for each in sys.argv[1:] or builtin_scenes():
        show(each)
