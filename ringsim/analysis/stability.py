"""The stability map: how each cell (one run) ended, why, and whether "ok" was true."""

import itertools
import textwrap
from collections import Counter
from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.engines import differ, held
from ringsim.outputs import VARIABLES
from ringsim.parts.solver import Solver
from ringsim.tables import counted, markdown_table, unit_behind
from ringsim.variables import GOALS, Cause, Fate, Status

# Where the engines differ in a stability map: cells with another end, or with other values.
#
# Values differ if they are further apart than both of their error bars together, which only cells
# that reached their goal have.


ENGINES = "engines"
"""Variable over ``cell``: in what a cell differs from that of the other engine."""
AGREE = "agree"
JUDGED = ("deployment_time", "asynchrony_max", "peak_tension")
"""Values with error bars that cells have."""
_LONGEST_OF_BOTH = 120


def compared(whole: xr.Dataset) -> xr.Dataset:
    """Add ``engines`` to a judged map, if a panel of it was run by both engines.

    Of a cell "agree", "status", "outcome" or the first of ``JUDGED`` that differs; empty in panels
    of one engine.
    """
    if not (pairs := _pairs(whole)):
        return whole
    words = np.full(whole.sizes["cell"], "", dtype=object)
    for full, frame in pairs:
        words[full] = words[frame] = _apart(whole.isel(cell=full), whole.isel(cell=frame))
    about = {"long_name": "difference from the same cell of the other engine"}
    return whole.assign({ENGINES: ("cell", words, about)})


def _pairs(whole: xr.Dataset) -> list[tuple[np.ndarray, np.ndarray]]:
    """Numbers of the cells of each panel that both engines ran, those of the full one first."""
    names, of_group = whole["name"].values.tolist(), whole["of_group"].values
    places = [np.flatnonzero(of_group == number) for number in range(len(names))]
    return [
        (places[names.index(name.removesuffix("-frame"))], own)
        for name, fidelity, own in zip(names, whole["fidelity"].values, places, strict=True)
        if fidelity == "frame" and name.removesuffix("-frame") in names
    ]


def _apart(full: xr.Dataset, frame: xr.Dataset) -> np.ndarray:
    """In what cells differ, in words."""
    found = np.full(full.sizes["cell"], AGREE, dtype=object)
    for name in reversed(JUDGED):
        one, two = (cells[name].values for cells in (full, frame))
        bars = full[f"{name}_error"].values + frame[f"{name}_error"].values
        found[differ(name, np.abs(one - two), bars)] = name
    same = (full["status"] == frame["status"]).values
    sound = same & (full["status"] == Status.OK).values
    found[sound & (full["cause"] != frame["cause"]).values] = "outcome"
    found[~same] = "status"
    return found


def engines_text(whole: xr.Dataset) -> list[str]:
    """What a map tells of the engines, in Markdown; nothing if it is of one engine."""
    if ENGINES not in whole:
        return []
    rows, count, barred = [], 0, 0
    for full, frame in _pairs(whole):
        one, two = whole.isel(cell=full), whole.isel(cell=frame)
        count += len(full)
        stated = [one[f"{n}_error"].notnull() & two[f"{n}_error"].notnull() for n in JUDGED]
        barred += int(np.any([each.values for each in stated], axis=0).sum())
        title = str(whole["title"].values[int(one["of_group"][0])])
        for k, word in enumerate(one[ENGINES].values.tolist()):
            if word != AGREE:
                place = f"{float(one['x'][k]):g}, {float(one['y'][k]):g}"
                ends = (_told(cells.isel(cell=k), word) for cells in (one, two))
                rows.append([title, place, word.replace("_", " "), *ends])
    text = (
        f"Both engines ran {counted(count, 'cell')}. In {len(rows)} of them they differ: in how "
        f"the run ended, or in a value by more than both error bars together, which {barred} "
        "cells have."
    )
    head = ["panel", "x, y", "differs in", "full", "frame"]
    table = [markdown_table(head, rows)] if rows else []
    return ["## Where the engines differ", text, *table]


def _told(cell: xr.Dataset, word: str) -> str:
    """How a cell ended, or its value with the error bar."""
    if word in JUDGED:
        return f"{cell[word].item():.6g} ± {cell[f'{word}_error'].item():.2g}"
    status = Status(int(cell["status"])).word
    reason = _shortened(cell["reason"].item(), _LONGEST_OF_BOTH)
    return f"{status}, {cell['cause'].item() or 'goal'}: {reason}"


def _shortened(reason: str, most: int) -> str:
    """The first clause of a reason, and as many further ones as there is room for."""
    first, *others = reason.split("; ")
    told = textwrap.shorten(first, most, placeholder=" ...")
    for clause in others:
        if len(told) + len(clause) > most:
            break
        told += f"; {clause}"
    return told


# The stability map: how each cell (one run) ended, why, and whether "ok" was true.
#
# A cell is "ok" if it ended well with its errors within their tolerances, "ended" if its status and
# reason name a cause, and "wrong" if it says ok and is not, or fails without a cause.


OK, ENDED, WRONG = "ok", "ended", "wrong"
_NAMELESS = {Cause.NONE, Cause.EXCEPTION, Cause.CRASH, Cause.UNFIT}
"""Ends for which ringsim itself is to blame, and none at all: the status says what there is."""
_WORDS = {Cause.NEWTON: "Newton", Cause.BLOW_UP: "blow-up", Cause.NOT_FINITE: "blow-up"}
"""Words for causes where their names are not."""

PROMISES = {"time_difference": 0.01, "angle_difference": 0.5, "tension_difference": 0.05}
"""What an ok cell promises: relative error of the deployment time, error in degree of the mean
angle where a run ended before, and error of the largest tension over itself; by the name of what a
finer run shows of it."""
MORE_STEPS = 1.5
"""Steps of a finer run over those of the cell, at least; Newton may have cut both to the same."""
ENERGY_PROMISE = Solver().energy_tolerance
"""Largest energy error of an ok cell."""
_LONGEST_REASON = 300
"""Characters of an example's reason that are shown."""

_SCALARS = (
    "energy_error", "constraint_error", "restarts", "steps", "cpu_time", "deployment_time",
    "final_time", "peak_tension", "asynchrony_max", *(f"{name}_error" for name in JUDGED),
)  # fmt: skip
_MEANING = {name: (VARIABLES[name].units, VARIABLES[name].long_name) for name in _SCALARS} | {
    "status": ("1", VARIABLES["status"].long_name),
    "x": ("1", "value on the first axis, in the units of the cell's panel"),
    "y": ("1", "value on the second axis, in the units of the cell's panel"),
    "of_group": ("1", "number of the cell's panel"),
    "reason": ("", "why the run ended so"),
    "cause": ("", "the cause in a word"),
    "verdict": ("", "ok, ended with a cause, or wrong"),
    "check": ("", "whether a run with finer steps agreed within the tolerance of ok"),
    "final_angle": ("degree", "mean opening angle at the last output time"),
    "time_difference": ("1", "relative change of the deployment time in a run with finer steps"),
    "angle_difference": ("degree", "change of the mean opening angle in a run with finer steps"),
    "tension_difference": ("1", "relative change of the largest tension in a run with finer steps"),
}
"""Unit and meaning by variable; words have no unit."""


def word_of(cause: Cause) -> str:
    """What a map calls a cause: "energy grew"; empty if it is none."""
    return "" if cause in _NAMELESS else _WORDS.get(cause, cause.words)


def _word(status: int, cause: int, fate: int) -> str:
    """Why a cell ended before its goal; empty if it did not."""
    if status == Status.OK:
        return "" if fate in GOALS else Fate(fate).words
    return word_of(Cause(cause)) or Status(status).word


def cells_of(campaign: xr.Dataset, x: Sequence[float], y: Sequence[float]) -> xr.Dataset:
    """The cells of a merged campaign, given the values of the two axes for each of its samples.

    Over ``cell``: ``x``, ``y``, ``status`` (code), ``reason``, ``cause``, ``final_angle`` (mean
    opening angle at the last output time that was reached, degree) and the run's numbers.
    """
    unknown = np.full(campaign.sizes["sample"], np.nan)
    status = campaign["status"].values.astype(int)
    causes = [
        _word(*codes)
        for codes in zip(
            status, *(campaign[n].values.astype(int) for n in ("cause", "outcome")), strict=True
        )
    ]
    found = {
        "x": np.array(x, dtype=float), "y": np.array(y, dtype=float), "status": status,
        "reason": campaign["reason"].values.astype(str).astype(object),
        "cause": np.array(causes), "final_angle": unknown,
    }  # fmt: skip
    if "opening_angle" in campaign:
        angle = campaign["opening_angle"]
        mean = angle.mean([d for d in angle.dims if d not in ("sample", "time")], skipna=False)
        found["final_angle"] = held(mean).isel(time=-1).values
    for name in _SCALARS:
        values = campaign[name].values if name in campaign else unknown
        missing = (values.dtype.kind == "i") & (values < 0)  # counts that are missing are -1
        found[name] = np.where(missing, np.nan, values.astype(float))
    return xr.Dataset({name: ("cell", values) for name, values in found.items()})


def judged(cells: xr.Dataset) -> xr.Dataset:
    """Add the ``verdict`` of every cell, and what each variable means.

    A cell that ended before its goal is "ended", sound as its motion may be.  One that is ok with
    an energy error over its tolerance, or whose check (see :func:`checked`) failed, is "wrong".
    """
    status = cells["status"].values
    good = cells["cause"].values == ""
    nameless = [Status(code).word for code in status] == cells["cause"].values
    crashed = np.isin(status, (Status.ERROR, Status.CRASHED)) & (cells["cause"] != "refused").values
    wrong = (~good & nameless) | crashed | (good & (cells["energy_error"] > ENERGY_PROMISE).values)
    if "check" in cells:
        wrong |= (cells["check"] == "differs").values
    found = cells.assign(verdict=("cell", np.where(wrong, WRONG, np.where(good, OK, ENDED))))
    for name, (units, long_name) in _MEANING.items():
        if name in found:
            found[name].attrs |= {"long_name": long_name} | ({"units": units} if units else {})
    return found


def chosen_for_check(cells: xr.Dataset, share: float, seed: int) -> NDArray[np.int64]:
    """A random share (0..1) of the ok cells, at least one, to run again with smaller steps."""
    good = np.flatnonzero((cells["verdict"] == OK).values)
    count = min(len(good), max(1, round(share * len(good))))
    picked = np.random.default_rng(seed).choice(good, count, replace=False)
    return np.sort(picked).astype(np.int64)


def checked(cells: xr.Dataset, which: NDArray[np.int64], finer: xr.Dataset) -> xr.Dataset:
    """Compare cells, those with the numbers ``which``, with what they gave with smaller steps.

    Returns the map with the differences of those cells (see ``PROMISES``), and ``check``: "" (not
    checked), "holds", "differs", or "unproven" where the finer run did not end or was hardly finer.
    """
    mine = cells.isel(cell=which)
    time, angle, tension = (
        abs(mine[name] - finer[name]) for name in ("deployment_time", "final_angle", "peak_tension")
    )
    differences = (
        time / abs(finer["deployment_time"]),
        angle.where(finer["deployment_time"].isnull()),
        tension / abs(finer["peak_tension"]),
    )
    found, over = cells.copy(), np.zeros(len(which), dtype=bool)
    for (name, promise), difference in zip(PROMISES.items(), differences, strict=True):
        found[name] = ("cell", np.full(cells.sizes["cell"], np.nan))
        found[name].values[which] = difference
        over |= (difference > promise).values
    hardly = (finer["steps"].values < MORE_STEPS * mine["steps"].values) & ~over
    unproven = (finer["status"] != Status.OK).values | hardly
    check = np.full(cells.sizes["cell"], "", dtype="U8")
    check[which] = np.where(unproven, "unproven", np.where(over, "differs", "holds"))
    return judged(found.assign(check=("cell", check)))


def joined(groups: Sequence[tuple[dict[str, str], xr.Dataset]]) -> xr.Dataset:
    """One map of all panels, with the dimensions ``group`` (a panel) and ``cell``, judged.

    A panel has its words (``name``, ``title``, ``x_label``, ``x_units``, ``y_label``, ``y_units``)
    and its cells; ``of_group`` is the number of each cell's panel.
    """
    whole = xr.concat([cells for _, cells in groups], dim="cell")
    whole["of_group"] = ("cell", np.repeat(range(len(groups)), [len(c.x) for _, c in groups]))
    for key in groups[0][0]:
        whole[key] = ("group", np.array([words[key] for words, _ in groups], dtype=object))
    return judged(whole)


def to_markdown(whole: xr.Dataset) -> str:
    """A judged map as a Markdown text."""
    head = ["panel", "axis", "all cells ok", "any cell ok", "below", "above"]
    parts = ["# Stability map", summary(whole), *(_checks(whole) if "check" in whole else ())]
    parts += ["![How each cell ended](stability.png)", *engines_text(whole)]
    parts += ["## Borders", markdown_table(head, borders(whole))]
    if (whole["verdict"] != OK).any():
        parts += ["## Where ok ends", _causes(whole)]
    if suspects := np.flatnonzero(whole["verdict"] == WRONG).tolist():
        parts += ["## Wrong cells", "\n".join(_cell(whole, k) for k in suspects)]
    return "\n\n".join(parts) + "\n"


def summary(whole: xr.Dataset) -> str:
    """The counts in one line."""
    verdict = whole["verdict"].values
    words, counts = np.unique(verdict, return_counts=True)
    ends = ", ".join(f"{count} {word}" for count, word in zip(counts, words, strict=True))
    anew = int(np.sum((whole["restarts"].values > 0) & (verdict == OK)))
    minutes = float(whole["cpu_time"].sum()) / 60.0
    panels = counted(whole.sizes["group"], "panel")
    return (
        f"{counted(len(verdict), 'cell')} in {panels}: {ends}; {anew} of the ok cells after a "
        f"restart with smaller steps; {minutes:.1f} minutes of processor time"
    )


def _checks(whole: xr.Dataset) -> list[str]:
    count = Counter(whole["check"].values.tolist())
    time, angle, tension = PROMISES.values()
    cells = counted(count.total() - count[""], "random ok cell")
    text = (
        f"{cells} {'was' if cells.startswith('1 ') else 'were'} run again with a quarter of the "
        f"step and a sixteenth of the tolerance: {count['holds']} agreed within the tolerance "
        f"({100 * time:g} % of the deployment time, {angle:g} deg of the mean angle in runs that "
        f"ended earlier, {100 * tension:g} % of the largest tension), {count['differs']} did "
        f"not, {count['unproven']} could not be decided, because the finer run was not completed "
        "or hardly finer. Latch rates, lock impulses and base loads, which steps at locks decide, "
        "are not compared: runs say themselves where these may be off."
    )
    words = ("- deployment time", "%"), ("- mean angle", "deg"), ("- largest tension", "%")
    lines = []
    for name, (label, unit) in zip(PROMISES, words, strict=True):
        values = whole[name].dropna("cell").values * (100.0 if unit == "%" else 1.0)
        if len(values):
            median, most = (f"{size:.2g} {unit}" for size in (np.median(values), values.max()))
            lines.append(
                f"{label}: {median} in the median, {most} at most ({counted(len(values), 'cell')})"
            )
    return [text, *(["\n".join(lines)] if lines else [])]


def borders(whole: xr.Dataset) -> list[list[str]]:
    """Between which values of each axis runs are ok, as rows of words.

    Title, axis, the longest range of values at which all cells are ok, the range of those at which
    any cell is, and the commonest causes just below and above the first range.
    """
    rows = []
    for number in range(whole.sizes["group"]):
        group = whole.isel(group=number, cell=(whole["of_group"] == number).values)
        good = (group["verdict"] == OK).values
        for axis in ("x", "y"):
            values = np.unique(group[axis].values)
            columns = [group[axis].values == value for value in values]
            runs = itertools.groupby(range(len(values)), key=lambda k: good[columns[k]].all())
            longest = max((list(run) for all_ok, run in runs if all_ok), key=len, default=[])
            beyond = ["-", "-"]
            for side, k in enumerate((longest[0] - 1, longest[-1] + 1) if longest else ()):
                if 0 <= k < len(values):
                    causes = group["cause"].values[columns[k] & ~good].astype(str).tolist()
                    beyond[side] = Counter(sorted(causes)).most_common(1)[0][0] or WRONG
            some = [k for k, column in enumerate(columns) if good[column].any()]
            ranges = [
                f"{values[r[0]]:g} .. {values[r[-1]]:g}" if r else "none" for r in (longest, some)
            ]
            rows.append([str(group["title"].values), axis_label(group, axis), *ranges, *beyond])
    return rows


def axis_label(group: xr.Dataset, axis: str) -> str:
    """What stands on an axis ("x" or "y") of one panel, with its unit."""
    label, units = (str(group[f"{axis}_{word}"].values) for word in ("label", "units"))
    return unit_behind(label, units)


def _causes(whole: xr.Dataset) -> str:
    """Each cause with its number of cells and one reason as it was given."""
    others = whole.isel(cell=(whole["verdict"] != OK).values)
    causes, reasons = (others[name].values.astype(str) for name in ("cause", "reason"))
    words, first, counts = np.unique(causes, return_index=True, return_counts=True)
    rows = []
    for k in np.argsort(-counts, kind="stable").tolist():
        # What is wrong though its run says nothing: by how much a finer run has another number.
        apart = "" if words[k] else _differences(others.isel(cell=int(first[k])))
        told = f"from a finer run: {apart}" if apart else reasons[first[k]]
        rows.append([words[k] or WRONG, counts[k], _shortened(told, _LONGEST_REASON)])
    return markdown_table(["cause", "cells", "for example"], rows)


def _differences(cell: xr.Dataset) -> str:
    """By how much a cell differs from a finer run, where that is more than is allowed."""
    told = []
    for name, allowed in PROMISES.items():
        apart = float(cell[name]) if name in cell else np.nan
        if apart > allowed:
            factor, unit = (1.0, "deg") if name == "angle_difference" else (100.0, "%")
            ends = f"{factor * apart:.2g} {unit} (allowed {factor * allowed:g} {unit})"
            told.append(f"{name.partition('_')[0]} differs by {ends}")
    return ", ".join(told)


def _cell(whole: xr.Dataset, number: int) -> str:
    cell = whole.isel(cell=number, group=int(whole["of_group"][number]))
    differences = _differences(cell)
    return (
        f"- {cell['name'].values}: {cell['x_label'].values} = {float(cell['x']):g}, "
        f"{cell['y_label'].values} = {float(cell['y']):g}: {cell['reason'].values} "
        f"({differences or 'no cause given'})"
    )
