"""What the frame engine costs beside the full model, and where its time goes.

Run: python benchmarks/frame_cost.py ratio [SCENE ...]     both engines in turn, twice each
     python benchmarks/frame_cost.py growth [sections ...]  the frame engine alone
     python benchmarks/frame_cost.py profile [SCENE]        its time by what it is spent on
     python benchmarks/frame_cost.py energy [SCENE ...]     energy errors of both at nine tolerances
     python benchmarks/frame_cost.py energy SCENE:SECONDS   of its beginning, at 33

Every run has a process of its own, which loads the core before the clock starts.  Times are
processor time with one thread; what is compared holds all outputs and energies.  Errors are against
the frame engine with steps a quarter as long.  One run's energy error is partly chance, that of
where steps meet an impact: "energy" repeats runs at tolerances around the scene's own.
"""

from __future__ import annotations

import json
import math
import os
import resource
import statistics
import subprocess
import sys
import time
from collections import Counter
from typing import Any

SCENES = ("ring18-cable", "ring18", "72")
NEAR = 0.92, 1.08
"""Range of factors of the tolerance: so near that the error differs by chance alone."""
COMPARED = ("deployment_time", "asynchrony_max", "peak_tension")


def scene_of(name: str) -> Any:
    """A built-in scene, perhaps until a time (s) behind a colon, or a closed ring of so many
    sections without a net, of twice the force.
    """
    from ringsim.scene import load_scene

    name, _, until = name.partition(":")
    if not name.isdigit():
        scene = load_scene(name)
        return scene.with_values({"solver.end_time": float(until)}) if until else scene
    return load_scene("ring18").with_values(
        {
            "structure.sections": int(name),
            "net": "none",
            "loads.force": 0.03,
            "solver.end_time": 600.0,
        }
    )


def solve_of(fidelity: str) -> Any:
    if fidelity == "full":
        from ringsim.exudyn.integrate import solve
    else:
        from ringsim.frame.integrate import solve
    return solve


def child(name: str, fidelity: str, factor: float) -> None:
    """One run, told on standard output."""
    scene, solve = scene_of(name), solve_of(fidelity)
    solve(scene.with_values({"solver.end_time": 0.5, "record.interval": 0.1}))
    scene = scene.model_copy(update={"solver": scene.solver.scaled(factor)})
    begun = time.process_time()
    outcome = solve(scene)
    taken = time.process_time() - begun
    if outcome.status.failed:
        raise RuntimeError(str(outcome.reason))
    found = {key: float(outcome.values[key]) for key in COMPARED if key in outcome.values}
    counts = {k: int(outcome.values[k]) for k in ("steps", "newton_iterations", "jacobians")}
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    energy = float(outcome.values["energy_error"])
    print(json.dumps({"time": taken, "memory": memory, "energy": energy} | counts | found))


def run(name: str, fidelity: str, factor: float = 1.0) -> dict[str, float]:
    command = [sys.executable, __file__, "child", name, fidelity, str(factor)]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def ratio(names: list[str]) -> None:
    print(
        "| scene | engine | processor time, s | ratio | steps | Newton iterations | tangents "
        "| energy error | errors: " + ", ".join(COMPARED) + " | memory, MB |\n"
        "|---|---|---|---|---|---|---|---|---|---|"
    )
    for name in names:
        found: dict[str, list[dict[str, float]]] = {"full": [], "frame": []}
        for _ in range(2):
            for fidelity, own in found.items():
                own.append(run(name, fidelity))
        best = {fidelity: min(one["time"] for one in own) for fidelity, own in found.items()}
        truth = run(name, "frame", 0.25)
        for fidelity, own in found.items():
            one = own[0]
            errors = ", ".join(
                f"{one[key] / truth[key] - 1.0:+.1e}" for key in COMPARED if key in one
            )
            times = " / ".join(f"{each['time']:.2f}" for each in own)
            print(
                f"| {name} | {fidelity} | {times} | {best['full'] / best[fidelity]:.1f} "
                f"| {one['steps']} | {one['newton_iterations']} | {one['jacobians']} "
                f"| {one['energy']:.1e} | {errors} | {one['memory']:.0f} |",
                flush=True,
            )


def energy(names: list[str]) -> None:
    """Means over the tolerances with their standard errors, both engines."""
    print("| scene | exudyn | frames | smallest, largest: exudyn | frames |\n|---|---|---|---|---|")
    for name in names:
        means, ranges = [], []
        count = 33 if ":" in name else 9
        factors = [NEAR[0] + (NEAR[1] - NEAR[0]) * k / (count - 1) for k in range(count)]
        for fidelity in ("full", "frame"):
            errors = [run(name, fidelity, factor)["energy"] for factor in factors]
            spread = statistics.stdev(errors) / math.sqrt(len(errors))
            means.append(f"{statistics.mean(errors):.2e} +- {spread:.1e}")
            ranges.append(f"{min(errors):.1e}, {max(errors):.1e}")
        print(f"| {name} | {' | '.join(means + ranges)} |", flush=True)


def growth(counts: list[int]) -> None:
    print("| sections | steps | processor time | a step | exponent | memory |")
    print("|---|---|---|---|---|---|")
    before: tuple[int, float] | None = None
    for sections in counts:
        found = min((run(str(sections), "frame") for _ in range(2)), key=lambda one: one["time"])
        each = 1e3 * found["time"] / found["steps"]
        power = "" if before is None else f"{math.log(each / before[1], sections / before[0]):.2f}"
        print(
            f"| {sections} | {found['steps']:.0f} | {found['time']:.2f} s | {each:.2f} ms "
            f"| {power} | {found['memory']:.0f} MB |",
            flush=True,
        )
        before = sections, each


def profile(name: str) -> None:
    """Functions of the core one by one, and the rest; counts and processor time."""
    from ringsim.core import library
    from ringsim.frame import integrate

    scene = scene_of(name)
    integrate.solve(scene.with_values({"solver.end_time": 0.5, "record.interval": 0.1}))
    spent: Counter[str] = Counter()
    calls: Counter[str] = Counter()
    found = library._function

    def timed(kernel: str) -> tuple[str, Any]:
        takes, own = found(kernel)

        def run(*words: Any) -> Any:
            begun = time.process_time()
            try:
                return own(*words)
            finally:
                spent[kernel] += time.process_time() - begun
                calls[kernel] += 1

        return takes, run

    library._function = timed
    begun = time.process_time()
    integrate.solve(scene)
    taken = time.process_time() - begun
    print("| function | calls | a call, ms | share |\n|---|---|---|---|")
    for kernel, each in spent.most_common():
        own = 1e3 * each / calls[kernel]
        print(f"| {kernel} | {calls[kernel]} | {own:.3f} | {each / taken:.1%} |")
    rest = taken - sum(spent.values())
    what = "all else: Python"
    print(f"| {what} |  |  | {rest / taken:.1%} |")
    print(f"\n{taken:.2f} s in all")


if __name__ == "__main__":
    verb, *words = sys.argv[1:] or ["ratio"]
    if verb == "child":
        child(words[0], words[1], float(words[2]))
    elif verb == "growth":
        growth([int(word) for word in words] or [6, 12, 18, 36, 72])
    elif verb == "energy":
        energy(words or ["truss2", "ring18-ground", "ring18", "ring18-cable"])
    elif verb == "profile":
        profile((words or ["ring18-cable"])[0])
    else:
        ratio(words or list(SCENES))
