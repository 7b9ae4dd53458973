"""The 18-section ring with two cables: cost of a second of motion, and where it goes.

Run: python benchmarks/cable_ring18.py [seconds of motion]

Two runs of the same scene take turns, by processor time on one core: the engine as it is, and a
plain one with constant 40 ms steps and the cable's dense Jacobian on its nodes (auxiliary
unknowns eliminated, all entries written), as a first program of the same model has it.  The
reference for the errors is the engine with a tenth of its tolerance.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import exudyn as exu
import numpy as np

from ringsim.exudyn.build import build
from ringsim.exudyn.cables import CableDrive
from ringsim.exudyn.integrate import Integration
from ringsim.outputs.recorder import Recorder
from ringsim.scene import Scene, load_scene


class DenseDrive:
    """The same forces with a dense Jacobian."""

    @staticmethod
    def jacobian(
        drive: CableDrive, mbs: Any, t: float, number: int, q: Any, q_t: Any, f: float, g: float
    ) -> Any:
        state, placed = drive._answer(q, q_t, t)
        drive.pattern.passing, drive.pattern.negligible = 0.0, 0.0
        slopes = state.exponent_slopes
        entries = drive.pattern.triplets(drive.chain, state, placed, f, g, slopes)
        own = drive.path.size
        size = own + drive.pattern.unknowns
        whole = np.zeros((size, size))
        np.add.at(whole, (entries[:, 0].astype(int), entries[:, 1].astype(int)), entries[:, 2])
        inner = whole[:own, :own] - whole[:own, own:] @ np.linalg.solve(
            whole[own:, own:], whole[own:, :own]
        )
        row, column = np.nonzero(inner)
        rest = np.arange(own, size)
        filled = np.stack([row, column, inner[row, column]], axis=1)
        unit = np.stack([rest, rest, np.ones(len(rest))], axis=1)
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(np.concatenate([filled, unit]), size, size)
        return matrix


class Clock:
    """Processor time spent in a function."""

    def __init__(self, function: Any) -> None:
        self._function, self.spent = function, 0

    def __call__(self, *values: Any) -> Any:
        start = time.thread_time_ns()
        try:
            return self._function(*values)
        finally:
            self.spent += time.thread_time_ns() - start


def timed(scene: Scene, *, dense: bool) -> tuple[float, float, Recorder]:
    """Processor time per second of motion, share of the cable's Python part, and the run."""
    force, jacobian = Clock(CableDrive.force), Clock(CableDrive.jacobian)
    if dense:
        jacobian = Clock(DenseDrive.jacobian)
    kept = CableDrive.force, CableDrive.jacobian
    CableDrive.force = lambda *v: force(*v)  # type: ignore[method-assign, assignment]
    CableDrive.jacobian = lambda *v: jacobian(*v)  # type: ignore[method-assign, assignment]
    try:
        start = time.process_time()
        history = Integration(build(scene)).run()
        spent = time.process_time() - start
    finally:
        CableDrive.force, CableDrive.jacobian = kept  # type: ignore[method-assign]
    return spent / history.times[-1], (force.spent + jacobian.spent) * 1e-9 / spent, history


def mean_angle(history: Recorder) -> float:
    """Mean opening angle at the end, deg."""
    return float(np.degrees(np.mean(history.angles[-1])))


def main(seconds: float, repetitions: int = 2) -> None:
    scene = load_scene("ring18-cable").with_values({"solver.end_time": seconds})
    plain = scene.with_values({"solver.step_control": "constant", "solver.step": 0.04})
    runs: dict[str, list[tuple[float, float, Recorder]]] = {"ours": [], "plain": []}
    for _ in range(repetitions):
        runs["ours"].append(timed(scene, dense=False))
        runs["plain"].append(timed(plain, dense=True))
    finer = scene.with_values({"solver.tolerance": 0.1 * scene.solver.tolerance})
    reference = mean_angle(timed(finer, dense=False)[2])
    print("| | s per s of motion | cable's Python part | steps | Jacobians | angle error, deg |")
    print("|---|---|---|---|---|---|")
    for name, found in runs.items():
        cost, share, history = min(found, key=lambda run: run[0])
        print(
            f"| {name} | {cost:.3f} | {share:.1%} | {len(history.times) - 1} | "
            f"{history.jacobians} | {mean_angle(history) - reference:+.1e} |"
        )
    best = {name: min(run[0] for run in found) for name, found in runs.items()}
    print(f"\nours over plain: {best['ours'] / best['plain']:.2f}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
