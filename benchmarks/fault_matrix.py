"""What becomes of a ring whose motor and whose structure fail: every pair of faults.

Run: python benchmarks/fault_matrix.py [--sections 2 6 18] [--planes upper lower]
    [--fidelity full | frame] [--out docs/evidence/faults.md]

The lower winch stops half-way, starts 3 s late or stalls at a tension that is half the peak of the
sound run, while a V-joint sticks, a pulley jams or a cable parts in either plane.  The page tells
the outcome of each, its energy error, and its cost over that of the sound run; what stands there of
other numbers of sections, and of the other engine, stays.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ringsim import load_scene, simulate
from ringsim.scene import Scene
from ringsim.tables import markdown_table
from ringsim.variables import PLANES, Fate, Status

MOTORS = ("sound", "stopped", "late", "weak")
DAMAGES = ("none", "stuck", "jammed", "cut")
TITLE = """# What becomes of a ring with two faults

Written by `benchmarks/fault_matrix.py`, which says what the faults are.
"""
SLOWEST = 3.0
"""Time in s by which the late winch starts after the other."""


def sound_scene(sections: int) -> Scene:
    """Rings of ``ring18-cable`` from 120 deg on; two sections are an arc."""
    values: dict[str, Any] = {
        "structure.sections": sections, "structure.opening_angle": 120.0, "boom": "none",
        "solver.end_time": 10.0 + 0.9 * sections, "record.interval": 0.05,
        "solver.tolerance": 1e-3,
    }  # fmt: skip
    if sections == 2:
        # Friction of the hinges lets the assemblies at the open ends come to rest, as in truss2.
        values |= {"structure.closed": False, "structure.polygon_sections": 18}
        values["joints.hinge"] = {"viscous": 0.001}
    return load_scene("ring18-cable").with_values(values)


def faulty(scene: Scene, motor: str, damage: str, plane: str, length: float, peak: float) -> Scene:
    """A scene with faults, given the deployment time (s) and the peak tension (N) without them."""
    winch, middle = "cables.lower.winch", max(1, scene.structure.sections // 2)
    number = 1 if plane == "upper" else 2
    stall = {"kind": "stall", "speed": 0.12, "max_tension": 0.5 * peak}
    changes: dict[str, dict[str, Any]] = {
        "stopped": {f"{winch}.stop_time": 0.5 * length},
        "late": {f"{winch}.start_time": SLOWEST},
        "weak": {f"{winch}.winding": stall},
    }
    places: dict[str, dict[str, Any]] = {
        "stuck": {"kind": "stuck-vjoint", "plane": plane, "section": middle},
        "jammed": {"kind": "jammed-pulley", "cable": number, "pulley": 3 * middle - 1},
        "cut": {"kind": "cut-cable", "cable": number, "span": 3 * middle - 1},
    }
    values = dict(changes.get(motor, {}))
    if damage in places:
        values["faults"] = [places[damage] | {"time": 0.4 * length}]
    return scene.with_values(values)


def cells(damaged: Sequence[str] = PLANES) -> Iterator[tuple[str, str, str]]:
    """Motor, damage and its plane, one of those ``damaged``; the sound ring is left out."""
    for motor in MOTORS:
        for damage in DAMAGES:
            planes = damaged if damage != "none" else ("",)
            for plane in planes if (motor, damage) != ("sound", "none") else ():
                yield motor, damage, plane


def _timed(scene: Scene, fidelity: str) -> tuple[Any, float]:
    begun = time.process_time()
    found = simulate(scene, fidelity=fidelity)
    return found, time.process_time() - begun


def heading(sections: int, fidelity: str) -> str:
    """Of the chapter about one number of sections, by one engine."""
    return f"{sections} sections" + (", frame engine" if fidelity == "frame" else "")


def table(sections: int, planes: Sequence[str], fidelity: str) -> str:
    """One row a cell with damage in one of these planes, as Markdown."""
    scene, rows = sound_scene(sections), []
    _timed(scene.with_values({"solver.end_time": 0.5}), fidelity)  # loads, and compiles
    sound, cost = _timed(scene, fidelity)
    length, peak = float(sound.deployment_time), float(sound.peak_tension)
    for motor, damage, plane in cells(planes):
        found, took = _timed(faulty(scene, motor, damage, plane, length, peak), fidelity)
        rows.append([
            motor, f"{damage} {plane}".strip(), Status(int(found.status)).word,
            Fate(int(found.outcome)).word.replace("_", " "),
            f"{int(found.locked_joints)} of {2 * sections}", f"{float(found.asynchrony_max):.1f}",
            f"{float(found.peak_tension):.1f}", f"{float(found.energy_error):.1e}",
            str(int(found.restarts)), f"{int(found.steps) / int(sound.steps):.2f}",
            f"{int(found.newton_iterations) / int(sound.newton_iterations):.2f}",
            f"{took / cost:.2f}",
        ])  # fmt: skip
        print(" | ".join(rows[-1]), flush=True)
    head = [
        "lower motor", "damage", "status", "outcome", "locked", "asynchrony (deg)", "tension (N)",
        "energy error", "restarts", "steps ratio",
        "Newton ratio", "cost ratio",
    ]  # fmt: skip
    note = f"Sound: deployed after {length:.2f} s with {peak:.1f} N, {int(sound.steps)} steps, "
    note += f"{int(sound.newton_iterations)} Newton iterations, {cost:.1f} s."
    return f"## {heading(sections, fidelity)}\n\n{note}\n\n{markdown_table(head, rows)}\n"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sections", type=int, nargs="+", default=[2, 6, 18])
    parser.add_argument("--out", type=Path, default=Path("docs/evidence/faults.md"))
    parser.add_argument("--fidelity", choices=("full", "frame"), default="full")
    parser.add_argument("--planes", nargs="+", choices=PLANES, default=PLANES)
    chosen, mark = parser.parse_args(), "## "
    text = chosen.out.read_text(encoding="utf-8") if chosen.out.exists() else TITLE
    title, *chapters = text.split(f"\n{mark}")
    known = {one.split("\n")[0]: mark + one.strip() for one in chapters}
    for sections in chosen.sections:
        found = table(sections, chosen.planes, chosen.fidelity).strip()
        known[heading(sections, chosen.fidelity)] = found
        ordered = sorted(known, key=lambda name: (int(name.split()[0]), name))
        page = "\n\n".join([title.strip(), *(known[name] for name in ordered)])
        chosen.out.write_text(page + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
