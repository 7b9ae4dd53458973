"""ringsim beside MBDyn on flexible rings: times, deviations between joints, stresses, cost.

Run: python benchmarks/cross_validation.py CASE [--set PATH=VALUE ...]
     python benchmarks/cross_validation.py table

CASE is closed6_force, closed18_force or ring18.  "table" prints the Markdown table of
docs/evidence/cross_validation.md.  Everything is compared at equal mean opening angle, before any
stop acts.  tests/crossvalidation/mbdyn_data/README.md describes the reference and its own errors.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "crossvalidation"))

from mbdyn_reference import CASES, Comparison, rods_of, scene_of, tight_settings
from ringsim.overrides import parse_assignment
from ringsim.simulation import simulate

ANGLES = np.array([60.0, 90.0, 105.0, 120.0, 135.0, 150.0, 160.0, 170.0, 175.0])
WINDOWS = ((60.0, 135.0), (150.0, 170.0))
"""Mean angles in deg between which deviations are compared."""
STRESSED = (75.0, 135.0)
"""The same for stresses."""

TABLE: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("closed6_force", "default", {}),
    ("closed6_force", "3e-5, 2", {"solver.tolerance": 3e-5, "rods.elements": 2}),
    ("closed6_force", "3e-6, 4", tight_settings("closed6_force")),
    ("closed18_force", "default", {}),
    ("closed18_force", "steps of 10 ms, 2", tight_settings("closed18_force")),
    ("ring18", "default", {}),
    ("ring18", "steps of 10 ms, 1", tight_settings("ring18")),
)
"""Case, settings (tolerance or step, elements a rod half), and what they change."""


def lost(found: Comparison, run: xr.Dataset) -> float:
    """Energy lost until the mean angle is 160 deg, before any stop acts, J."""
    return float(run["dissipation"].interp(time=found.ours.time_at(np.array([160.0]))[0]))


def worst_deviation(found: Comparison, low: float, high: float) -> float:
    """Worst error of deviations in a window of mean angles (deg)."""
    return float(found.deviation_errors(found.rows(low, high)).max(initial=0.0))


def print_report(case: str, assignments: list[str]) -> None:
    """Run a case and print all that is compared."""
    values = dict(parse_assignment(text) for text in assignments)
    run = simulate(scene_of(case, values), fidelity="full")
    found = Comparison(case, run)
    print(f"{case} {' '.join(assignments) or 'at default settings'}: {run.attrs['reason']}")
    print("\n| mean angle, deg | time | deviations | MBDyn's largest deviation, deg |")
    print("|---|---|---|---|")
    rows = found.nearest(ANGLES)
    means, largest = found.theirs.mean[rows], np.abs(found.theirs.deviations[rows]).max(axis=1)
    errors = found.time_errors(rows), found.deviation_errors(rows)
    for row in zip(means, *errors, largest, strict=True):
        print("| {:.1f} | {:+.1e} | {:.1e} | {:.2e} |".format(*row))
    for low, high in WINDOWS:
        worst = worst_deviation(found, low, high)
        print(f"worst error of deviations {low:.0f}..{high:.0f} deg: {worst:.1e}")
    print(f"largest asynchrony up to 175 deg: {found.asynchrony_error():+.1e}")
    print("\n| largest stress of a rod half, 75..135 deg | mean error | worst error |")
    print("|---|---|---|")
    rows = found.rows(*STRESSED)
    columns = (stress.T for stress in found.stresses(rows))
    for (rod, section), ours, theirs in zip(rods_of(case), *columns, strict=True):
        error = ours / theirs - 1.0
        where = f" of section {section}" if section else ""
        print(f"| {rod}{where} | {error.mean():+.1e} | {np.abs(error).max():.1e} |")
    print(f"worst error of any stress over the largest: {found.stress_errors(rows).max():.1e}")
    print(f"mean stress of the bars: {found.mean_bar_stress_error(rows):+.1e}")
    print_cost(found, run)


def print_cost(found: Comparison, run: xr.Dataset) -> None:
    """Print what a run lost, lacks and cost."""
    counts = ("steps", "repeated_steps", "newton_iterations", "jacobians", "restarts")
    number = {name: int(run[name]) for name in counts}
    # Newton's method takes one residual before its first iteration and one after each.
    residuals = sum(number[name] for name in counts[:3])
    print(f"\ndissipation to 160 deg: {lost(found, run):.3e} J")
    print(f"energy_error: {float(run['energy_error']):.1e}")
    print(", ".join(f"{name} {count}" for name, count in number.items()), end=", ")
    print(f"residuals about {residuals}, processor time {float(run['cpu_time']):.2f} s")


def print_table() -> None:
    """Run all cases at a few settings and print a row of the largest errors for each."""
    print(
        "| case | settings | time, 60..175 deg | deviations, 60..135 deg | 150..170 deg "
        "| largest asynchrony | mean stress of the bars | worst stress "
        "| dissipation to 160 deg, J | steps | processor time, s |\n" + "|---" * 11 + "|"
    )
    for case, settings, values in TABLE:
        run = simulate(scene_of(case, values), fidelity="full")
        found = Comparison(case, run)
        times = found.time_errors(found.rows(60.0, 175.0))
        cells = (
            case,
            settings,
            f"{times[np.abs(times).argmax()]:+.0e}",
            *(f"{worst_deviation(found, *window):.0e}" for window in WINDOWS),
            f"{found.asynchrony_error():+.0e}",
            f"{found.mean_bar_stress_error(found.rows(*STRESSED)):+.1%}",
            f"{found.stress_errors(found.rows(*STRESSED)).max():.1%}",
            f"{lost(found, run):.1e}",
            str(int(run["steps"])),
            f"{float(run['cpu_time']):.1f}",
        )
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("case", choices=[*CASES, "table"])
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE", dest="values")
    given = parser.parse_args()
    if given.case == "table":
        print_table()
    else:
        print_report(given.case, given.values)
