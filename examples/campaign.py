"""A small campaign: how uncertain forces and friction spread the deployment time of a ring.

Writes a campaign file, runs its 16 samples on two cores and merges them into one netCDF file.  The
"frame" fidelity keeps a sample near a second; leave that line out for the full model.
Interrupted, the same command goes on where it stopped.
"""

import subprocess
import sys
from pathlib import Path

CAMPAIGN = """
name = "friction"
seed = 1
scene = "ring18"
design = { kind = "latin-hypercube", samples = 16 }
fidelity = "frame"

[set]
"structure.sections" = 6

[inputs]
"loads.force" = { kind = "normal", mean = 0.02, standard_deviation = 0.002 }
"joints.vjoint.viscous" = { kind = "lognormal", mean = 0.002, standard_deviation = 0.001 }
"structure.corner_mass" = { kind = "uniform", low = 0.018, high = 0.022 }
"""


def run_campaign() -> Path:
    """Run it in the present folder; returns the merged file."""
    Path("friction.toml").write_text(CAMPAIGN, encoding="utf-8")
    command = [sys.executable, "-m", "ringsim", "campaign", "friction.toml", "--workers", "2"]
    subprocess.run(command, check=True)
    return Path("runs/friction/campaign.nc")


if __name__ == "__main__":
    print(f"wrote {run_campaign()}")
