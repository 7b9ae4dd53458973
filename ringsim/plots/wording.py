"""Words of the figures, from the dataset's attributes."""

from __future__ import annotations

import math
import textwrap

import numpy as np
import xarray as xr

from ringsim.variables import Status

_PREFIXES = {-4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}
_PREFIXED = ("J", "Pa", "N", "W")


def label(variable: xr.DataArray, units: str | None = None, width: int = 60) -> str:
    """Meaning and unit of a variable, as on an axis: "Time since the start of the run (s)".

    ``units`` replaces the variable's own where its values were scaled; lines longer than
    ``width`` characters are broken.
    """
    words = str(variable.attrs.get("long_name", variable.name))
    units = str(variable.attrs.get("units", "1")) if units is None else units
    words = words[:1].upper() + words[1:]
    return textwrap.fill(words if units == "1" else f"{words} ({units})", width)


def readable_units(*variables: xr.DataArray) -> tuple[float, str]:
    """Factor and prefixed unit that scale the largest value to between 0.5 and 500.

    The variables share one unit; only J, Pa, N and W get a prefix.
    """
    units = str(variables[0].attrs.get("units", "1"))
    largest = max(largest_magnitude(v) for v in variables)
    if units not in _PREFIXED or largest == 0.0:
        return 1.0, units
    power = min(max(math.floor(math.log10(2.0 * largest) / 3.0), -4), 3)
    return 1000.0**-power, _PREFIXES[power] + units


def largest_magnitude(variable: xr.DataArray) -> float:
    """Largest finite absolute value, 0 if there is none."""
    values = variable.values
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def deployment_time(dataset: xr.Dataset) -> float:
    """Time at which the last V-joint locked (s), NaN if it did not."""
    return float(dataset.get("deployment_time", math.nan))


def ending(dataset: xr.Dataset) -> str:
    """How the run ended, in one sentence."""
    word = Status(int(dataset["status"])).word.replace("_", " ")
    deployed = deployment_time(dataset)
    final = float(dataset.get("final_time", math.nan))
    if word == "ok" and math.isfinite(deployed):
        return f"Deployed after {deployed:.2f} s"
    reason = str(dataset.attrs.get("reason", "")).strip()
    start = "Ended" if word == "ok" else word[:1].upper() + word[1:]
    start += f" after {final:.4g} s" if math.isfinite(final) else ""
    return f"{start}: {reason}" if reason else start


def balanced(text: str, width: int) -> str:
    """Break a text into as few lines as fit, all about equally long."""
    lines = len(textwrap.wrap(text, width))
    fitting = (w for w in range(1, width + 1) if len(textwrap.wrap(text, w)) <= lines)
    return textwrap.fill(text, next(fitting, width))
