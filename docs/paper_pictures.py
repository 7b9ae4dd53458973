"""Draws the pictures of docs/evidence/published.md, and prints the rows of its table of stresses.

    ringsim campaign campaigns/paper_002.toml --workers 2
    ringsim campaign campaigns/paper_002_ancf.toml --workers 2
    python docs/paper_pictures.py runs

``load_cases.png``: figs 10 to 13 of paper 002 from runs/paper-002 and, dashed, runs/paper-002-ancf.
``four_states.png``: its fig. 9, from case 1 of runs/paper-002.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from pictures import save

from ringsim.plots import style
from ringsim.plots.ring import ring

SECTIONS = {1: style.INK, 9: "#d00000"}
"""Those that the paper shows, in its colours."""
PUBLISHED = {0.015: 17.58, 0.020: 15.06, 0.030: 12.16}
"""Time of deployment, s, by force, N."""
CASES = (style.BLUE, style.ORANGE, style.GREEN)
BEFORE = 160.0
"""Opening angle (degree) up to which a section's motion has not come near its locks: from there on,
0.2 s before, stress rises to what the stops make of it."""
KINDS = (
    ("paper-002", "-", "geometrically exact"),
    ("paper-002-ancf", (0, (4, 2)), "slope-vector"),
)


class Stresses(NamedTuple):
    """Largest axial + bending stress of the four diagonal halves of a section, Pa."""

    times: np.ndarray
    values: np.ndarray
    before: float
    """Largest one until the section has opened to ``BEFORE``."""
    all: float
    """Largest recorded one, the locks among it."""


def diagonals(run: xr.Dataset, section: int) -> Stresses:
    """Stress of the diagonals of a section of a run, from its records until its last one."""
    stress = run["rod_stress"].sel(section=section)
    values = stress.sel(rod=stress["rod"].str.startswith("diagonal")).max("rod")
    values = values.dropna("time")
    angle = run["opening_angle"].sel(section=section).max("plane")
    near = run["time"].values[int(np.argmax(angle.values > BEFORE))]
    calm = values.sel(time=slice(None, near))
    return Stresses(values["time"].values, values.values, float(calm.max()), float(values.max()))


def cases(runs: Path, name: str) -> list[xr.Dataset]:
    """Runs of a campaign by their forces, the smallest first."""
    with xr.open_dataset(runs / name / "campaign.nc") as campaign:
        return [campaign.isel(sample=k).load() for k in np.argsort(campaign["loads_force"].values)]


@style.styled
def load_cases(runs: Path) -> Figure:
    """Angle of section 1 in all cases; below, a panel a case, stress of sections 1 and 9."""
    figure = Figure(figsize=(10.6, 7.4))
    grid = figure.add_gridspec(2, 3, height_ratios=(1.05, 1.0))
    angles = figure.add_subplot(grid[0, :])
    first = figure.add_subplot(grid[1, 0])
    panels = [first, *(figure.add_subplot(grid[1, k], sharey=first) for k in (1, 2))]
    for name, dashes, rods in KINDS:
        for case, (run, colour, axes) in enumerate(
            zip(cases(runs, name), CASES, panels, strict=True), start=1
        ):
            force, exact = float(run["loads_force"]), name == KINDS[0][0]
            angle = run["opening_angle"].sel(section=1).mean("plane")
            angle = angle[run["time"].values <= float(run["deployment_time"])]
            angles.plot(angle["time"], angle, color=colour, linestyle=dashes, linewidth=1.6,
                        label=f"case {case}, {force:.3f} N" if exact else None)  # fmt: skip
            if exact:
                angles.plot(PUBLISHED[force], 180.0, "v", color=colour, markersize=8,
                            markeredgecolor="white", clip_on=False, zorder=4,
                            label="published time" if case == 3 else None)  # fmt: skip
            words = []
            for section, own in SECTIONS.items():
                found = diagonals(run, section)
                axes.plot(found.times, found.values / 1e3, color=own, linestyle=dashes,
                          linewidth=1.2, label=f"section {section}, {rods} rods")  # fmt: skip
                words.append(
                    f"section {section}: up to {found.before / 1e3:.0f} kPa,\n"
                    f"   at the locks {found.all / 1e6:.1f} MPa"
                )
                print(
                    f"| {rods} | {force:.3f} N | {section} | {found.before / 1e3:.1f} kPa "
                    f"| {found.all / 1e6:.2f} MPa | {float(run['deployment_time']):.3f} s |"
                )
            if exact:
                axes.set(title=f"Case {case}, {force:.3f} N", xlim=(0.0, PUBLISHED[force] + 0.6),
                         ylim=(0.0, 100.0), xlabel="Time (s)")  # fmt: skip
                axes.text(0.04, 0.95, "\n".join(words), transform=axes.transAxes, va="top",
                          fontsize=9, bbox=style.PAPER)  # fmt: skip
    angles.axhline(180.0, color=style.GREY, linewidth=0.8, zorder=1.4)
    angles.set(xlim=(0.0, 18.5), ylim=(40.0, 184.0), xlabel="Time (s)",
               ylabel="Angle between the bars\nof section 1 (deg)")  # fmt: skip
    angles.set_yticks(range(60, 181, 30))
    angles.legend(loc="upper left")
    angles.get_legend().legend_handles[-1].set_color(style.GREY)
    first.set_ylabel("Stress of the diagonals (kPa)")
    figure.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    style.title(figure, "Load cases of paper 002, its figs 10 to 13")
    return figure


def main() -> None:
    """Draw both."""
    runs = Path(sys.argv[1])
    save(load_cases(runs), "load_cases.png")
    save(ring(cases(runs, "paper-002")[0], states=4), "four_states.png")


if __name__ == "__main__":
    main()
