"""Running samples in this very process: for debugging, without isolation."""

from __future__ import annotations

from collections.abc import Sequence

from ringsim.execution.solve import load_solver, solve
from ringsim.execution.work import Scheduler, Work
from ringsim.scene import Scene


class Serial(Scheduler):
    """One sample after the other; a crash takes everything with it, limits do not hold."""

    description = "in one process"

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples; see :class:`Scheduler`."""
        solver, base = load_solver(work.solver), Scene.model_validate(work.scene)
        for sample in samples:
            reason = work.stop()
            if reason:
                return reason
            work.started(sample)
            result = solve(solver, base, work.task(sample))
            work.keep(result)
            work.finished(result)
        return work.stop()
