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
from ringsim.scene import Scene
from ringsim.theory.error_bars import error_bars
from ringsim.theory.ideal_fidelity import run_ideal
from ringsim.variables import TIMINGS, Fidelity, Outcome, Status

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
        were, and its times count all of them.  A solve that fails or does not reach its goal has
        a status other than OK and the reason; it never raises.  With ``solver.error_bars`` it
        holds the error bars of its main numbers, and the times of both runs.
    """
    begin = (time.perf_counter(), time.process_time())
    outcome, first, restarts = _attempt(scene, begin), "", 0
    while restarts < scene.solver.restarts and _curable(outcome, scene):
        restarts += 1
        first = first or outcome.reason
        finer = scene.solver.refined(restarts)
        outcome = _attempt(scene.model_copy(update={"solver": finer}), begin)
        how = f"start {restarts + 1} with solver.step = {finer.step:.3g} s"
        if finer.step_control != "constant":
            how += f" and solver.tolerance = {finer.tolerance:.2g}"
        outcome = replace(outcome, reason=f"{outcome.reason} ({how}; start 1: {first})")
    if scene.solver.error_bars and outcome.status == Status.OK:
        longer = scene.solver.refined(restarts).coarsened()
        coarse = _attempt(scene.model_copy(update={"solver": longer}), begin)
        outcome.values.update(error_bars(outcome, coarse, scene.rods.elements))
        for name in TIMINGS:
            outcome.values[name] = coarse.values.get(name, outcome.values[name])
    outcome.values["fidelity"] = np.array(int(Fidelity.FULL))
    outcome.values["restarts"] = np.array(restarts)
    return outcome


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
    """
    from ringsim.dataset import to_dataset

    return to_dataset(FIDELITIES[fidelity](scene), scene)
