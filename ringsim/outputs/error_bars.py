"""Numerical error of a run, estimated from a second run with half the steps and twice the elements.

Integrator and elements are of second order: such a run has a quarter of the error, so that the two
are apart by three quarters of it (Richardson).  A finer run shows the error itself, a coarser one
only how errors grow: it says little of a vibration that it does not resolve.  Each output states
the factors of its bar (``ErrorBar``); docs/accuracy.md tells what they cover.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ringsim.outputs.family import VARIABLES, Array, ErrorBar
from ringsim.scene import Scene
from ringsim.variables import TIMINGS, Outcome

OF_DIFFERENCE = 4.0 / 3.0
"""Error over the difference of two runs, of which the second has a quarter of it."""
_MOST_ELEMENTS = 64
"""Upper bound of ``rods.elements``."""


def with_bars(outcome: Outcome, scene: Scene, solve: Callable[[Scene], Outcome]) -> Outcome:
    """The outcome of a scene, run with its own settings, with error bars, or why it has none."""
    finer = solve(refined(scene))
    # Times count from the beginning: those of the last run hold for both.
    outcome.values.update({n: finer.values[n] for n in TIMINGS if n in finer.values})
    if bars := error_bars(outcome, finer):
        outcome.values.update(bars)
        return outcome
    ended = f"ended as {finer.status.word}" if finer.status.failed else "locked other V-joints"
    why = f"no error bars, since the run with half the steps {ended}: {finer.reason}"
    return replace(outcome, reason=f"{outcome.reason}; {why}")


def refined(scene: Scene) -> Scene:
    """A scene with half the steps, twice the elements and a quarter of Newton's tolerance."""
    solver = scene.solver.scaled(0.5)
    solver = solver.model_copy(update={"newton_tolerance": solver.newton_tolerance / 4.0})
    elements = min(2 * scene.rods.elements, _MOST_ELEMENTS)
    rods = scene.rods.model_copy(update={"elements": elements})
    return scene.model_copy(update={"solver": solver, "rods": rods})


def error_bars(run: Outcome, finer: Outcome) -> dict[str, Array]:
    """Error bars of the main results of a run, whatever the antenna did in it.

    Parameters
    ----------
    run, finer
        The run that counts, and that of the ``refined`` scene.

    Returns
    -------
    dict
        ``NAME_error`` in the unit of NAME, of a function of time alone at every output time;
        NaN where the result itself is.  Empty if one of the runs failed, or if other V-joints
        locked in the other: then the steps decide what the antenna does, and no bar holds.
    """
    if run.status.failed or finer.status.failed or not _alike(run, finer):
        return {}
    return {f"{name}_error": bar(name, apart) for name, apart in differences(run, finer).items()}


def rules() -> dict[str, ErrorBar]:
    """How the error bars of all variables that have one are made."""
    return {name: v.error_bar for name, v in VARIABLES.items() if v.error_bar is not None}


def differences(one: Outcome, other: Outcome) -> dict[str, Array]:
    """Differences of two runs of a scene in what has an error bar, as far as both have it.

    The largest difference of all joints and output times; of a function of time alone the largest
    up to each output time, shape (time,).
    """
    apart: dict[str, Array] = {}
    for name in rules():
        if name in one.values:
            first, second = one.values[name], other.values[name]
            found = largest(name, np.abs(first - second))
            apart[name] = np.where(np.isfinite(first), found, np.nan) if found.ndim else found
    return apart


def largest(name: str, values: Array) -> Array:
    """Value of a result, or the largest of its series; of one over time up to each time."""
    over_time = VARIABLES[name].dims == ("time",)
    return np.asarray(np.fmax.accumulate(values) if over_time else np.fmax.reduce(values, None))


def bar(name: str, apart: Array | float) -> Array:
    """Error bar of a result from the difference of two runs, in its unit."""
    return np.asarray(rules()[name].safety * OF_DIFFERENCE * apart)


def _alike(one: Outcome, other: Outcome) -> bool:
    """Whether the same V-joints have locked in both runs."""
    first, second = (np.isfinite(run.values.get("lock_time", 0.0)) for run in (one, other))
    return bool(np.array_equal(first, second))
