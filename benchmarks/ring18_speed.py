"""ring18 by ringsim and by a plain exudyn script, in turn, each in a fresh process.

Run: python benchmarks/ring18_speed.py [rounds]

Prints for each the error of the deployment time against the energy quadrature, the processor
time, and the ratio.  ringsim's run includes everything that ``ringsim.simulate`` does: stops and
their contact, energy balance, joint gaps, lock times, the dataset.
"""

from __future__ import annotations

import statistics
import subprocess
import sys

from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import load_scene

OURS = """
import ringsim, time
ringsim.simulate
scene = ringsim.load_scene("ring18").with_values({values})
begun = time.process_time()
found = ringsim.simulate(scene, fidelity="full")
print(float(found["deployment_time"]), time.process_time() - begun, int(found["steps"]))
"""
PLAIN = """
import sys
sys.path.insert(0, sys.argv[1])
from plain_exudyn_ring18 import STEPS, run
print(*run(), STEPS)
"""


SETTINGS = {
    "ringsim, default settings": {},
    "ringsim, `solver.tolerance = 1e-3`": {"solver.tolerance": 1e-3},
}
"""Names of ringsim's runs, and the values that they change in the scene."""


def once(code: str) -> tuple[float, float, int]:
    folder = __file__.rpartition("/")[0] or "."
    done = subprocess.run(
        [sys.executable, "-c", code, folder], capture_output=True, text=True, check=True
    )
    deployed, taken, steps = done.stdout.split()[-3:]
    return float(deployed), float(taken), int(steps)


def main(rounds: int) -> None:
    scene = load_scene("ring18")
    truth = opening_time(OneCoordinate(scene), scene.structure.coordinate).time
    codes = {name: OURS.replace("{values}", repr(values)) for name, values in SETTINGS.items()}
    codes["plain exudyn"] = PLAIN
    runs: dict[str, list[tuple[float, float, int]]] = {name: [] for name in codes}
    for _ in range(rounds):
        for name, code in codes.items():
            runs[name].append(once(code))
    print("| | deployment time | error | steps | processor time, median |\n|---|---|---|---|---|")
    for name, found in runs.items():
        deployed, _, steps = found[0]
        taken = statistics.median(run[1] for run in found)
        print(
            f"| {name} | {deployed:.4f} s | {deployed / truth - 1.0:+.1e} | {steps} "
            f"| {taken:.2f} s |"
        )
    for name in SETTINGS:
        ratios = [a[1] / b[1] for a, b in zip(runs[name], runs["plain exudyn"], strict=True)]
        print(
            f"\n{name}, over plain exudyn in {rounds} rounds: median "
            f"{statistics.median(ratios):.2f}, from {min(ratios):.2f} to {max(ratios):.2f}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
