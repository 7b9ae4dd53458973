"""Draws the pictures of README.md and of the documentation, from runs of the frame engine.

    python docs/pictures.py

``ring_opening.png``: the ring of 18 sections, driven by two cables of which the lower one starts
half a second late.  ``fan.png``: the campaign of the README.  About a minute on two cores.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import xarray as xr
from PIL import Image

import ringsim
from ringsim.plots.campaign.courses import fan
from ringsim.plots.ring import ring

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
CAMPAIGN = ROOT / "campaigns" / "nonsync_quick.toml"
WIDTH = 1500
"""Pixels across: sharp on a page 750 wide."""


def main() -> None:
    """Run, draw, and store with few colours, which keeps the files small."""
    late = {
        "cables.lower.winch.start_time": 0.5,
        "title": "two cables, of which the lower starts late",
    }
    scene = ringsim.load_scene("ring18-cable").with_values(late)
    save(ring(ringsim.simulate(scene, fidelity="frame")), "ring_opening.png")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "ringsim", "campaign", str(CAMPAIGN), "--workers", "2"]
        subprocess.run([*command, "--out", folder], check=True)
        with xr.open_dataset(Path(folder) / "campaign.nc") as campaign:
            save(fan(campaign), "fan.png")


def save(figure, name: str) -> None:
    """Write a figure as a PNG of 64 colours."""
    path = IMAGES / name
    figure.savefig(path, dpi=WIDTH / figure.get_figwidth())
    Image.open(path).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"wrote {path.relative_to(ROOT)} ({path.stat().st_size / 1e3:.0f} kB)")


if __name__ == "__main__":
    main()
