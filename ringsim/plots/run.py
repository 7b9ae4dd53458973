"""All figures of a run that apply to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.parts.structure.pantograph_ring import PantographRing
from ringsim.plots import style
from ringsim.plots.asynchrony import asynchrony
from ringsim.plots.diagonal_stress import diagonal_stress
from ringsim.plots.energy import energy
from ringsim.plots.opening_angles import opening_angles
from ringsim.plots.ring import ring
from ringsim.refusal import InputError
from ringsim.scene import scene_from_toml


@dataclass(frozen=True)
class _Picture:
    name: str
    draw: Callable[[xr.Dataset], Figure]
    needs: tuple[str, ...]
    """Variables that must be recorded at one time at least."""
    ring_only: bool = False


PICTURES = (
    _Picture("opening_angles", opening_angles, ("opening_angle",)),
    _Picture("asynchrony", asynchrony, ("asynchrony",)),
    _Picture("diagonal_stress", diagonal_stress, ("rod_stress",)),
    _Picture("ring", ring, ("opening_angle",), ring_only=True),
    _Picture("energy", energy, ("work", "kinetic_energy", "elastic_energy", "dissipation")),
)


def draw_run(dataset: xr.Dataset, folder: str | Path) -> list[Path]:
    """Write every figure for which the run recorded something, as PNG.

    Parameters
    ----------
    dataset
        One run, finished or not, as ``ringsim.dataset.to_dataset`` makes it.
    folder
        Where the files go; it is created if it does not exist.

    Returns
    -------
    list[Path]
        The files written; none if the run ended before its first record.

    Raises
    ------
    InputError
        If the folder or a file cannot be written.
    """
    folder = Path(folder)
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for picture in PICTURES:
            if _applies(picture, dataset):
                path = folder / f"{picture.name}.png"
                style.write(picture.draw(dataset), path)
                written.append(path)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error
    return written


def _applies(picture: _Picture, dataset: xr.Dataset) -> bool:
    recorded = all(
        name in dataset and bool(np.isfinite(dataset[name]).any()) for name in picture.needs
    )
    if not (recorded and picture.ring_only):
        return recorded
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    return isinstance(scene.structure, PantographRing)
