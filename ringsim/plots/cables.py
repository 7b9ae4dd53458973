"""Spans, tensions and pulley forces of a cable over time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.plots import style, wording
from ringsim.scene import scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing

Array = NDArray[np.float64]

_PANELS = (
    ("Span length (m)", "_lengths"),
    ("Span elongation (mm)", "_elongations"),
    ("Decay factor of a section", "_decays"),
    ("Tension at section start (N)", "_tensions"),
    ("Force on hinge pulley (N)", "_hinge_forces"),
    ("Force on V pulley (N)", "_block_forces"),
)


class SectionSeries:
    """A cable's quantities by section over time, shape (section, time), from a recorded run.

    Tensions are recorded; span lengths and angles are recomputed from the opening angles on the
    ideal geometry of one section (see ``ringsim.cable.bracket``).

    Parameters
    ----------
    dataset
        A run with ``cable_tension`` and ``opening_angle``.
    plane
        "upper" or "lower"; its cable must exist.
    """

    def __init__(self, dataset: xr.Dataset, plane: str) -> None:
        scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
        ring, cables = scene.structure, scene.cables
        assert isinstance(ring, PantographRing)
        assert cables is not None
        cable = cables.upper if plane == "upper" else cables.lower
        assert cable is not None
        self.cable: Cable = cable
        self.time = dataset["time"].values
        order = slice(None, None, -1 if cable.end == "last" else 1)
        self.opening = np.radians(
            dataset["opening_angle"].sel(plane=plane).transpose("section", "time").values[order]
        )
        tension = dataset["cable_tension"].sel(plane=plane).transpose("span", "time").values
        self.tension = tension[: scene.pulleys_of(cable) + 1]
        self._half = ring.half_bar
        self._fold = 0.5 * (np.pi - self.opening)
        aside, inward = cable.bracket.place(self._fold, cable.block_offset)
        self._drop = self._half * np.sin(self._fold) + inward
        spans = cable.bracket.spans(self._half, cable.block_offset, self.opening)
        backwards = cable.end == "last"
        self._before, self._behind = spans[::-1] if backwards else spans
        self._aside = -aside if backwards else aside
        directions = ring.geometry().directions
        following = np.einsum("ki,ki->k", directions[:-1], directions[1:])[order]
        self._half_turns = np.sqrt(0.5 * (1.0 + following))[:, None]

    @property
    def sections(self) -> int:
        """Number of sections, in the order from the winch."""
        return len(self.opening)

    @property
    def lengths(self) -> Array:
        """Length of the span before the V pulley, m."""
        return self._before

    @property
    def entry(self) -> Array:
        """Tension of the span between the section's first hinge pulley and its V pulley, N."""
        return np.asarray(self.tension[1::3][: self.sections])

    @property
    def behind(self) -> Array:
        """Tension of the span behind the V pulley, N."""
        return np.asarray(self.tension[2::3][: self.sections])

    @property
    def arriving(self) -> Array:
        """Tension of the span before the section's first hinge pulley, N."""
        return np.asarray(self.tension[0::3][: self.sections])

    @property
    def elongations(self) -> Array:
        """T L / EA of the span before the V pulley, m."""
        return self.entry * self.lengths / self.cable.axial_stiffness

    @property
    def decays(self) -> Array:
        """Tension behind a section over the tension before it; NaN while the rope is slack."""
        after = np.concatenate([self.arriving[1:], self.tension[-1:]])
        taut = self.arriving > self.cable.slack_width
        return np.asarray(np.where(taut, after / np.where(taut, self.arriving, 1.0), np.nan))

    @property
    def hinge_forces(self) -> Array:
        """Force on the first hinge pulley, N.

        The rope arrives along the boom at the first section, and from the section before, normal to
        the boom and turned by half the angle between both, at all others.  Paper 000, eqs 28, 29,
        with T1 + T2 sin gamma in the first.
        """
        level = (self._half * np.cos(self._fold) + self._aside) / self.lengths
        fall = self._drop / self.lengths
        # Cosine of the angle between the spans; each hinge pulley has half the turn of the plan.
        cosine = np.concatenate([fall[:1], -level[1:] * self._half_turns])
        square = self.entry**2 + self.arriving**2 + 2.0 * self.entry * self.arriving * cosine
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))

    @property
    def block_forces(self) -> Array:
        """Force on the V pulley along its bisector, N: (T2 + T3) sin gamma.

        Paper 000, eq. 30, prints the difference of both, but they add up (``docs/cables.md``).
        """
        return np.asarray(self._drop * (self.entry / self._before + self.behind / self._behind))


_VALUES: dict[str, Callable[[SectionSeries], Array]] = {
    "_lengths": lambda s: s.lengths,
    "_elongations": lambda s: 1e3 * s.elongations,
    "_decays": lambda s: s.decays,
    "_tensions": lambda s: s.entry,
    "_hinge_forces": lambda s: s.hinge_forces,
    "_block_forces": lambda s: s.block_forces,
}


@style.styled
def cables(dataset: xr.Dataset) -> Figure:
    """Span lengths, elongations, decays, tensions and forces on the pulleys, section by section.

    Parameters
    ----------
    dataset
        A run of a ring or truss with cables.

    Returns
    -------
    Figure
        The upper cable, or the lower where there is no other; colour counts the sections from
        the winch.
    """
    tension = dataset["cable_tension"]
    plane = next(str(p) for p in dataset["plane"].values if np.isfinite(tension.sel(plane=p)).any())
    series = SectionSeries(dataset, plane)
    figure = style.new_figure(11.0, 8.4)
    grid = figure.subplots(3, 2, sharex=True)
    moment = wording.deployment_time(dataset)
    for axes, (title, name) in zip(grid.ravel(), _PANELS, strict=True):
        values = _VALUES[name](series)
        _draw(axes, series, values)
        axes.set_ylabel(title)
        style.span_time(axes, dataset["opening_angle"])
        if name not in ("_lengths", "_decays"):
            style.span_sizes(axes, np.where(values > 1e-6, values, np.nan))
        if np.isfinite(moment):
            style.mark_moment(axes, moment)
    for axes in grid[-1]:
        axes.set_xlabel(wording.label(dataset["time"]))
    if 1 < series.sections <= 6:
        grid[0, 0].legend(loc="best")
    wording.head(figure, grid[0, 0], dataset, f"{plane.capitalize()} cable")
    return figure


def _draw(axes: Axes, series: SectionSeries, values: Array) -> None:
    colours = style.section_colours(series.sections)(np.arange(series.sections))
    for section, row in enumerate(values):
        axes.plot(
            series.time, row, color=colours[section], linewidth=1.2, label=f"section {section + 1}"
        )
