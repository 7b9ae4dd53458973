"""All figures that apply to a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.asynchrony import asynchrony
from ringsim.plots.cables import cables
from ringsim.plots.diagonal_stress import diagonal_stress
from ringsim.plots.energy import energy
from ringsim.plots.opening_angles import opening_angles
from ringsim.plots.planar_truss import strain_over_length, tension_over_length
from ringsim.plots.ring import ring
from ringsim.refusal import InputError
from ringsim.scene import scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing


@dataclass(frozen=True)
class _Picture:
    name: str
    draw: Callable[[xr.Dataset], Figure]
    needs: tuple[str, ...]
    """Variables that must be recorded at one time at least."""
    ring_only: bool = False


PICTURES = (
    _Picture("opening_angles", opening_angles, ("opening_angle", "lock_time")),
    _Picture("asynchrony", asynchrony, ("asynchrony",)),
    _Picture("diagonal_stress", diagonal_stress, ("rod_stress",), ring_only=True),
    _Picture("ring", ring, ("opening_angle", "asynchrony")),
    _Picture("cables", cables, ("cable_tension", "asynchrony"), ring_only=True),
    _Picture("tension", tension_over_length, ("cable_tension", "cable_length")),
    _Picture("bending_strain", strain_over_length, ("bending_strain", "cable_length")),
    _Picture("energy", energy, ("work", "kinetic_energy", "elastic_energy", "dissipation")),
)


def draw_run(dataset: xr.Dataset, folder: str | Path, prefix: str = "") -> list[Path]:
    """Write every figure for which the run recorded something, as PNG.

    Parameters
    ----------
    dataset
        One run, finished or not, as ``ringsim.dataset.to_dataset`` makes it.
    folder
        Where the files go; it is created if it does not exist.
    prefix
        What the files' names begin with, so that several runs share a folder.

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
        for picture in _pictures(dataset):
            path = folder / f"{prefix}{picture.name}.png"
            style.write(picture.draw(dataset), path)
            written.append(path)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error
    return written


def _pictures(dataset: xr.Dataset) -> tuple[_Picture, ...]:
    """The pictures for which something was recorded, and whose rods or cables are those of a ring
    where they draw these alone.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    is_ring = isinstance(scene.structure, PantographRing)
    return tuple(
        picture
        for picture in PICTURES
        if _recorded(picture, dataset) and (is_ring or not picture.ring_only)
    )


def _recorded(picture: _Picture, dataset: xr.Dataset) -> bool:
    return all(name in dataset and bool(np.isfinite(dataset[name]).any()) for name in picture.needs)
