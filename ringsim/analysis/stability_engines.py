"""Where the engines differ in a stability map: cells with another end, or with other values.

Values differ if they are further apart than both of their error bars together, which only cells
that reached their goal have.
"""

import numpy as np
import xarray as xr

from ringsim.tables import markdown_table
from ringsim.variables import Status

ENGINES = "engines"
"""Variable over ``cell``: in what a cell differs from that of the other engine."""
AGREE = "agree"
JUDGED = ("deployment_time", "asynchrony_max", "peak_tension")
"""Values with error bars that cells have."""
_LONGEST_REASON = 120


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
    about = {"long_name": "in what this cell differs from that of the other engine"}
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
        found[np.abs(one - two) > bars] = name
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
        f"Both engines ran {count} cells. In {len(rows)} of them they differ: in how the run "
        f"ended, or in a value by more than both error bars together, which {barred} cells have."
    )
    head = ["panel", "x, y", "differs in", "full", "frame"]
    table = [markdown_table(head, rows)] if rows else []
    return ["## Where the engines differ", text, *table]


def _told(cell: xr.Dataset, word: str) -> str:
    """How a cell ended, or its value with the error bar."""
    if word in JUDGED:
        return f"{cell[word].item():.6g} ± {cell[f'{word}_error'].item():.2g}"
    status = Status(int(cell["status"])).word
    return f"{status}, {cell['cause'].item() or 'goal'}: {cell['reason'].item()[:_LONGEST_REASON]}"
