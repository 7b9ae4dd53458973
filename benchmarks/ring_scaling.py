"""How the cost of a run grows with the number of sections.

Run: python benchmarks/ring_scaling.py [sections ...]

Two sections are the open truss; the others are closed rings on the paper's ellipse, without a
net (it would hold the largest), at the paper's force.
"""

from __future__ import annotations

import math
import sys
import time

from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate


def scene_of(sections: int) -> Scene:
    return load_scene("ring18").with_values(
        {
            "structure.sections": sections,
            "structure.closed": sections > 2,
            "net": "none",
            "loads.force": 0.03,
            "solver.end_time": 600.0,
        }
    )


def main(counts: list[int]) -> None:
    print(
        "| sections | steps | processor time | per step | per step and section | exponent |\n"
        "|---|---|---|---|---|---|"
    )
    before: tuple[int, float] | None = None
    for sections in counts:
        begun = time.process_time()
        found = simulate(scene_of(sections), fidelity="full")
        taken, steps = time.process_time() - begun, int(found["steps"])
        if int(found["status"]) != 0:
            raise RuntimeError(str(found.attrs["reason"]))
        each = 1e3 * taken / steps
        growth = "" if before is None else f"{math.log(each / before[1], sections / before[0]):.2f}"
        print(
            f"| {sections} | {steps} | {taken:.2f} s | {each:.2f} ms "
            f"| {each / sections:.2f} ms | {growth} |",
            flush=True,
        )
        before = sections, each


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [2, 6, 18, 36, 72])
