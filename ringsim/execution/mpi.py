"""Running samples on all ranks of an MPI world, which only schedules.

Every rank supervises one solver process; rank 0 also hands out the samples.  Nobody spins: a
rank with nothing to do sleeps on its solver's pipe, a little longer each time.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any, TypeVar, cast

from ringsim.execution.slot import Slot
from ringsim.execution.work import Scheduler, Work
from ringsim.refusal import InputError

_TO_WORKER, _TO_RANK_0 = 11, 12
_SHORTEST, _LONGEST = 1e-4, 2e-2
_AHEAD_SECONDS, _MOST_AHEAD = 0.02, 32
_POLITE = 5e-3
_T = TypeVar("_T")


class Mpi(Scheduler):
    """All ranks of a communicator of mpi4py; each must call :meth:`run` with its own work."""

    def __init__(self, communicator: Any) -> None:
        from mpi4py import MPI

        self.communicator = communicator
        self.rank: int = communicator.Get_rank()
        self.workers: int = communicator.Get_size()
        library = " ".join(MPI.Get_library_version().split("\n")[0].split())
        self.description = f"MPI, {self.workers} ranks, {library}"

    def from_first(self, value: _T) -> _T:
        """See :meth:`Scheduler.from_first`."""
        return cast(_T, self.communicator.bcast(value))

    def from_all(self, value: _T) -> list[_T]:
        """See :meth:`Scheduler.from_all`."""
        self.wait()
        return cast(list[_T], self.communicator.allgather(value))

    def wait(self) -> None:
        """Wait for all ranks without spinning."""
        request = self.communicator.Ibarrier()
        while not request.Test():
            time.sleep(_POLITE)

    def run(self, samples: Sequence[int], work: Work) -> str:
        """See :meth:`Scheduler.run`."""
        with closing(Slot(work.solver, work.scene, work.limits)) as slot:
            if self.rank == 0:
                return self._schedule(deque(samples), slot, work)
            return self._serve(slot, work)

    def _schedule(self, queue: deque[int], slot: Slot, work: Work) -> str:
        held: dict[int, deque[int]] = {rank: deque() for rank in range(1, self.workers)}
        silent, mean, reason, fault, delay = set(held), 0.0, "", "", _SHORTEST

        def receive() -> bool:
            """Take one message, if there is one."""
            nonlocal mean, reason, fault
            if not self.communicator.iprobe(tag=_TO_RANK_0):
                return False
            rank, kind, content = self.communicator.recv(tag=_TO_RANK_0)
            silent.discard(rank)
            if kind == "result":
                mean += 0.1 * (content.seconds - mean)
                work.finished(content)
                held[rank].popleft()
                if held[rank]:
                    work.started(held[rank][0])
            elif kind == "fault":
                fault = fault or content
            elif kind == "stop":
                reason = reason or content
            elif kind == "left":
                del held[rank]
            return True

        while True:
            reason = reason or fault or work.stop()
            if reason or not (queue or slot.busy or any(held.values())):
                break
            ahead = self._ahead(mean, len(queue))
            for rank in held.keys() - silent if queue else ():
                mine = held[rank]
                if queue and len(mine) <= ahead // 2:
                    batch = [queue.popleft() for _ in range(min(ahead - len(mine), len(queue)))]
                    self.communicator.send(batch, dest=rank, tag=_TO_WORKER)
                    if not mine:
                        work.started(batch[0])
                    mine.extend(batch)
            moved = False
            while receive():
                moved = True
            try:
                moved = slot.serve(queue, work) is not None or moved
            except InputError as error:
                fault = str(error)
            delay = _SHORTEST if moved else min(1.5 * delay, _LONGEST)
            if not moved:
                _rest(slot, delay)
        slot.close()
        for rank in held:
            self.communicator.send(None, dest=rank, tag=_TO_WORKER)
        while held:  # what they sent before they heard of the end
            if not receive():
                time.sleep(_LONGEST)
        if fault:
            raise InputError(fault)
        return reason or work.stop()

    def _ahead(self, mean: float, left: int) -> int:
        """Samples that a rank may hold: two, more if they are short, one towards the end."""
        wanted = max(2, min(int(_AHEAD_SECONDS / max(mean, 1e-4)), _MOST_AHEAD))
        return max(1, min(wanted, left // (2 * self.workers)))

    def _serve(self, slot: Slot, work: Work) -> str:
        self._tell("hello", "")
        told = fault = ""
        delay, queue = _SHORTEST, deque[int]()
        while True:
            if self.communicator.iprobe(source=0, tag=_TO_WORKER):
                batch = self.communicator.recv(source=0, tag=_TO_WORKER)
                if batch is None:
                    self._tell("left", "")
                    return fault
                queue.extend(batch)
                delay = _SHORTEST
            try:
                result = slot.serve(queue, work) if not fault else None
                if result is not None:
                    self._tell("result", replace(result, body=b""))
                    delay = _SHORTEST
            except InputError as error:
                fault = str(error)
                slot.close()
                self._tell("fault", fault)
            if work.stop() and not told:
                told = work.stop()
                self._tell("stop", told)
            _rest(slot, delay)
            delay = min(1.5 * delay, _LONGEST)

    def _tell(self, kind: str, content: Any) -> None:
        self.communicator.send((self.rank, kind, content), dest=0, tag=_TO_RANK_0)


def _rest(slot: Slot, seconds: float) -> None:
    if slot.busy:
        slot.pipe.poll(seconds)
    else:
        time.sleep(seconds)
