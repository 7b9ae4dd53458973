"""ringsim beside MBDyn on flexible rings: times, deviations between joints, stresses, cost.

Run: python benchmarks/cross_validation.py CASE [--set PATH=VALUE ...]
     CASE is closed6_force, closed18_force or ring18; by default the scene's settings.

Everything is compared at equal mean opening angle, before any stop acts.  The reference and its
own errors are described in tests/crossvalidation/mbdyn_data/README.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "crossvalidation"))

from mbdyn_reference import CASES, RODS, Comparison, dissipation_before_stops, scene_of
from ringsim.overrides import parse_assignment
from ringsim.simulation import simulate

ANGLES = np.array([60.0, 90.0, 105.0, 120.0, 135.0, 150.0, 160.0, 170.0, 175.0])
WINDOWS = ((60.0, 135.0), (150.0, 170.0))


def report(case: str, assignments: list[str]) -> None:
    """Run a case and print what it gives."""
    values = dict(parse_assignment(text) for text in assignments)
    run = simulate(scene_of(case, values))
    found = Comparison(case, run)
    print(f"{case} {' '.join(assignments) or 'at default settings'}: {run.attrs['reason']}")
    print("\n| mean angle, deg | time | deviations | MBDyn's largest deviation, deg |")
    print("|---|---|---|---|")
    rows = found.nearest(ANGLES)
    largest = np.abs(found.theirs.deviations[rows]).max(axis=1)
    for row in zip(
        found.theirs.mean[rows],
        found.time_errors(rows),
        found.deviation_errors(rows),
        largest,
        strict=True,
    ):
        print("| {:.1f} | {:+.1e} | {:.1e} | {:.2e} |".format(*row))
    for low, high in WINDOWS:
        worst = found.deviation_errors(found.rows(low, high)).max(initial=0.0)
        print(f"worst error of deviations {low:.0f}..{high:.0f} deg: {worst:.1e}")
    print(f"largest asynchrony up to 175 deg: {found.asynchrony_error():+.1e}")
    ours, theirs = found.stresses()
    print("\n| rod, 75..135 deg | stress, mean error | worst error |\n|---|---|---|")
    for rod, mine, other in zip(RODS, ours.T, theirs.T, strict=True):
        error = mine / other - 1.0
        print(f"| {rod} | {error.mean():+.1e} | {np.abs(error).max():.1e} |")
    print(f"worst error of any rod half over the largest stress: {found.worst_stress_error():.1e}")
    print(f"mean stress of the bars: {found.mean_bar_stress_error():+.1e}")
    counts = ("steps", "repeated_steps", "newton_iterations", "jacobians", "restarts")
    number = {name: int(run[name]) for name in counts}
    # Newton's method takes one residual before its first iteration and one after each.
    residuals = sum(number[name] for name in counts[:3])
    print(f"\ndissipation before the stops: {dissipation_before_stops(run):.3e} J")
    print(f"energy_error: {float(run['energy_error']):.1e}")
    print(", ".join(f"{name} {count}" for name, count in number.items()), end=", ")
    print(f"residuals about {residuals}, processor time {float(run['cpu_time']):.2f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("case", choices=CASES)
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE", dest="values")
    given = parser.parse_args()
    report(given.case, given.values)
