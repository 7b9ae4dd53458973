"""Make the readings of campaigns/stand: a test of known truth by exudyn, with noise.

Run: python benchmarks/made_stand.py [FOLDER]

Writes readings.csv into the folder (campaigns/stand), from truth.toml and measured.toml there.  The
truth runs in the full engine at a tolerance ten times finer than that of calibrations, so that
neither the engine nor the steps that find the values are those that made the readings.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

import ringsim

SEED = 1
TIMES = np.arange(0.5, 9.01, 0.5)
"""Of the readings, by the clock of the stand, s."""


def main() -> None:
    """Run the truth, read it by every sensor, and write the table."""
    folder = Path(*sys.argv[1:2] or ["campaigns/stand"])
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    measured = tomllib.loads((folder / "measured.toml").read_text(encoding="utf-8"))
    scene = ringsim.load_scene(truth["scene"]).with_values(
        truth["set"] | truth["values"] | {"record.interval": 0.02, "solver.tolerance": 3e-4}
    )
    run = ringsim.simulate(scene, fidelity="full")
    stream = np.random.default_rng(SEED)
    at = truth["clock"]["offset"] + (1.0 + truth["clock"]["drift"]) * TIMES
    columns, names = [TIMES], ["t"]
    for sensor in measured["sensors"]:
        curve = run[sensor["variable"]].sel(sensor["place"]).dropna("time")
        exact = np.interp(at, curve["time"], curve)
        columns.append(exact + sensor["standard_deviation"] * stream.standard_normal(len(at)))
        names.append(sensor["column"])
    np.savetxt(folder / "readings.csv", np.column_stack(columns), delimiter=",",
               header=",".join(names), comments="", fmt="%.3f")  # fmt: skip
    print(f"{run.attrs['reason']}; wrote {folder / 'readings.csv'}")


if __name__ == "__main__":
    main()
