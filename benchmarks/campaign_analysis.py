"""Time and memory of analysing, drawing and reporting campaigns of many samples.

python benchmarks/campaign_analysis.py [--samples 1000 10000 100000] [--records 201] [--keep DIR]

The files are made by formulas: outputs follow from the inputs with noise, one sample in fifty is
lost and one in a hundred stalls.  Their shape is that of ``campaigns/nonsync_friction.toml``: 18
sections, friction of every pulley drawn.  Each command runs by itself; its greatest resident memory
is what the kernel tells of it.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import netCDF4
import numpy as np

from ringsim.outputs import VARIABLES
from ringsim.outputs.family import COORDINATES
from ringsim.scene import load_scene
from ringsim.storage.netcdf import PER_SAMPLE, add_coordinate, add_variable
from ringsim.tables import text_table
from ringsim.variables import PLANES, Cause, Fate, Status

SECTIONS, SPANS, PULLEYS, BLOCK = 18, 37, 36, 500
TEXT = """
name = "made"
seed = 1
scene = "ring18-cable"
design = {{ kind = "random", samples = {samples} }}
[requirements]
asynchrony_max = {{ max = 30.0, probability = 0.9, confidence = 0.95 }}
outcome = {{ is = "deployed", probability = 0.9, confidence = 0.95 }}
"""
REQUIRED = {
    "asynchrony_max": {"max": 30.0, "probability": 0.9, "confidence": 0.95},
    "outcome": {"is": "deployed", "probability": 0.9, "confidence": 0.95},
}


def write(path: Path, samples: int, records: int) -> None:
    """A campaign.nc as large as a real one, written block by block."""
    random = np.random.default_rng(0)
    time_axis = np.linspace(0.0, 30.0, records)
    scalars = {n: v for n, v in VARIABLES.items() if not v.dims and v.dtype != "str"}
    series = {n: VARIABLES[n] for n in ("opening_angle", "asynchrony", "cable_tension")}
    wanted = scalars | series | {"lock_time": VARIABLES["lock_time"]} | PER_SAMPLE
    design = {"kind": "random", "samples": samples}
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts({
            "scene": load_scene("ring18-cable").to_toml(), "seed": 1, "title": "Made by formulas",
            "campaign": TEXT.format(samples=samples), "campaign_name": "made", "identity": "made",
            "design": json.dumps(design), "requirements": json.dumps(REQUIRED),
        })  # fmt: skip
        add_coordinate(file, "sample", np.arange(samples))
        axes = {"plane": np.array(PLANES), "section": np.arange(1, SECTIONS + 1),
                "time": time_axis, "span": np.arange(1, SPANS + 1)}  # fmt: skip
        for name in COORDINATES:
            if name in axes:
                add_coordinate(file, name, axes[name])
        for variable in wanted.values():
            add_variable(file, variable, compression=1, digits=None)
        file.createDimension("pulley", PULLEYS)
        for path_of, dims in (
            ("rods.young_modulus", ()), ("cables.upper.friction.coefficient", ("pulley",)),
            ("cables.lower.friction.coefficient", ("pulley",)),
        ):  # fmt: skip
            made = file.createVariable(path_of.replace(".", "_"), "f8", ("sample", *dims))
            law = json.dumps({"kind": "lognormal", "mean": 1.0, "standard_deviation": 0.1})
            made.setncatts({"role": "input", "path": path_of, "units": "1", "distribution": law})
        for start in range(0, samples, BLOCK):
            rows = slice(start, min(start + BLOCK, samples))
            for name, values in block(random, rows.stop - rows.start, time_axis, scalars).items():
                file[name][rows] = values


def block(random, count, times, scalars):
    """All variables of some samples."""
    upper, lower = (random.lognormal(0.0, 0.1, (count, PULLEYS)) for _ in range(2))
    modulus = random.normal(1.2e11, 6e9, count)
    late = upper.mean(axis=1) - lower.mean(axis=1) + 0.1 * random.normal(size=count)
    ends = 26.0 + late
    share = np.clip(times / ends[:, None], 0.0, 1.0)[:, None, None]
    lag = np.linspace(-1, 1, SECTIONS) * (6.0 + 20.0 * late[:, None])
    lag = np.stack([lag, 0.8 * lag], axis=1)[..., None]
    angle = 20.0 + 160.0 * share**2 + lag * share * (1.0 - share)
    fall = np.exp(-0.05 * np.arange(SPANS))
    tension = (40.0 + 3.0 * late)[:, None, None, None] * fall[:, None] * (0.2 + share)
    tension = np.repeat(tension, 2, axis=1)
    lost, stalled = random.random(count) < 0.02, random.random(count) < 0.01
    beyond = times > ends[:, None]
    angle[np.broadcast_to(beyond[:, None, None], angle.shape)] = np.nan
    tension[np.broadcast_to(beyond[:, None, None], tension.shape)] = np.nan
    asynchrony = np.ptp(angle, axis=(1, 2))
    found = {name: random.normal(10.0, 1.0, count) for name in scalars}
    found |= {n: random.integers(1, 9, count) for n, v in scalars.items() if v.dtype[0] == "i"}
    deployed = np.where(stalled | lost, np.nan, ends)
    found |= {
        "opening_angle": angle, "cable_tension": tension, "asynchrony": asynchrony,
        "asynchrony_max": np.nanmax(asynchrony, axis=1), "peak_tension": 44.0 + 3.0 * late,
        "deployment_time": deployed, "final_time": ends,
        "lock_time": ends[:, None, None] - random.random((count, 2, SECTIONS)),
        "status": np.where(lost, Status.TIMEOUT, Status.OK),
        "cause": np.where(lost, Cause.TIME_LIMIT, Cause.NONE),
        "outcome": np.where(lost, Fate.NONE, np.where(stalled, Fate.STALLED, Fate.DEPLOYED)),
        "reason": np.where(lost, "took too long", "all V-joints have locked").astype(object),
        "rods_young_modulus": modulus, "cables_upper_friction_coefficient": upper,
        "cables_lower_friction_coefficient": lower, "restarts": np.zeros(count, dtype=int),
    }  # fmt: skip
    return found


def run(*arguments: str) -> tuple[float, float]:
    """Seconds and greatest resident memory in MB of a command."""
    code = (
        "import resource, subprocess, sys; "
        "done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL); "
        "print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    begin = time.perf_counter()
    told = subprocess.run(
        [sys.executable, "-c", code, sys.executable, "-m", "ringsim", *arguments],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    failed, kilobytes = map(int, told.stdout.split())
    if failed:
        raise SystemExit(f"ringsim {' '.join(arguments)}: exit code {failed}\n{told.stderr}")
    return time.perf_counter() - begin, kilobytes / 1024


def main() -> None:
    """Print a row for each size and command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, nargs="+", default=[1000, 10_000, 100_000])
    parser.add_argument("--records", type=int, nargs="+", default=[201])
    parser.add_argument("--verbs", nargs="+", default=["analyse", "plot", "report"])
    parser.add_argument("--keep", type=Path, help="folder for the files, which stay")
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for samples in given.samples:
            for records in given.records:
                folder = (given.keep or Path(scratch)) / f"made-{samples}-{records}"
                folder.mkdir(parents=True, exist_ok=True)
                file = folder / "campaign.nc"
                if not file.exists():
                    write(file, samples, records)
                commands = {
                    "analyse": ("analyse", str(folder)), "plot": ("plot", str(file)),
                    "report": ("report", str(folder), "--out", str(folder / "report.html")),
                }  # fmt: skip
                for verb in given.verbs:
                    seconds, memory = run(*commands[verb])
                    page = folder / "report.html"
                    size = f"{page.stat().st_size / 1e6:.2f}" if verb == "report" else "-"
                    rows.append((
                        str(samples), str(records), f"{os.path.getsize(file) / 1e6:.0f}", verb,
                        f"{seconds:.1f}", f"{memory:.0f}", size,
                    ))  # fmt: skip
                    print(*rows[-1], flush=True)
    head = ("samples", "records", "file, MB", "command", "time, s", "memory, MB", "page, MB")
    print("\n".join(text_table(head, rows)))
    print(f"load {os.getloadavg()[0]:.1f}, memory of this script "
          f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
