"""Running samples on this machine: in several solver processes at a time, or in this very one."""

from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import wait

from ringsim.execution.slot import TICK, Slot
from ringsim.execution.solve import load_solver, solve
from ringsim.execution.work import Scheduler, Work
from ringsim.scene import Scene
from ringsim.tables import counted


class Local(Scheduler):
    """A number of solver processes, supervised by one event loop."""

    def __init__(self, workers: int) -> None:
        self.workers, self.description = workers, counted(workers, "local worker")
        self._slots: list[Slot] = []

    def run(self, samples: Sequence[int], work: Work) -> str:
        """See :meth:`Scheduler.run`."""
        queue, stands = deque(samples), False
        try:
            slots = self._ready(min(self.workers, len(queue)), work)
            while not work.stop():
                for slot in slots:
                    slot.serve(queue, work)
                busy = [slot.pipe for slot in slots if slot.busy]
                if not busy:
                    stands = work.more
                    break
                wait(busy, timeout=TICK)
            return work.stop()
        finally:
            if not stands:
                self.close()

    def close(self) -> None:
        """See :meth:`Scheduler.close`."""
        while self._slots:
            self._slots.pop().close()

    def _ready(self, count: int, work: Work) -> list[Slot]:
        """Slots that stand since the last run, if they were set up for such work, and new ones."""
        if any(not slot.suits(work) for slot in self._slots):
            self.close()
        while len(self._slots) < count:
            self._slots.append(Slot(work.solver, work.scene, work.allowance, work.judge))
        return self._slots[:count]


class Serial(Scheduler):
    """One sample after the other in this process, without limits: a crash ends everything."""

    description = "in one process"

    def run(self, samples: Sequence[int], work: Work) -> str:
        """See :meth:`Scheduler.run`."""
        solver, base = load_solver(work.solver), Scene.model_validate(work.scene)
        for sample in samples:
            if work.stop():
                break
            work.started(sample)
            chosen = solver if sample >= 0 else load_solver(work.judge)
            result = solve(chosen, base, sample, work.values_of(sample))
            work.keep(result)
            work.finished(result)
        return work.stop()
