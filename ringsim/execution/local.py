"""Running samples on this machine, in several solver processes at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import wait

from ringsim.execution.slot import TICK, Slot
from ringsim.execution.work import Scheduler, Work


class Local(Scheduler):
    """A number of solver processes, supervised by one event loop."""

    def __init__(self, workers: int) -> None:
        self.workers, self.description = workers, f"{workers} local workers"

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples; see :class:`Scheduler`."""
        queue = deque(samples)
        count = min(self.workers, len(queue))
        slots = [Slot(work.solver, work.scene, work.limits) for _ in range(count)]
        try:
            while True:
                reason = work.stop()
                if reason:
                    return reason
                for slot in slots:
                    slot.serve(queue, work)
                busy = [slot.pipe for slot in slots if slot.busy]
                if not busy:
                    return work.stop()
                wait(busy, timeout=TICK)
        finally:
            for slot in slots:
                slot.close()
