"""Running the studies of a scene, as campaigns like any other: the ladder of an accuracy study, and
stability maps, each panel as campaigns, then the check of a share.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from ringsim.analysis.accuracy import NEEDED, Truth, judge
from ringsim.analysis.ladder import (
    FRAME,
    PATHS,
    Rung,
    by_frames,
    frames_alone,
    ladder,
    left_out,
    references,
    shortened,
)
from ringsim.analysis.stability import cells_of, checked, chosen_for_check, compared, joined
from ringsim.cable.records import CABLES
from ringsim.campaign.run import run_cases
from ringsim.choice import kinds_of
from ringsim.overrides import field_at
from ringsim.parts.rods import Rods
from ringsim.parts.solver import MOST_STEPS
from ringsim.refusal import InputError
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.sampling.table import refuse_fixed
from ringsim.scene import Scene
from ringsim.simulation import why_not_frame
from ringsim.units import unit_at
from ringsim.variables import GOALS, Fate, Status

# What a stability map varies: panels of two axes, on a user's scene.
#
# ``PATH=LOW..HIGH`` is an axis, ``cables.*.axial_stiffness`` that of all cables.  Where no axes are
# given, panels are chosen from what the scene holds, around its own values.


_DECADE = 10.0
"""HIGH over LOW from which on values are spaced geometrically."""
_DEFAULTS = (
    (("cables.*.axial_stiffness", "net.stiffness", "net.axial_stiffness"),
     ("cables.*.friction.coefficient", "joints.vjoint.viscous", "structure.spring.damping")),
    (("rods.damping",), ("solver.step",)),
    (("cables.*.winch.winding.speed", "loads.force"),
     ("stop.stiffness", "structure.rest.stiffness")),
)  # fmt: skip
"""Panels where none are asked for: for each axis the first path at which the scene has a number
other than zero.  A panel without one of its axes is left out."""
_FACTOR, _STEP_FACTOR = 10.0, 5.0
"""Ends of a default axis over the scene's own value, and below it; less for solver.step, because
the cost of a run grows with 1 / step."""
_SPREADS = (1.0, 0.3)
"""Exponents on that factor, tried in turn: a bound of the field may be near."""


@dataclass(frozen=True)
class Sweep:
    """One axis of a panel: values in rising order that all ``paths`` of a scene get."""

    label: str
    units: str
    paths: tuple[str, ...]
    values: tuple[float, ...]

    def at(self, value: float) -> dict[str, float]:
        """A value by scene path."""
        return dict.fromkeys(self.paths, value)

    def shapes(self, scene: Scene) -> bool:
        """Whether the values change the shape of a result, so that each is a campaign."""
        try:
            for path in self.paths:
                refuse_fixed(scene, path)
        except InputError:
            return True
        return False


@dataclass(frozen=True)
class Panel:
    """All pairs of the values of two axes, on one scene, by an engine; ``name`` is that of its
    folder.
    """

    name: str
    title: str
    scene: Scene
    x: Sweep
    y: Sweep
    fidelity: str = "full"

    def cells(self) -> Iterator[tuple[float, float]]:
        """Values of both axes for each cell."""
        return itertools.product(self.x.values, self.y.values)


def by_engines(panels: Sequence[Panel], fidelity: str) -> list[Panel]:
    """Panels by the engine "full" or "frame", or by "both" side by side with their error bars.

    The full engine takes those that the frame engine cannot represent; InputError if it is to take
    all.
    """
    reasons = [why_not_frame(panel.scene) if fidelity != "full" else "" for panel in panels]
    if all(reasons):
        raise InputError(f"--fidelity {fidelity}: {reasons[0]}")
    found = []
    for panel, refused in zip(panels, reasons, strict=True):
        if fidelity == "full" or refused:
            found.append(panel)
            continue
        both = fidelity == "both"
        values = {"solver.error_bars": True} if both else {}  # by which cells are told apart
        own = replace(panel, scene=panel.scene.with_values(values))
        name, title = f"{panel.name}-frame", f"{panel.title}, frame engine"
        found += [own] if both else []
        found.append(replace(own, name=name, title=title, fidelity="frame"))
    return found


def panels_over(scene: Scene, over: Sequence[str], points: int) -> list[Panel]:
    """Panels for axes ``PATH=LOW..HIGH``, default ones if none; InputError if one is refused."""
    if len(over) % 2:
        raise InputError(
            f"--over {over[-1]}: a panel needs two axes: give one more --over PATH=LOW..HIGH, or "
            "leave this one out"
        )
    asked = [sweep_of(scene, text, points) for text in over]
    pairs = list(zip(asked[::2], asked[1::2], strict=True)) or [
        (x, y)
        for one, other in _DEFAULTS
        if (x := _around(scene, one, points)) and (y := _around(scene, other, points))
    ]
    if not pairs:
        raise InputError(
            f"--over is missing: {scene.name} has none of the default pairs of axes: give two "
            "--over PATH=LOW..HIGH"
        )
    found = []
    for number, (x, y) in enumerate(pairs, 1):
        if twice := set(x.paths) & set(y.paths):
            raise InputError(
                f"--over {x.label}, --over {y.label}: both axes of panel {number} vary "
                f"{min(twice)}: choose another path for one of them"
            )
        found.append(Panel(f"panel-{number}", f"panel {number}", scene, x, y))
        for one, other in found[-1].cells():
            try:
                scene.with_values(x.at(one) | y.at(other))
            except InputError as error:
                raise InputError(
                    f"--over {x.label} = {one:g} with --over {y.label} = {other:g}: {error}"
                ) from None
    return found


def sweep_of(scene: Scene, text: str, points: int) -> Sweep:
    """The axis ``PATH=LOW..HIGH``, geometric from a decade on; InputError if it is refused."""
    path, _, extent = (part.strip() for part in text.partition("="))
    try:
        low, high = (float(end) for end in extent.split(".."))
    except ValueError:
        raise InputError(
            f"--over {text}: must read PATH=LOW..HIGH with two numbers, for example "
            "solver.step=0.01..0.2"
        ) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(
            f"--over {text}: LOW = {low:g} must be below HIGH = {high:g}, and both finite: "
            "exchange them, or give other bounds"
        )
    try:
        return _sweep(scene, path, low, high, points)
    except InputError as error:
        raise InputError(f"--over {text}: {error}") from None


def _sweep(
    scene: Scene, path: str, low: float, high: float, points: int, ratio: float = _DECADE
) -> Sweep:
    """An axis; its values are equally far apart in their logarithm from a ``ratio`` of both ends
    on.
    """
    paths = _expanded(scene, path)
    least, most = sorted((abs(low), abs(high)))
    spaced = np.geomspace if low * high > 0.0 and most >= ratio * least else np.linspace
    values = spaced(low, high, points)
    values[1:-1] = [float(f"{value:.6g}") for value in values[1:-1]]
    if type(_own_value(scene, paths[0])) is int:
        if not (low.is_integer() and high.is_integer()):
            raise InputError(
                f"{path} takes whole numbers only: give LOW and HIGH without fractions"
            )
        values = np.unique(np.rint(values).astype(int))
    ends = [scene.with_values(dict.fromkeys(paths, end)) for end in values[[0, -1]].tolist()]
    return Sweep(path, unit_at(ends[0], paths[0]), paths, tuple(values.tolist()))


def _expanded(scene: Scene, path: str) -> tuple[str, ...]:
    """A path, or for ``cables.*.name`` one for each cable that the scene has."""
    head, star, tail = path.partition(".*.")
    if not star:
        return (path,)
    present = [name for name in CABLES if getattr(scene.cables, name, None) is not None]
    if head != "cables" or not present:
        raise InputError(f"* stands for every cable, and {scene.name} has none: name a path")
    return tuple(f"{head}.{name}.{tail}" for name in present)


def _own_value(scene: Scene, path: str) -> object:
    """What a scene has at a path; None if it does not have it."""
    try:
        return field_at(scene, path)
    except (AttributeError, IndexError):
        return None


def _around(scene: Scene, alternatives: Sequence[str], points: int) -> Sweep | None:
    """An axis around the scene's own value at the first of some paths that it has."""
    for path, spread in itertools.product(alternatives, _SPREADS):
        try:
            own = _own_value(scene, _expanded(scene, path)[0])
            if isinstance(own, float) and own != 0.0:  # loads that fold are negative
                factor = (_STEP_FACTOR if path == "solver.step" else _FACTOR) ** spread
                # Digits enough that the scene's own value is the one in the middle.
                low, high = sorted(float(f"{end:.6g}") for end in (own / factor, own * factor))
                return _sweep(scene, path, low, high, points, ratio=1.0)
        except InputError:
            continue
    return None


# The ladder of an accuracy study.


_STEP_LIMIT = 1_000_000
"""Steps of one rung: its time is limited instead."""


class ReferenceRunError(Exception):
    """A scene has no reference to compare with: its message names setting, reason and cure."""


def run_ladder(
    folder: Path, scene: Scene, workers: int, timeout: float, most_elements: int = 4,
    *, brief: bool = False, fidelity: str = "full",
) -> xr.Dataset:  # fmt: skip
    """Errors and cost of all settings of a scene's ladder (``judge``).

    A setting that fails is a failed rung: nothing starts anew with smaller steps here.  The
    cheapest run of the reference goes first, then the whole reference, then the rest, so that a
    scene which cannot be studied costs little.  The frame engine is a setting too, where it can
    represent the scene.  ``folder`` holds the campaigns, and a study that was interrupted goes on,
    also with rungs that took longer than ``timeout``, the longest time of one rung, s;
    ``most_elements`` (4 or 8) is how many times more than the scene's are tried; ``brief`` is for a
    quarter of the cost (``shortened``).  ``fidelity`` "frame" tries that engine alone, whose limit
    is then the reference.  What the study had to do without is in the attribute ``remarks``.
    InputError if the scene is refused, ReferenceRunError if too few runs for a reference end well.
    """
    plain = {"solver.restarts": 0, "solver.error_bars": False, "solver.step_limit": _STEP_LIMIT}
    scene = scene.with_values(plain)
    remarks = left_out(scene)
    late = frozenset({Status.TIMEOUT})
    study = _Study(scene, partial(run_cases, folder, workers=workers, timeout=timeout, again=late))
    why, rungs = why_not_frame(scene), ladder(scene, most_elements)
    if fidelity == FRAME:
        if why:
            raise InputError(f"--fidelity {FRAME}: {why}")
        rungs = frames_alone(rungs)
        remarks.append(
            "a study of the frame engine only: the reference is the limit of its own fine steps"
        )
    if brief:
        rungs = shortened(rungs)
        remarks.append(
            "a brief study: steps down to a quarter of the scene's, up to twice as many elements"
        )
    for rung in rungs:
        scene.with_values(dict(rung.values))  # refused before anything has run
    in_time, in_space = references(rungs, fidelity=fidelity)
    failed: dict[int, str] = {}
    for stage, places in (("first", in_time[:1]), ("reference", in_time + in_space)):
        own = [rungs[k] for k in places]
        found = study.run(stage, own)
        failed |= {places[k]: told for k, told in _failures(own, found).items()}
        _require_references(rungs, failed, fidelity)
    remarks += [f"{told}; other runs form the reference" for told in failed.values()]
    if why:
        remarks.append(f"without the frame engine: {why}")
    elif fidelity != FRAME:
        rungs += by_frames(rungs)
    results = study.run("settings", rungs)
    failed |= _failures(rungs, results)
    _require_references(rungs, failed, fidelity)
    judged = judge(results, rungs, truths_of(scene))
    return judged.assign_attrs(remarks="\n".join(f"- {each}" for each in remarks))


def _failures(rungs: Sequence[Rung], found: xr.Dataset) -> dict[int, str]:
    """How each of the runs ended that cannot be a reference, by its place."""
    told = {}
    ends = zip(*(found[name].values for name in ("status", "outcome", "reason")), strict=True)
    for k, (code, fate, reason) in enumerate(ends):
        if fate not in GOALS:
            word = (Fate(int(fate)) if code == Status.OK else Status(code)).word
            settings = ", ".join(f"{path} = {value}" for path, value in rungs[k].values.items())
            why = reason or "no reason given"
            told[k] = f"the reference run with {settings} ended as {word}: {why}"
    return told


def _require_references(rungs: Sequence[Rung], failed: dict[int, str], fidelity: str) -> None:
    """Raise ReferenceRunError if without the rungs that failed too few are left to compare with."""
    try:
        references(rungs, [k not in failed for k in range(len(rungs))], fidelity)
    except ValueError:
        raise ReferenceRunError(
            f"{next(iter(failed.values()))}: change the scene so that runs with fine steps are "
            "completed, or allow more time (--timeout)"
        ) from None


@dataclass
class _Study:
    """Runs settings in stages, each setting once."""

    scene: Scene
    cases: Callable[..., Path]
    """``run_cases`` for all but name, scene, cases, title and fidelity."""
    known: dict[tuple[object, ...], xr.Dataset] = field(default_factory=dict)

    def run(self, stage: str, rungs: Sequence[Rung]) -> xr.Dataset:
        """Results over the rungs, those that earlier stages ran among them."""
        shared = [path for path in self.scene.structure.shaping if path in PATHS]
        paths = [path for path in PATHS if path not in shared]
        keys = [(rung.fidelity, *(rung.values[path] for path in PATHS)) for rung in rungs]
        missing: dict[tuple[str, bool, str], dict[tuple[object, ...], Rung]] = {}
        for key, rung in zip(keys, rungs, strict=True):
            if key not in self.known:
                missing.setdefault(self._campaign(stage, rung), {})[key] = rung
        for (name, stress, fidelity), own in missing.items():
            given = {path: next(iter(own.values())).values[path] for path in shared}
            given |= {"record.stress": stress} | ({} if stress else {"limits.rod_stress": "none"})
            scene = self.scene.with_values(given)
            cases = [{path: rung.values[path] for path in paths} for rung in own.values()]
            title = f"Settings of {scene.name} against each other ({name})"
            found = _needed(self.cases(name, scene, cases, title=title, fidelity=fidelity))
            self.known |= {key: found.isel(rung=[k]) for k, key in enumerate(own)}
        return xr.concat([self.known[key] for key in keys], "rung")

    def _campaign(self, stage: str, rung: Rung) -> tuple[str, bool, str]:
        """Name, ``record.stress`` and fidelity of a rung's campaign: all in one have results of one
        shape.
        """
        if rung.fidelity == FRAME:
            return f"{stage}-{FRAME}", True, FRAME
        if self.scene.structure.gauge:  # a strain for each of its elements
            return f"{stage}-elements-{rung.values['rods.elements']}", False, rung.fidelity
        # Elements without an orientation report no forces.
        rods = kinds_of(Rods)[str(rung.values["rods.kind"])]
        stressed = issubclass(rods, Rods) and rods.oriented
        return stage if stressed else f"{stage}-unstressed", stressed, rung.fidelity


def _needed(file: Path) -> xr.Dataset:
    """What is compared of a campaign's results, missing variables as NaN."""
    with xr.open_dataset(file) as dataset:
        found = dataset.rename(sample="rung").drop_vars("rung")
        kept = found[[name for name in (*NEEDED, "reason") if name in found]].load()
    nothing = ("rung", np.full(kept.sizes["rung"], np.nan))
    return kept.assign({name: nothing for name in NEEDED if name not in kept})


def truths_of(scene: Scene) -> list[Truth]:
    """Deployment time of a ring that only position-dependent loads drive, without losses."""
    conservative = not scene.joints.present() and (scene.net is None or scene.net.lossless)
    if not scene.structure.locks or not scene.structure.closed:
        return []  # the quadrature keeps an arc's end assemblies upright, but they swing
    if not conservative or scene.cables is not None or scene.faults:
        return []
    if scene.loads is None or scene.loads.reversal_time is not None:
        return []
    try:
        found = opening_time(OneCoordinate(scene), scene.structure.coordinate)
    except ValueError:  # the loads do not open it
        return []
    return [Truth("deployment_time", "energy quadrature of the ideal ring", found.time)]


# Stability maps.


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
        parts = [_run(folder, piece, workers) for piece in pieces_of(panel)]
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
    for piece in (piece for panel in panels for piece in pieces_of(panel)):
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


def pieces_of(panel: Panel) -> list[_Piece]:
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
