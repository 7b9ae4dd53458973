"""All figures that apply to a run."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.files import writing
from ringsim.plots import style
from ringsim.plots.asynchrony import asynchrony
from ringsim.plots.cables import cables
from ringsim.plots.drive import drive
from ringsim.plots.energy import energy
from ringsim.plots.nodal_forces import nodal_forces
from ringsim.plots.opening_angles import opening_angles
from ringsim.plots.planar_truss import strain_over_length, tension_over_length
from ringsim.plots.pulleys import pulleys
from ringsim.plots.ring import ring
from ringsim.plots.rod_stress import rod_stress
from ringsim.plots.section_map import section_map
from ringsim.scene import scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing


class _Picture(NamedTuple):
    name: str
    draw: Callable[[xr.Dataset], Figure]
    needs: tuple[str, ...]
    """Variables that must be recorded at one time at least."""
    ring_only: bool = False


PICTURES = (
    _Picture("opening_angles", opening_angles, ("opening_angle",), ring_only=True),
    _Picture("asynchrony", asynchrony, ("asynchrony", "opening_angle")),
    _Picture("section_map", section_map, ("opening_angle", "asynchrony"), ring_only=True),
    _Picture("rod_stress", rod_stress, ("rod_stress",), ring_only=True),
    _Picture("ring", ring, ("opening_angle",), ring_only=True),
    _Picture("cables", cables, ("cable_tension", "rope_strain"), ring_only=True),
    _Picture("pulleys", pulleys, ("pulley_ratio", "opening_angle"), ring_only=True),
    _Picture("nodal_forces", nodal_forces, ("cable_tension", "opening_angle"), ring_only=True),
    _Picture("tension", tension_over_length, ("cable_tension", "cable_length")),
    _Picture("bending_strain", strain_over_length, ("bending_strain", "cable_length")),
    _Picture("drive", drive, ("drive_margin", "opening_angle")),
    _Picture("energy", energy, ("work", "kinetic_energy", "elastic_energy", "dissipation")),
)


def draw_run(
    dataset: xr.Dataset, folder: str | Path, name: str = "run", formats: Sequence[str] = ("png",)
) -> list[Path]:
    """Write every figure for which the run recorded something, as NAME-fig-FIGURE.png.

    ``dataset`` is a run, finished or not, as ``ringsim.dataset.to_dataset`` makes it.  ``folder``
    is created if it does not exist; ``formats`` are any of png, svg and pdf.  Returns the files
    written, none if the run ended before its first record.

    Raises
    ------
    InputError
        If the folder or a file cannot be written.
    """
    folder = Path(folder)
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    is_ring = isinstance(scene.structure, PantographRing)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    written = []
    for subject, draw, needs, ring_only in PICTURES:
        recorded = all(n in dataset and bool(np.isfinite(dataset[n]).any()) for n in needs)
        if not recorded or (ring_only and not is_ring):
            continue
        figure = draw(dataset)
        for kind in formats:
            path = folder / f"{name}-fig-{subject}.{kind}"
            with writing(folder):
                style.write(figure, path)
            written.append(path)
    return written
