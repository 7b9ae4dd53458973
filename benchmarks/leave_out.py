"""What each part of a scene costs, and what changes without it.

Run: python benchmarks/leave_out.py [scene ...] > docs/evidence/leave_out.md

Parts are taken out of a scene one by one, and a few that it leaves out are put in.  A part whose
removal changes a result by more than the scene's own error bar is one that the scene needs.
Prints Markdown; how far it is goes to standard error.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from stamp import stamp

from ringsim.choice import kind_of
from ringsim.exudyn.build import build
from ringsim.outputs.balance import differences, error_bars, refined
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run
from ringsim.variables import Outcome, Status

PATIENCE = 4
"""Steps of a scene without one of its parts over those of the scene: then it counts as needed."""
BOTH = ("cables.upper", "cables.lower")
REMOVED: dict[str, dict[str, Any]] = {
    "boom": {"boom": "none"},
    "net": {"net": "none"},
    "loads": {"loads": "none"},
    "upper cable": {"cables.upper": "none"},
    "lower cable": {"cables.lower": "none"},
    "friction of the pulleys": {f"{cable}.friction": {"kind": "none"} for cable in BOTH},
    "stops": {"stop": "none"},
    "latches of the stops": {"stop.latch": False},
    "friction of the V-joints": {"joints.vjoint": "none"},
    "friction of the hinges": {"joints.hinge": "none"},
    "friction of the pivots": {"joints.pivot": "none"},
    "damping of the rods": {"rods.damping": 0.0},
    "damper of the spring": {"structure.spring.damping": 0.0},
    "damper of the rest": {"structure.rest.damping": 0.0},
}
"""What takes a part out; those that a scene does not have are passed over."""
OUTPUTS = {
    "deployment_time": "deployment time, s",
    "opening_angle": "opening angles, deg",
    "asynchrony_max": "asynchrony, deg",
    "peak_tension": "peak tension, N",
    "peak_rod_stress": "peak stress, Pa",
    "peak_bending_strain": "peak strain",
}
TITLE = "# Effect of each part of a scene"
INTRODUCTION = """Each built-in scene is run with its parts removed one by one, and with more
elements and output than it has, to show that it contains nothing superfluous:
what a scene does not name is not built (see coordinates, constraints and times),
and each of its parts changes the results by more than their error bars.
Exceptions are listed below each table.

Changes are the largest over all joints and output times, in the unit of the column and, in
parentheses, relative to the error bar. "needed" means that a result changes by more than its error
bar, or that the scene does not run without the part. The strain has no error bar; the difference to
the run with half the steps and twice the elements replaces it. Build times are the shortest of
three; run times are processor times of single runs on a shared machine and vary by a quarter."""


@dataclass(frozen=True)
class Standing:
    """The scene as it is compared with: with stress output where it can have it."""

    scene: Scene
    outcome: Outcome
    bars: dict[str, float]


def size_of(scene: Scene) -> tuple[int, int, float]:
    """Coordinates, constraint equations and the time to build, s (the shortest of three)."""
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        assembly = build(scene).model.assembly
        seconds.append(time.process_time() - begin)
    data = assembly.system.systemData
    return data.ODE2Size(), data.AEsize(), min(seconds)


def apart(one: Outcome, other: Outcome) -> dict[str, float]:
    """Changes of all outputs that both runs have."""
    found = differences(one, other)
    if "peak_bending_strain" in one.values:
        values = (outcome.values["peak_bending_strain"] for outcome in (one, other))
        found["peak_bending_strain"] = abs(float(np.subtract(*values)))
    return found


def standing_of(name: str) -> Standing:
    """Run a scene, and once more with half the steps for its error bars."""
    scene = load_scene(name)
    if kind_of(scene.structure) != "planar-truss":
        scene = scene.with_values({"record.stress": True})
    outcome = run(scene)
    finer = run(refined(scene))
    bars = apart(outcome, finer)
    stated = error_bars(outcome, finer)
    bars |= {
        name.removesuffix("_error"): float(bar) for name, bar in stated.items() if bar.ndim == 0
    }
    return Standing(scene, outcome, {name: bars[name] for name in OUTPUTS if name in bars})


def row(words: str, scene: Scene, found: Outcome, cells: list[str], verdict: str) -> str:
    coordinates, constraints, building = size_of(scene)
    seconds, steps = (found.values.get(name, math.nan) for name in ("cpu_time", "steps"))
    numbers = f"{coordinates} | {constraints} | {1e3 * building:.0f} ms | {seconds:.2f} s | {steps}"
    return f"| {words} | {numbers} | {' | '.join(cells)} | {verdict} |"


def changes(standing: Standing, found: Outcome) -> tuple[list[str], bool]:
    """Cells with the changes, and whether one of them is beyond its error bar."""
    cells, beyond = [], False
    there = apart(found, standing.outcome) if found.status == Status.OK else {}
    for name, bar in standing.bars.items():
        change = there.get(name, math.nan)
        if not math.isfinite(change):
            cells.append("")
            continue
        ratio = change / bar if change > 0.0 else 0.0
        cells.append(f"{change:.1e} ({ratio:.2g})" if change > 0.0 else "0")
        beyond = beyond or ratio > 1.0
    return cells, beyond


def variants(scene: Scene) -> list[tuple[str, dict[str, Any], bool]]:
    """Words, values, and whether something is taken out, of all that differs from the scene."""
    elements = scene.rods.elements
    found = [(f"no {words}", values, True) for words, values in REMOVED.items()]
    if elements > 1:
        fewer = elements // 2
        found.append((f"{fewer} elements instead of {elements}", {"rods.elements": fewer}, True))
    more = elements + 1 if elements == 1 else 2 * elements
    found.append((f"{more} elements instead of {elements}", {"rods.elements": more}, False))
    return found


def present(scene: Scene, values: dict[str, Any]) -> dict[str, Any]:
    """The values of those parts that the scene has: none is created to be taken out."""
    found = {}
    for path, value in values.items():
        table: Any = scene.to_table()
        for name in path.split("."):
            table = table.get(name) if isinstance(table, dict) else None
        if table is not None and table != value and not (isinstance(table, dict) and not table):
            found[path] = value
    return found


def show(name: str) -> None:
    standing = standing_of(name)
    scene, steps = standing.scene, int(standing.outcome.values["steps"])
    print(f"\n## {name}\n")
    head = " | ".join(OUTPUTS[output] for output in standing.bars)
    print(f"| | coordinates | constraints | build | run | steps | {head} | |")
    print("|---|---|---|---|---|---|" + "---|" * (len(standing.bars) + 1))
    values = [f"{np.fmax.reduce(standing.outcome.values[n], axis=None):.5g}" for n in standing.bars]
    with_stress = "with stress output" if scene.record.stress else "unchanged"
    print(row(with_stress, scene, standing.outcome, values, ""))
    bars = " | ".join(f"{bar:.1e}" for bar in standing.bars.values())
    print(f"| error bars | | | | | | {bars} | |")
    if scene.record.stress:
        plain = scene.with_values({"record.stress": False})
        found = run(plain)
        cells, beyond = changes(standing, found)
        verdict = "changes results" if beyond else "output only"
        print(row("unchanged, without stress output", plain, found, cells, verdict), flush=True)
    parts, spare = 0, []
    for words, wanted, taken in variants(scene):
        given = present(scene, wanted)
        if not given:
            continue
        print(f"{name}: {words}", file=sys.stderr, flush=True)
        parts += taken
        try:
            patience = {"solver.step_limit": PATIENCE * steps, "solver.restarts": 0}
            variant = scene.with_values(given | patience)
        except InputError as error:
            reason = str(error).partition(": ")[2].partition(":")[0]
            empty = " |" * (5 + len(standing.bars))
            print(f"| {words} |{empty} needed: {reason} |", flush=True)
            continue
        found = run(variant)
        cells, beyond = changes(standing, found)
        if found.status != Status.OK:
            beyond, verdict = True, f"needed: {found.status.word}" if taken else found.status.word
        elif found.fate != standing.outcome.fate:
            word = found.fate.word.replace("_", " ")
            beyond, verdict = True, f"needed: {word}" if taken else word
        elif taken:
            verdict = "needed" if beyond else "changes less than the error bars"
        else:
            verdict = "would change results" if beyond else "not needed"
        if taken and not beyond:
            spare.append(words.removeprefix("no "))
        print(row(words, variant, found, cells, verdict), flush=True)
    others = f"; no effect beyond the error bars: {', '.join(spare)}" if spare else ""
    print(f"\n{parts - len(spare)} of {parts} are needed{others}.", flush=True)


if __name__ == "__main__":
    print(TITLE, stamp("python benchmarks/leave_out.py"), INTRODUCTION, sep="\n\n")
    for each in sys.argv[1:] or ("truss2", "ring18", "ring18-cable", "planar-truss"):
        show(each)
