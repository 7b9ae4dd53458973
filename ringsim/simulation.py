"""One simulation: scene in, outcome or dataset out.  Failures are values, not exceptions."""

import time
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ringsim.engine.integrate import Watch, solve
from ringsim.outputs.error_bars import error_bars
from ringsim.parts.solver import Solver
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.scene import Scene, load_scene
from ringsim.stepping.restarts import run_with_restarts
from ringsim.theory.ideal_fidelity import run_ideal, with_remark
from ringsim.threads import one_thread
from ringsim.variables import Cause, Fidelity, Outcome, Status

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIDELITIES", "run", "run_ideal", "simulate"]


@one_thread()
def run(scene: Scene, watch: Watch | None = None) -> Outcome:
    """Build and integrate a scene; one that fails or diverges starts anew with smaller steps.

    The outcome has arrays on the scene's output grid, of the last start, and what
    :func:`ringsim.stepping.restarts.run_with_restarts` adds on the starts; times are those of all
    of them and of the second run for error bars.  A solve that fails or does not reach its goal
    has a status other than OK and the reason; it never raises.  ``watch`` is called with every
    accepted state.
    """
    begin = (time.perf_counter(), time.process_time())

    def start(solver: Solver) -> Outcome:
        return _attempt(scene.model_copy(update={"solver": solver}), begin, watch)

    bars = partial(error_bars, elements=scene.rods.elements)
    outcome = run_with_restarts(start, scene.solver, bars)
    outcome.values["fidelity"] = np.array(int(Fidelity.FULL))
    return with_remark(outcome, scene)


def _attempt(scene: Scene, begin: tuple[float, float], watch: Watch | None) -> Outcome:
    """One start of a run; times count from ``begin`` (s, elapsed and of the processor)."""
    try:
        outcome = solve(scene, watch)
        outcome.values["wall_time"] = np.array(time.perf_counter() - begin[0])
        outcome.values["cpu_time"] = np.array(time.process_time() - begin[1])
        return outcome
    except Exception as error:  # whatever broke, a campaign goes on and the user learns of it
        traceback.print_exc()  # a campaign keeps it in the sample's log
        cause = Cause.REFUSED if isinstance(error, InputError) else Cause.EXCEPTION
        return Outcome(Status.ERROR, f"{type(error).__name__}: {error}", cause=cause)


FIDELITIES: dict[str, Callable[[Scene], Outcome]] = {"full": run, "ideal": run_ideal}
"""What answers a scene: the full multibody model, or the ideal ring of rigid rods, which knows
neither asynchrony nor stress and costs a fraction."""


def simulate(scene: Scene | str | Path, fidelity: str = "full") -> "xr.Dataset":
    """Run a scene and return its dataset (see ``ringsim.dataset.to_dataset``).

    ``scene`` is a scene, or what ``load_scene`` reads: the name of a built-in one or a file.
    InputError if that, or ``fidelity`` ("full", "ideal"), is refused, or if the ideal ring cannot
    represent the scene.

    >>> from ringsim.scene import load_scene
    >>> scene = load_scene("truss2").with_values({"solver.end_time": 0.5})
    >>> run = simulate(scene)
    >>> run.attrs["reason"]
    'solver.end_time = 0.5 s was reached with 0 of 4 V-joints locked'
    >>> bool(run["energy_error"] < 1e-3)
    True
    """
    from ringsim.dataset import to_dataset

    if fidelity not in FIDELITIES:
        hint = known_or_nearest(fidelity, FIDELITIES)
        raise InputError(f"fidelity = {show(fidelity)}: there is no such model ({hint})")
    chosen = load_scene(scene) if isinstance(scene, (str, Path)) else scene
    return to_dataset(FIDELITIES[fidelity](chosen), chosen)
