"""Running a stability map: each panel as ordinary campaigns, then the check of a share."""

import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import xarray as xr

from ringsim.analysis.stability import cells_of, checked, chosen_for_check, compared, joined
from ringsim.campaign.panels import Panel
from ringsim.campaign.run import run_cases
from ringsim.parts.solver import MOST_STEPS
from ringsim.scene import Scene

TIMEOUT = 600.0
"""Longest time of a cell, s."""
_PATIENCE = 4.0
"""Times longer that a cell may take in its check."""


@dataclass(frozen=True)
class _Piece:
    """Cells that one campaign runs: values of both axes, and what a cell changes in the scene."""

    name: str
    panel: Panel
    scene: Scene
    cells: list[tuple[float, float, dict[str, float]]]


def run_map(folder: Path, panels: Sequence[Panel], workers: int) -> xr.Dataset:
    """Run all cells that are still missing, each panel in a folder of its own.

    Returns the judged map (``ringsim.analysis.stability.joined``), in which panels of both engines
    are compared (``ringsim.analysis.stability``).  InputError if a scene refuses a
    value, KeyboardInterrupt if a signal stopped it: the same call goes on.
    """
    found = []
    for panel in panels:
        words = {
            "name": panel.name, "title": panel.title, "x_label": panel.x.label,
            "x_units": panel.x.units, "y_label": panel.y.label, "y_units": panel.y.units,
            "fidelity": panel.fidelity,
        }  # fmt: skip
        parts = [_run(folder, piece, workers) for piece in _pieces(panel)]
        found.append((words, xr.concat(parts, dim="cell")))
    return compared(joined(found))


def run_check(
    folder: Path, panels: Sequence[Panel], whole: xr.Dataset, *, share: float, seed: int,
    workers: int,
) -> xr.Dataset:  # fmt: skip
    """Run a random ``share`` of the ok cells of a map again, compare, and judge again.

    The largest step is a quarter, the tolerance a sixteenth of those of the last attempt;
    constant steps are a quarter of those that Newton let the cell take.
    """
    which = chosen_for_check(whole, share, seed)
    restarts, taken = whole["restarts"].values, (whole["final_time"] / whole["steps"]).values
    finer, numbers = [], itertools.count()
    for piece in (piece for panel in panels for piece in _pieces(panel)):
        numbered = dict(zip(itertools.islice(numbers, len(piece.cells)), piece.cells, strict=True))
        if mine := [k for k in numbered if k in which]:
            own = [numbered[k] for k in mine]
            how = [(1 + int(restarts[k]), float(taken[k])) for k in mine]
            # Another choice of cells is another campaign.
            mark = hashlib.sha256(repr(([cell[:2] for cell in own], how)).encode()).hexdigest()[:6]
            scene = piece.scene.with_values({"solver.error_bars": False})  # nobody asks for them
            again = replace(piece, name=f"{piece.name}-check-{mark}", scene=scene, cells=own)
            finer.append(_run(folder, again, workers, finer=how))
    return checked(whole, which, xr.concat(finer, dim="cell")) if finer else whole


def _pieces(panel: Panel) -> list[_Piece]:
    """The campaigns of a panel; an axis that shapes the result needs one for each value."""
    shaping = [sweep.shapes(panel.scene) for sweep in (panel.x, panel.y)]
    found: dict[str, _Piece] = {}
    for cell in panel.cells():
        name, shared, own = panel.name, dict[str, float](), dict[str, float]()
        for shapes, sweep, value in zip(shaping, (panel.x, panel.y), cell, strict=True):
            (shared if shapes else own).update(sweep.at(value))
            name += f"-{value}".replace("+", "") if shapes else ""
        if name not in found:
            found[name] = _Piece(name, panel, panel.scene.with_values(shared), [])
        found[name].cells.append((*cell, own))
    return list(found.values())


def _run(
    folder: Path, piece: _Piece, workers: int, finer: Sequence[tuple[int, float]] = ()
) -> xr.Dataset:
    """The cells of a piece; in a check refined so often, from a mean step in s, and more time."""
    rows = []
    for number, (_, _, row) in enumerate(piece.cells):
        solver = piece.scene.with_values(row).solver
        changes: dict[str, float] = {}
        if finer:
            times, taken = finer[number]
            fine = solver.refined(times)
            constant = solver.step_control == "constant"
            changes = {
                "solver.step": min(fine.step, 0.25 * taken) if constant else fine.step,
                "solver.tolerance": fine.tolerance,
                "solver.step_limit": min(10 * solver.step_limit, MOST_STEPS),
            }
            if piece.scene.record.stress:
                changes["solver.deviation_tolerance"] = fine.deviation_tolerance
        rows.append(row | changes or {"solver.step": solver.step})  # a campaign varies something
    title, timeout = f"Stability map: {piece.panel.title}", TIMEOUT * (_PATIENCE if finer else 1.0)
    file = run_cases(
        folder / piece.panel.name, piece.name, piece.scene, rows, workers=workers, title=title,
        timeout=timeout, fidelity=piece.panel.fidelity,
    )  # fmt: skip
    x, y, _ = zip(*piece.cells, strict=True)
    with xr.open_dataset(file) as campaign:
        return cells_of(campaign, x, y)
