"""What became of each, and which one stands for many."""

import json
import tomllib
from collections import Counter
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.quantities import good, numbers, used
from ringsim.outputs import VARIABLES
from ringsim.variables import Fate, Status

NUMERICAL = ("energy_error", "constraint_error")
"""Main numbers that tell about the solution, not about the antenna."""
_EFFORT = ("wall_time",)


def endings(campaign: xr.Dataset) -> NDArray[np.str_]:
    """What became of each sample in words: an outcome, or why its numbers do not hold; (sample,).

    >>> codes = {"status": ("sample", [0, 0, 7, -1]), "outcome": ("sample", [1, 3, 0, -1])}
    >>> endings(xr.Dataset(codes)).tolist()
    ['deployed', 'stalled', 'failed: memory', 'not run']
    """
    status = campaign["status"].to_numpy()
    fates = campaign["outcome"].to_numpy() if "outcome" in campaign else np.zeros_like(status)
    known = {int(fate) for fate in Fate}
    words = []
    for code, fate in zip(status.tolist(), fates.tolist(), strict=True):
        if code < 0:
            words.append("not run")
        elif Status(code).failed:
            words.append(f"failed: {Status(code).word.replace('_', ' ')}")
        else:
            named = Fate(fate) if fate in known else Fate.NONE
            words.append("ok" if named == Fate.NONE else named.word.replace("_", " "))
    return np.array(words, dtype=str)


def told(campaign: xr.Dataset, counted: int) -> str:
    """How many samples a statement counts, and what became of those that it does not.

    ``counted`` are samples that are ``used`` and have the value in question.
    """
    words = endings(campaign)
    ok = good(campaign)
    left = [f"{count} {word}" for word, count in Counter(words[~ok].tolist()).items()]
    if without := int(ok.sum()) - counted:
        left.append(f"{without} without a value")
    lost = f"; left out: {', '.join(left)}" if left else "; none lost"
    return f"{counted} of {len(words)} samples{lost}"


def scalars(campaign: xr.Dataset) -> list[str]:
    """Main numbers of the antenna that some sample has, in the order of summaries."""
    sound = used(campaign)
    return [
        name
        for name, variable in VARIABLES.items()
        if variable.summary is not None
        and variable.dtype == "f8"
        and name not in (*NUMERICAL, *_EFFORT)
        and name in sound
        and bool(np.isfinite(sound[name]).any())
    ]


def values_of(campaign: xr.Dataset, name: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Samples that are used and have a finite value, and these values."""
    values = numbers(campaign, name)
    known = good(campaign) & np.isfinite(values)
    return campaign["sample"].to_numpy()[known], values[known]


def judged_by(campaign: xr.Dataset) -> str:
    """The number by which samples are ordered: asynchrony, or the time if there is none; ""."""
    names = scalars(campaign)
    return next((n for n in ("asynchrony_max", "deployment_time") if n in names), "")


def median_and_worst(campaign: xr.Dataset) -> tuple[int, int] | None:
    """The samples in the middle and at the worst end of that order; None if no sample is used."""
    if not (name := judged_by(campaign)):
        samples = used(campaign)["sample"].to_numpy()
        return (int(samples[0]), int(samples[0])) if len(samples) else None
    samples, values = values_of(campaign, name)
    order = np.argsort(VARIABLES[name].badness * values, kind="stable")
    return int(samples[order[(len(order) - 1) // 2]]), int(samples[order[-1]])


def inputs(campaign: xr.Dataset) -> list[str]:
    """A variable for each drawn input: the first of those that share its values."""
    found: dict[str, str] = {}
    for name, variable in campaign.data_vars.items():
        if variable.attrs.get("role") == "input":
            # Files of older runs tell the paths that share values, and no name.
            told = str(variable.attrs.get("input") or paths_of(variable))
            found.setdefault(told, str(name))
    return [*found.values()]


def called(variable: xr.DataArray) -> str:
    """The campaign file's own name of an input, which is its path where it has no other."""
    says = variable.attrs
    return str(says.get("input") or says.get("path") or variable.name)


def paths_of(variable: xr.DataArray) -> list[str]:
    """The scene's paths that take the values of an input: one, or all that share it."""
    shared = distribution_of(variable).get("shared")
    return shared or [str(variable.attrs.get("path") or variable.name)]


def campaign_file(campaign: xr.Dataset) -> dict[str, Any]:
    """The tables of the campaign's file, which the dataset keeps as text."""
    return tomllib.loads(str(campaign.attrs.get("campaign", "")))


def requirements_of(campaign: xr.Dataset) -> dict[str, dict[str, Any]]:
    """What the campaign requires of its numbers: tables with min, max or is, by name."""
    stored = campaign.attrs.get("requirements")
    wanted = json.loads(stored) if stored else campaign_file(campaign).get("requirements", {})
    return {name: each for name, each in wanted.items() if {"min", "max", "is"} & each.keys()}


def distribution_of(variable: xr.DataArray) -> dict[str, Any]:
    """A drawn input's distribution; {"text": ...} where it came out of a list."""
    text = str(variable.attrs.get("distribution", ""))
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    return found if isinstance(found, dict) else {"text": text}
