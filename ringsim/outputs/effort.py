"""What a run took: steps, iterations, starts, times, and the settings that it ended up with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ringsim.outputs.family import Output, Run, Series, Values, Variable
from ringsim.parts.solver import Solver
from ringsim.variables import Fidelity, Outcome

COUNTS = ("steps", "newton_iterations", "jacobians")
"""What a start of a run takes; "total_" before the name counts all starts."""

TIMINGS = ("wall_time", "cpu_time")
"""The only variables that differ between repetitions of one run."""


def _number(name: str, long_name: str, summary: tuple[str, str] | None = None) -> Variable:
    return Variable(name, (), "1", long_name, "i4", summary=summary)


class Effort(Output):
    """Counts of the start that counts; :func:`note_starts` adds those of all starts."""

    rank = 70
    variables = (
        _number("steps", "time steps of the start that counts", ("steps", "10d")),
        _number("repeated_steps", "steps that were repeated with a smaller one"),
        _number("newton_iterations", "Newton iterations of the start that counts"),
        _number("jacobians", "Jacobian factorisations of the start that counts"),
        _number("restarts", "new starts with a smaller step after a run that failed"),
        _number(
            "total_steps", "time steps of all starts of the run", ("steps of all starts", "10d")
        ),
        _number("total_newton_iterations", "Newton iterations of all starts"),
        _number("total_jacobians", "Jacobian factorisations of all starts"),
        _number("fidelity", "model: 0 full multibody, 1 ideal ring of rigid rods"),
        Variable(
            "step_used", (), "s", "largest step allowed, solver.step, of the start that counts"
        ),
        Variable("tolerance_used", (), "1", "solver.tolerance of the start that counts"),
        Variable("final_time", (), "s", "time at which the run ended"),
        Variable("wall_time", (), "s", "elapsed time of the run", summary=("wall time", "10.2f")),
        Variable("cpu_time", (), "s", "processor time of the run"),
    )

    def reduce(self, run: Run, series: Series) -> Values:
        """As counted."""
        return {**run.counts, "final_time": series.times[-1]}


def counts_of(outcome: Outcome) -> dict[str, int]:
    """What one start of a run took; 0 where it ended too early to tell."""
    return {name: int(outcome.values.get(name, np.array(0))) for name in COUNTS}


def note_starts(
    outcome: Outcome, fidelity: Fidelity, used: Solver, starts: Sequence[Mapping[str, int]]
) -> None:
    """Add to the outcome of the last start which model answered, its settings and all counts.

    The full model alone has a tolerance, if its steps follow the motion; ``starts`` are the
    :func:`counts_of` each start.
    """
    follows = fidelity is Fidelity.FULL and used.step_control == "motion"
    found = {
        "fidelity": int(fidelity),
        "restarts": len(starts) - 1,
        "step_used": used.step,
        "tolerance_used": used.tolerance if follows else np.nan,
        **{f"total_{name}": sum(each[name] for each in starts) for name in COUNTS},
    }
    outcome.values.update({name: np.array(value) for name, value in found.items()})
