"""All figures that apply to a campaign."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import xarray as xr
from matplotlib.figure import Figure

from ringsim.analysis.courses import courses
from ringsim.analysis.design import any_finite, inputs, judged_by, placement, scalars
from ringsim.analysis.intervals import ran
from ringsim.files import writing
from ringsim.plots import style
from ringsim.plots.campaign.courses import fan, lag_map, lock_order
from ringsim.plots.campaign.endings import base_load, margin, motors, tension
from ringsim.plots.campaign.numbers import by_input, convergence, distributions, rare_event, reached
from ringsim.plots.campaign.tornado import explained, is_one_by_one, one_by_one, tornado


def _spread(campaign: xr.Dataset) -> bool:
    """Whether main numbers are of samples that no other figure tells better."""
    return bool(scalars(campaign)) and not reached(campaign) and not is_one_by_one(campaign)


def _converges(campaign: xr.Dataset) -> bool:
    """Whether more samples make means and quantiles more certain."""
    return bool(scalars(campaign)) and placement(campaign).population


def _has_run(campaign: xr.Dataset) -> bool:
    """Whether something became of drawn inputs."""
    return bool(inputs(campaign)) and bool(ran(campaign).any())


class Picture(NamedTuple):
    """A figure of a campaign, and what it needs."""

    name: str
    draw: Callable[..., Figure]
    words: str
    """What it shows, for those who cannot see it."""
    needs: tuple[str, ...] = ()
    """Variables that must be there; some used sample must have a value of the first."""
    of: Callable[[xr.Dataset], object] = bool
    """What must hold beyond that."""
    read: Callable[[xr.Dataset], object] | None = None
    """What several figures read of the campaign, once: their second argument."""


_COURSES = ("asynchrony", "opening_angle", "final_time", "deployment_time")
"""Asynchrony first: without a value of it there is nothing to draw."""
PICTURES = (
    Picture(
        "rare_event", rare_event, "Probability of what levels reached, up to the rare event",
        of=reached,
    ),
    Picture(
        "one_by_one", one_by_one, "Main numbers after each single change", of=is_one_by_one,
    ),
    Picture(
        "distributions", distributions,
        "Cumulative distribution of each main number, with its limits", of=_spread,
    ),
    Picture(
        "margin", margin, "Smallest margin of the drive by ending, and its course",
        ("drive_margin", "least_drive_margin", "opening_angle"),
    ),
    Picture(
        "fan", fan, "Deviation of each section from the mean opening angle, over all samples",
        _COURSES, judged_by, courses,
    ),
    Picture(
        "lag_map", lag_map, "Section by time: lag of the median and of the worst sample",
        _COURSES, judged_by, courses,
    ),
    Picture(
        "lock_order", lock_order, "How often each V-joint locks first, last and not at all",
        ("lock_time",),
    ),
    Picture(
        "by_input", by_input, "What became of each sample, by each drawn input", of=_has_run,
    ),
    Picture(
        "tornado", tornado, "Which inputs matter for each main number, with intervals",
        of=explained,
    ),
    Picture(
        "convergence", convergence,
        "Mean, 95 % quantile and probability of each requirement as samples come in",
        of=_converges,
    ),
    Picture(
        "motors", motors, "Torque and speed of the motors over time, by ending",
        ("motor_torque", "motor_speed"),
    ),
    Picture(
        "base", base_load, "Force and torque at the base over time, by ending",
        ("base_force", "base_torque"),
    ),
    Picture(
        "tension", tension, "Largest tension of each span along the cables",
        ("cable_tension", "final_time", "deployment_time"),
    ),
)  # fmt: skip


def figures_of(campaign: xr.Dataset) -> Iterator[tuple[Picture, Figure]]:
    """Every figure for which the samples of a merged campaign recorded something."""
    read: dict[object, object] = {}
    for picture in PICTURES:
        there = all(name in campaign for name in picture.needs)
        if there and picture.needs[:1]:
            # Of a number that no run has reached the file still has the variable.
            there = any_finite(campaign, picture.needs[0])
        if not there or not picture.of(campaign):
            continue
        if picture.read is not None and picture.read not in read:
            read[picture.read] = picture.read(campaign)
        shared = [] if picture.read is None else [read[picture.read]]
        yield picture, picture.draw(campaign, *shared)


def draw_campaign(
    campaign: xr.Dataset,
    folder: str | Path,
    name: str = "campaign",
    formats: Sequence[str] = ("png",),
) -> list[Path]:
    """Write every figure of a merged campaign as NAME-fig-FIGURE.png; see ``draw_run``.

    Returns the files written, none if no sample has run.  InputError if one cannot be written.
    """
    folder = Path(folder)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    written = []
    for picture, figure in figures_of(campaign):
        for kind in formats:
            path = folder / f"{name}-fig-{picture.name}.{kind}"
            with writing(folder):
                style.write(figure, path)
            written.append(path)
    return written
