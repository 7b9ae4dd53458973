"""All figures that apply to a run."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.files import writing
from ringsim.plots import style
from ringsim.plots.asynchrony import asynchrony
from ringsim.plots.cables import cables
from ringsim.plots.diagonal_stress import diagonal_stress
from ringsim.plots.energy import energy
from ringsim.plots.opening_angles import opening_angles
from ringsim.plots.planar_truss import strain_over_length, tension_over_length
from ringsim.plots.ring import ring
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
    _Picture("asynchrony", asynchrony, ("asynchrony",)),
    _Picture("diagonal_stress", diagonal_stress, ("rod_stress",), ring_only=True),
    _Picture("ring", ring, ("opening_angle",), ring_only=True),
    _Picture("cables", cables, ("cable_tension",), ring_only=True),
    _Picture("tension", tension_over_length, ("cable_tension", "cable_length")),
    _Picture("bending_strain", strain_over_length, ("bending_strain", "cable_length")),
    _Picture("energy", energy, ("work", "kinetic_energy", "elastic_energy", "dissipation")),
)


def draw_run(dataset: xr.Dataset, folder: str | Path, prefix: str = "") -> list[Path]:
    """Write every figure for which the run recorded something, as PNG.

    ``dataset`` is a run, finished or not, as ``ringsim.dataset.to_dataset`` makes it.  ``folder``
    is created if it does not exist; all names begin with ``prefix``.  Returns the files written,
    none if the run ended before its first record.

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
    for name, draw, needs, ring_only in PICTURES:
        recorded = all(n in dataset and bool(np.isfinite(dataset[n]).any()) for n in needs)
        if recorded and (is_ring or not ring_only):
            figure, path = draw(dataset), folder / f"{prefix}{name}.png"
            with writing(folder):
                style.write(figure, path)
            written.append(path)
    return written
