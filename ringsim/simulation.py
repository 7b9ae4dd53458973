"""One simulation: scene in, outcome or dataset out.  Failures are values, not exceptions.

Two fidelities answer the same questions: the full multibody model (``run``), and the ideal ring
of rigid rods (``run_ideal``), which knows neither asynchrony nor stress and costs a fraction.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ringsim.engine.solve import SOLVERS
from ringsim.parts.solver import Solver
from ringsim.scene import Scene
from ringsim.theory.error_bars import OF_FINER, error_bars
from ringsim.theory.faded_friction import with_remark
from ringsim.theory.ideal_fidelity import run_ideal
from ringsim.variables import COUNTS, TIMINGS, Fidelity, Outcome, Status

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIDELITIES", "run", "run_ideal", "simulate"]


def run(scene: Scene) -> Outcome:
    """Build and integrate a scene.

    Parameters
    ----------
    scene
        What to simulate.  A run that fails or diverges starts anew with smaller steps, at most
        ``solver.restarts`` times.

    Returns
    -------
    Outcome
        Arrays on the scene's output grid, of the last start; ``restarts`` says how many there
        were, ``step_used`` and ``tolerance_used`` with which settings the last one ran.  Times and
        the counts ``total_steps``, ... are those of all starts.  A solve that fails or does not
        reach its goal has a status other than OK and the reason; it never raises.  With
        ``solver.error_bars`` it holds the error bars of its main numbers, and the times (not the
        counts) of both runs.
    """
    begin = (time.perf_counter(), time.process_time())
    outcome, first, restarts = _attempt(scene, begin), "", 0
    counts = [_counts(outcome)]
    while restarts < scene.solver.restarts and _curable(outcome, scene):
        restarts += 1
        first = first or outcome.reason
        finer = scene.solver.refined(restarts)
        outcome = _attempt(scene.model_copy(update={"solver": finer}), begin)
        counts.append(_counts(outcome))
        how = f"start {restarts + 1} with solver.step = {finer.step:.3g} s"
        if finer.step_control != "constant":
            how += f" and solver.tolerance = {finer.tolerance:.2g}"
        outcome = replace(outcome, reason=f"{outcome.reason} ({how}; start 1: {first})")
    if scene.solver.error_bars and outcome.status == Status.OK:
        outcome = _with_bars(outcome, scene, scene.solver.refined(restarts), begin)
    outcome.values["fidelity"] = np.array(int(Fidelity.FULL))
    outcome.values["restarts"] = np.array(restarts)
    used = scene.solver.refined(restarts)
    outcome.values["step_used"] = np.array(used.step)
    follows = used.step_control == "motion"
    outcome.values["tolerance_used"] = np.array(used.tolerance if follows else np.nan)
    for name in COUNTS:
        outcome.values[f"total_{name}"] = np.array(sum(each[name] for each in counts))
    return with_remark(outcome, scene)


def _with_bars(
    outcome: Outcome, scene: Scene, solver: Solver, begin: tuple[float, float]
) -> Outcome:
    """The outcome of a run at these settings with its error bars, or why it has none."""
    reasons = []
    for words, other, scale in (
        ("twice as long", solver.coarsened(), 1.0),
        ("half as long", solver.halved(), OF_FINER),
    ):
        found = _attempt(scene.model_copy(update={"solver": other}), begin)
        outcome.values.update(
            {name: found.values[name] for name in TIMINGS if name in found.values}
        )
        bars = error_bars(outcome, found, scene.rods.elements, solver.tolerance, scale)
        if bars:
            outcome.values.update(bars)
            return outcome
        reasons.append(f"with steps {words} it ended as {found.status.word}: {found.reason}")
    return replace(outcome, reason=f"{outcome.reason}; no error bars, since {'; '.join(reasons)}")


def _counts(outcome: Outcome) -> dict[str, int]:
    """What one start of a run took; 0 where it ended too early to tell."""
    return {name: int(outcome.values.get(name, np.array(0))) for name in COUNTS}


def _attempt(scene: Scene, begin: tuple[float, float]) -> Outcome:
    """One start of a run; times count from ``begin`` (s, elapsed and of the processor)."""
    wall, cpu = begin
    try:
        finish = SOLVERS[type(scene.structure)](scene)
        return finish(wall_time=time.perf_counter() - wall, cpu_time=time.process_time() - cpu)
    except Exception as error:  # whatever broke, a campaign goes on and the user learns of it
        traceback.print_exc()  # a campaign keeps it in the sample's log
        return Outcome(Status.ERROR, f"{type(error).__name__}: {error}")


def _curable(outcome: Outcome, scene: Scene) -> bool:
    """Whether smaller steps may help: not where there were too many of them already."""
    if outcome.status not in (Status.SOLVER_FAILED, Status.DIVERGED):
        return False
    return int(outcome.values.get("steps", np.array(0))) < scene.solver.step_limit


FIDELITIES: dict[str, Callable[[Scene], Outcome]] = {"full": run, "ideal": run_ideal}
"""What answers a scene, by the word that chooses it."""


def simulate(scene: Scene, fidelity: str = "full") -> xr.Dataset:
    """Run a scene and return its dataset (see ``ringsim.dataset.to_dataset``).

    Raises
    ------
    InputError
        If the ideal ring cannot represent the scene.

    Examples
    --------
    >>> from ringsim.scene import load_scene
    >>> scene = load_scene("truss2").with_values({"solver.end_time": 0.5})
    >>> run = simulate(scene)
    >>> run.attrs["reason"]
    'solver.end_time = 0.5 s was reached with 0 of 4 V-joints locked'
    >>> dict(run["opening_angle"].sizes)
    {'plane': 2, 'section': 2, 'time': 6}
    >>> bool(run["energy_error"] < 1e-3)
    True
    """
    from ringsim.dataset import to_dataset

    return to_dataset(FIDELITIES[fidelity](scene), scene)
