"""The stability map: how each cell ended, why, and whether "ok" was true.

A cell is one run.  It is "ok" if it ended well with its errors within their tolerances, "ended"
if its status and reason name a cause, and "wrong" if it says ok and is not, or fails without a
cause.  Random ok cells are run again with smaller steps; one that differs by more than it
promises is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.outputs import VARIABLES
from ringsim.parts.solver import Solver
from ringsim.variables import Status

Array = NDArray[np.float64]

OK, ENDED, WRONG = "ok", "ended", "wrong"
OUT_OF_STEPS = "step limit"
CAUSES = (
    (OUT_OF_STEPS, "solver.step_limit = "),
    ("energy grew", "energy from nothing"),
    ("energy lost", "energy got lost"),
    ("blow-up", "blew up"),
    ("blow-up", "not finite"),
    ("stop passed", "past its stop"),
    ("few steps", "the first V-joint locked within"),
    ("tension bends", "a tension bends by"),
    ("joint gap", "joints came apart"),
    ("Newton", "the solver gave up"),
    ("end time", "solver.end_time = "),
    ("time limit", "limits.timeout = "),
    ("memory", "limits.memory = "),
    ("refused", "InputError"),
)
"""Word of a cause, and the words by which a reason names it; the first that occurs counts."""

TIME_PROMISE, ANGLE_PROMISE, TENSION_PROMISE = 0.01, 0.5, 0.05
"""What an ok cell promises: relative error of the deployment time, error in degree of the mean
angle where a run ended before, and error of the largest tension over itself."""
MORE_STEPS = 1.5
"""Steps of a finer run over those of the cell, at least; Newton may have cut both to the same."""
ENERGY_PROMISE = Solver().energy_tolerance
"""Largest energy error of an ok cell."""

_SCALARS = (
    "energy_error", "constraint_error", "restarts", "steps", "cpu_time", "deployment_time",
    "final_time", "peak_tension",
)  # fmt: skip
_MEANING = {
    "x": ("1", "value on the first axis, in the units of the cell's group"),
    "y": ("1", "value on the second axis, in the units of the cell's group"),
    "of_group": ("1", "number of the cell's group"),
    "reason": ("1", "why the run ended so"),
    "cause": ("1", "the reason in a word"),
    "verdict": ("1", "ok, ended with a cause, or wrong"),
    "check": ("1", "whether a finer run held what ok promises"),
    "final_angle": ("degree", "mean opening angle at the last output time"),
    "time_difference": ("1", "change of the deployment time in a finer run, over itself"),
    "angle_difference": ("degree", "change of the mean opening angle in a finer run"),
    "tension_difference": ("1", "change of the largest tension in a finer run, over itself"),
}


def cause_of(reason: str) -> str:
    """The word for a run's reason; empty if it names none of ``CAUSES``.

    Of a run that started anew the last start counts, unless it only ran out of the steps that it
    made smaller: then what ended the first one is the cause.
    """
    last, _, before = reason.partition(" (start ")
    first = before.partition("start 1: ")[2]
    found = _named(last)
    return (_named(first) or found) if found == OUT_OF_STEPS else found


def _named(reason: str) -> str:
    return next((word for word, phrase in CAUSES if phrase in reason), "")


def cells_of(campaign: xr.Dataset, x: Sequence[float], y: Sequence[float]) -> xr.Dataset:
    """The cells of one campaign.

    Parameters
    ----------
    campaign
        A merged campaign.
    x, y
        Values of the two axes for each of its samples.

    Returns
    -------
    xr.Dataset
        Over ``cell``: ``x``, ``y``, ``status`` (code), ``reason``, ``cause``, ``final_angle`` (mean
        opening angle at the last output time that was reached, degree) and the run's numbers.
    """
    count = campaign.sizes["sample"]
    reasons = [str(reason) for reason in campaign["reason"].values]
    status = campaign["status"].values.astype(int)
    found: dict[str, tuple[str, object]] = {
        "x": ("cell", np.asarray(x, dtype=float)),
        "y": ("cell", np.asarray(y, dtype=float)),
        "status": ("cell", status),
        "reason": ("cell", np.array(reasons, dtype=object)),
        "cause": ("cell", np.array([_cause(*one) for one in zip(status, reasons, strict=True)])),
        "final_angle": ("cell", _final_angle(campaign)),
    }
    for name in _SCALARS:
        known = name in campaign
        values = campaign[name].values.astype(float) if known else np.full(count, np.nan)
        if known and campaign[name].dtype.kind == "i":
            values[values < 0.0] = np.nan
        found[name] = ("cell", values)
    return _described(xr.Dataset(found))


def _described(cells: xr.Dataset) -> xr.Dataset:
    """Add what each variable means, and its unit."""
    for name, variable in cells.items():
        words = _MEANING.get(str(name))
        if words is None and str(name) in VARIABLES:
            words = (VARIABLES[str(name)].units, VARIABLES[str(name)].long_name)
        if words is not None:
            variable.attrs["long_name"] = words[1]
            if variable.dtype.kind in "fi":
                variable.attrs["units"] = words[0]
    return cells


def _cause(status: int, reason: str) -> str:
    return "" if status == Status.OK else cause_of(reason) or Status(status).word


def _final_angle(campaign: xr.Dataset) -> Array:
    if "opening_angle" not in campaign:
        return np.full(campaign.sizes["sample"], np.nan)
    angle = campaign["opening_angle"].transpose("sample", "time", ...).values
    mean = angle.reshape(*angle.shape[:2], -1).mean(axis=2)
    known = np.isfinite(mean)
    last = np.where(known.any(axis=1), mean.shape[1] - 1 - known[:, ::-1].argmax(axis=1), 0)
    found: Array = mean[np.arange(len(mean)), last]
    return found


def judged(cells: xr.Dataset) -> xr.Dataset:
    """Add the ``verdict`` of every cell.

    A cell that ended before its goal is "ended", sound as its motion may be.  One that is ok with
    an energy error over its tolerance, or whose check (see :func:`checked`) failed, is "wrong".
    """
    status = cells["status"].values
    verdict = np.where(status == Status.OK, OK, ENDED).astype(object)
    nameless = [Status(code).word for code in status] == cells["cause"].values
    crashed = np.isin(status, (Status.ERROR, Status.CRASHED)) & (cells["cause"] != "refused").values
    verdict[(status != Status.OK) & nameless | crashed] = WRONG
    verdict[(status == Status.OK) & (cells["energy_error"] > ENERGY_PROMISE).values] = WRONG
    if "check" in cells:
        verdict[(cells["check"] == "differs").values] = WRONG
    return cells.assign(verdict=("cell", verdict.astype(str)))


def chosen_for_check(cells: xr.Dataset, share: float, seed: int) -> NDArray[np.int64]:
    """Cells to run again with smaller steps: a random share of those that are ok, at least one.

    Parameters
    ----------
    cells
        The judged map.
    share
        Between 0 and 1.
    seed
        Of the choice.
    """
    good = np.flatnonzero((cells["verdict"] == OK).values)
    count = min(len(good), max(1, round(share * len(good))))
    picked = np.random.default_rng(seed).choice(good, count, replace=False)
    return np.sort(picked).astype(np.int64)


def checked(cells: xr.Dataset, which: NDArray[np.int64], finer: xr.Dataset) -> xr.Dataset:
    """Compare cells with the same ones run with smaller steps.

    Parameters
    ----------
    cells
        The map.
    which
        Numbers of the cells that were run again.
    finer
        Those cells, in this order, as :func:`cells_of` gives them.

    Returns
    -------
    xr.Dataset
        The map with ``time_difference`` (relative), ``angle_difference`` (degree) and
        ``tension_difference`` (relative) of those cells, and ``check``: "" (not checked),
        "holds", "differs", or "unproven" where the finer run did not end or was hardly finer.
    """
    found = cells.copy()
    for name in ("time_difference", "angle_difference", "tension_difference"):
        found[name] = ("cell", np.full(cells.sizes["cell"], np.nan))
    mine = cells.isel(cell=which)
    proves = (finer["status"] == Status.OK).values
    for name, variable in (("time", "deployment_time"), ("tension", "peak_tension")):
        there = finer[variable].values
        change = np.abs(mine[variable].values - there) / np.abs(there)
        found[f"{name}_difference"].values[which] = change
    angles = np.abs(mine["final_angle"].values - finer["final_angle"].values)
    timed = np.isfinite(finer["deployment_time"].values)
    found["angle_difference"].values[which] = np.where(timed, np.nan, angles)
    over = np.zeros(len(which), dtype=bool)
    for name, promise in (
        ("time", TIME_PROMISE), ("angle", ANGLE_PROMISE), ("tension", TENSION_PROMISE),
    ):  # fmt: skip
        over |= found[f"{name}_difference"].values[which] > promise
    check = np.full(cells.sizes["cell"], "", dtype=object)
    hardly = (finer["steps"].values < MORE_STEPS * mine["steps"].values) & ~over
    check[which] = np.where(~proves | hardly, "unproven", np.where(over, "differs", "holds"))
    found["check"] = ("cell", check.astype(str))
    return judged(_described(found))


def joined(groups: Sequence[tuple[dict[str, str], xr.Dataset]]) -> xr.Dataset:
    """One map of all groups.

    Parameters
    ----------
    groups
        Name, title and the axes' labels and units (``name``, ``title``, ``x_label``, ``x_units``,
        ``y_label``, ``y_units``), and the cells of each group.

    Returns
    -------
    xr.Dataset
        Dimensions ``group`` and ``cell``; ``of_group`` is the number of each cell's group.
    """
    parts = [
        cells.assign(of_group=("cell", np.full(cells.sizes["cell"], number)))
        for number, (_, cells) in enumerate(groups)
    ]
    whole = xr.concat(parts, dim="cell")
    for key in groups[0][0]:
        whole[key] = ("group", np.array([words[key] for words, _ in groups], dtype=object))
    return _described(judged(whole))
