"""Work, energies and energy balance of a run over time."""

import math

import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style

_LOOKS = {
    "work": (style.INK, "-"),
    "kinetic_energy": (style.BLUE, "-"),
    "elastic_energy": (style.ORANGE, (0, (5, 1.5))),
    "dissipation": (style.VERMILLION, (0, (1.2, 1.2))),
}


@style.styled
def energy(dataset: xr.Dataset) -> Figure:
    """``work``, ``kinetic_energy``, ``elastic_energy`` and ``dissipation`` (time) of a run.

    Below them is their imbalance, each in a unit of its own size; ``energy_error`` is stated where
    it is known.
    """
    figure = Figure(figsize=(8.0, 6.3))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 2))
    factor, units = style.readable_units(*(dataset[name] for name in _LOOKS))
    for name, (colour, dashes) in _LOOKS.items():
        (line,) = upper.plot(dataset["time"], factor * dataset[name], color=colour)
        line.set(linestyle=dashes, label=dataset[name].attrs["long_name"])
    upper.margins(y=0.08)
    upper.set_ylabel(f"Energy ({units})")
    # Beside the curves: between them there need not be room.
    figure.legend(handles=upper.lines, loc="outside lower center", ncols=2)
    lack = imbalance(dataset)
    factor, units = style.readable_units(lack)
    lower.axhline(0.0, color=style.GREY, linewidth=0.7, zorder=1.2)
    lower.plot(lack["time"], factor * lack, color=style.PURPLE)
    lower.set_ylabel(f"Imbalance ({units})")
    if math.isfinite(error := float(dataset.get("energy_error", math.nan))):
        lower.set_title(f"{style.label(dataset['energy_error'])}: {error:.1e}")
    style.time_axes(dataset, dataset["work"], upper, lower)
    style.head(figure, upper, dataset, "Energy")
    return figure


def imbalance(dataset: xr.Dataset) -> xr.DataArray:
    """Work - dissipation - kinetic - elastic energy since the start, (time,), J; ideally 0."""
    stored = dataset["kinetic_energy"] + dataset["elastic_energy"]
    lack = dataset["work"] - dataset["dissipation"] - stored
    first = lack.dropna("time")[:1].sum()
    return (lack - first).assign_attrs(units=dataset["work"].attrs["units"])
