"""The registry of figures: a function with ``@picture`` is one, anywhere below this package."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from ringsim.layout.bodies import JointOpening, OnRod
from ringsim.layout.layout import layout_of
from ringsim.plots import style
from ringsim.scene import scene_from_toml

NO_JOINTS = "its structure has no joints that open between two rods"


class Picture(NamedTuple):
    """A figure of a run or of a campaign, and what it needs."""

    name: str
    draw: Callable[..., Figure]
    of: str
    """"run" or "campaign"."""
    place: int
    """By which figures are ordered."""
    words: str
    """What it shows, for those who cannot see it."""
    needs: tuple[str, ...]
    """Variables that must be there and recorded: of runs all, of campaigns the first."""
    applies: Callable[[xr.Dataset], object]
    """What must hold beyond that."""
    read: Callable[[xr.Dataset], object] | None
    """What several figures read of the dataset, once: their second argument."""


known = dict[tuple[str, str], Picture]()
"""All figures by what they are of and by name."""


def picture(
    of: str, place: int, words: str = "", needs: tuple[str, ...] = (),
    applies: Callable[[xr.Dataset], object] = bool,
    read: Callable[[xr.Dataset], object] | None = None, name: str = "",
) -> Callable[[Callable[..., Figure]], Callable[..., Figure]]:  # fmt: skip
    """Decorator: a function that draws a dataset is a figure, called as it, or ``name``."""

    def register(draw: Callable[..., Figure]) -> Callable[..., Figure]:
        styled: Callable[..., Figure] = style.styled(draw)
        called = name or str(getattr(draw, "__name__", ""))
        known[of, called] = Picture(called, styled, of, place, words, needs, applies, read)
        return styled

    return register


def jointed(dataset: xr.Dataset) -> bool:
    """Whether the structure has joints that open, by its layout."""
    return _openings(str(dataset.attrs.get("scene", "")))[0]


def barred(dataset: xr.Dataset) -> bool:
    """Whether joints open between two rods each, as folding bars do, along which cables run."""
    return _openings(str(dataset.attrs.get("scene", "")))[1]


@functools.lru_cache(maxsize=8)
def _openings(scene: str) -> tuple[bool, bool]:
    layout = layout_of(scene_from_toml(scene, source="attribute scene"))
    joints = [
        layout.joints[one.joint]
        for plane in layout.openings for one in plane if isinstance(one, JointOpening)
    ]  # fmt: skip
    sides = (side for joint in joints for side in (joint.first, joint.second))
    return bool(joints), bool(joints) and all(isinstance(side, OnRod) for side in sides)
