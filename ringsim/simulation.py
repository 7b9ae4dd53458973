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
from ringsim.outputs.effort import TIMINGS, counts_of, note_starts
from ringsim.outputs.error_bars import OF_FINER, error_bars
from ringsim.parts.solver import Solver
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.faded_friction import with_remark
from ringsim.theory.ideal_fidelity import run_ideal
from ringsim.variables import Cause, Fidelity, Outcome, Status

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
    used, first = scene.solver, _attempt(scene, begin)
    outcome, starts = first, [counts_of(first)]
    while len(starts) <= scene.solver.restarts and _curable(outcome, scene):
        used = scene.solver.refined(len(starts))
        outcome = _attempt(scene.model_copy(update={"solver": used}), begin)
        starts.append(counts_of(outcome))
        how = f"start {len(starts)} with solver.step = {used.step:.3g} s"
        if used.step_control != "constant":
            how += f" and solver.tolerance = {used.tolerance:.2g}"
        # A start that only ran out of its smaller steps does not say what is wrong.
        cause = first.cause if outcome.cause is Cause.STEP_LIMIT else outcome.cause
        reason = f"{outcome.reason} ({how}; start 1: {first.reason})"
        outcome = replace(outcome, reason=reason, cause=cause)
    if scene.solver.error_bars and outcome.status == Status.OK:
        outcome = _with_bars(outcome, scene, used, begin)
    note_starts(outcome, Fidelity.FULL, used, starts)
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


def _attempt(scene: Scene, begin: tuple[float, float]) -> Outcome:
    """One start of a run; times count from ``begin`` (s, elapsed and of the processor)."""
    try:
        outcome = SOLVERS[type(scene.structure)](scene)
    except Exception as error:  # whatever broke, a campaign goes on and the user learns of it
        traceback.print_exc()  # a campaign keeps it in the sample's log
        cause = Cause.REFUSED if isinstance(error, InputError) else Cause.EXCEPTION
        return Outcome(Status.ERROR, f"{type(error).__name__}: {error}", cause=cause)
    now = (time.perf_counter(), time.process_time())
    passed = {name: np.array(t - t0) for name, t, t0 in zip(TIMINGS, now, begin, strict=True)}
    outcome.values.update(passed)
    return outcome


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
