"""Running the stability map: each group as ordinary campaigns, then the check of a share."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim.analysis.stability import cells_of, checked, chosen_for_check, joined
from ringsim.campaign.cases import Cases, run_cases
from ringsim.campaign.stability_groups import Axis, Group
from ringsim.scene import Scene, load_scene

TIMEOUT = 600.0
"""Longest time of a cell, s."""
_PATIENCE = 4.0
"""Times longer that a cell may take in its check."""


@dataclass(frozen=True)
class _Piece:
    """Cells that one campaign runs: its name, its scene, and the values of the axes."""

    name: str
    group: Group
    scene: Scene
    cells: list[tuple[float, float]]


def run_map(folder: Path, groups: Sequence[Group], workers: int) -> xr.Dataset:
    """Run all cells that are still missing.

    Parameters
    ----------
    folder
        Each group has a folder of its own in it.
    groups
        What to run.
    workers
        Solver processes.

    Returns
    -------
    xr.Dataset
        The judged map (``ringsim.analysis.stability.joined``).

    Raises
    ------
    InputError
        If a scene refuses a value.
    KeyboardInterrupt
        If a signal stopped it; the same call goes on.
    """
    found = []
    for group in groups:
        parts = [_run(folder, piece, workers) for piece in _pieces(group)]
        found.append((_words(group), xr.concat(parts, dim="cell")))
    return joined(found)


def run_check(
    folder: Path, groups: Sequence[Group], whole: xr.Dataset, *, share: float, seed: int,
    workers: int,
) -> xr.Dataset:  # fmt: skip
    """Run a random share of the ok cells again with smaller steps, and compare.

    The largest step is a quarter, the tolerance a sixteenth of those of the start that counts;
    constant steps are a quarter of those that Newton let the cell take.

    Parameters
    ----------
    folder, groups, workers
        As for :func:`run_map`.
    whole
        What that gave.
    share, seed
        See ``ringsim.analysis.stability.chosen_for_check``.

    Returns
    -------
    xr.Dataset
        The map, judged again.
    """
    which = chosen_for_check(whole, share, seed)
    if not len(which):
        return whole
    pieces = [piece for group in groups for piece in _pieces(group)]
    ends = np.cumsum([len(piece.cells) for piece in pieces])
    owner = np.searchsorted(ends, which, side="right")
    finer = []
    for number in np.unique(owner):
        piece, mine = pieces[number], which[owner == number]
        begin = int(ends[number]) - len(piece.cells)
        own = [piece.cells[cell - begin] for cell in mine]
        starts = 1 + whole["restarts"].values[mine].astype(int)
        taken = (whole["final_time"] / whole["steps"]).values[mine]
        how = list(zip(starts.tolist(), taken.tolist(), strict=True))
        # Another choice of cells is another campaign.
        mark = hashlib.sha256(repr((own, how)).encode()).hexdigest()[:6]
        again = _Piece(f"{piece.name}-check-{mark}", piece.group, piece.scene, own)
        finer.append(_run(folder, again, workers, finer=how))
    return checked(whole, which, xr.concat(finer, dim="cell"))


def _pieces(group: Group) -> Iterator[_Piece]:
    """The campaigns of a group; an axis that shapes the result needs one for each value."""
    base = load_scene(group.scene)
    if not group.x.apart:
        cells = list(itertools.product(group.x.values, group.y.values))
        yield _Piece(group.name, group, base.with_values(dict(group.settings)), cells)
        return
    for x in group.x.values:
        scene = base.with_values({**group.settings, **_values(group.x, x)})
        cells = [(x, y) for y in group.y.values]
        yield _Piece(f"{group.name}-{x:g}", group, scene, cells)


def _run(
    folder: Path, piece: _Piece, workers: int, finer: Sequence[tuple[int, float]] = ()
) -> xr.Dataset:
    """The cells of a piece; refined as often as ``finer`` says, and with more time then.

    It also holds the mean step in s that each cell took; constant ones are no longer than a
    quarter of that.
    """
    rows = []
    for number, (x, y) in enumerate(piece.cells):
        row = _values(piece.group.y, y)
        if not piece.group.x.apart:
            row = _values(piece.group.x, x) | row
        if finer:
            solver = piece.scene.with_values(row).solver
            times, taken = finer[number]
            fine = solver.refined(times)
            constant = solver.step_control == "constant"
            row |= {
                "solver.step": min(fine.step, 0.25 * taken) if constant else fine.step,
                "solver.tolerance": fine.tolerance,
                "solver.step_limit": 10 * solver.step_limit,
            }
        rows.append(row)
    cases = Cases(
        name=piece.name,
        title=f"Stability map: {piece.group.title}",
        scene=piece.scene,
        cases=rows,
        timeout=TIMEOUT * (_PATIENCE if finer else 1.0),
    )
    path = run_cases(folder / piece.group.name, cases, workers)
    columns = np.array(piece.cells)
    with xr.open_dataset(path) as campaign:
        return cells_of(campaign, columns[:, 0].tolist(), columns[:, 1].tolist())


def _values(axis: Axis, value: float) -> dict[str, Any]:
    whole = axis.apart and float(value).is_integer()
    return dict.fromkeys(axis.paths, int(value) if whole else value)


def _words(group: Group) -> dict[str, str]:
    words = {"name": group.name, "title": group.title}
    for name, axis in (("x", group.x), ("y", group.y)):
        words |= {f"{name}_label": axis.label, f"{name}_units": axis.units}
    return words
