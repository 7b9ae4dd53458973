"""Running samples in this very process: for debugging, without isolation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ringsim.execution.solve import fresh_scene, load_solver, retold, solve
from ringsim.execution.work import Work
from ringsim.variables import Status


class Serial:
    """One sample after the other; a crash takes everything with it, limits do not hold."""

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples; see :class:`Scheduler`."""
        solver, base = load_solver(work.solver), fresh_scene(work.scene)
        for sample in samples:
            reason = work.stop()
            if reason:
                return reason
            work.started(sample)
            task, attempts, first = work.task(sample), 1, ""
            result = solve(solver, base, task)
            while (
                result.status in (Status.SOLVER_FAILED, Status.DIVERGED)
                and attempts <= work.retry.times
            ):
                first = first or result.reason
                task = replace(task, shrink=task.shrink * work.retry.step_factor)
                attempts += 1
                result = solve(solver, base, task)
            result = replace(
                result, attempts=attempts, reason=retold(result.reason, attempts, first)
            )
            work.keep(result)
            work.finished(replace(result, arrays=(), body=b""))
        return work.stop()
