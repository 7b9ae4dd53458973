"""Running samples on all ranks of an MPI world, which only schedules.

Every rank supervises one solver process; rank 0 also hands out the samples.  Nobody spins: a
rank with nothing to do sleeps on its solver's pipe, a little longer each time.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

from ringsim.execution.slot import Slot
from ringsim.execution.work import Scheduler, Work
from ringsim.refusal import InputError
from ringsim.storage.result import Result

_TO_WORKER, _TO_RANK_0 = 11, 12
_SHORTEST, _LONGEST = 1e-4, 2e-2
_AHEAD_SECONDS, _MOST_AHEAD = 0.02, 32
_POLITE = 5e-3
_T = TypeVar("_T")


class Mpi(Scheduler):
    """All ranks of a communicator; each must call :meth:`run` with its own work.

    Parameters
    ----------
    communicator
        From mpi4py.
    """

    def __init__(self, communicator: Any) -> None:
        from mpi4py import MPI

        self.communicator = communicator
        self.rank: int = communicator.Get_rank()
        self.workers: int = communicator.Get_size()
        library = " ".join(MPI.Get_library_version().split("\n")[0].split())
        self.description = f"MPI, {self.workers} ranks, {library}"

    def from_first(self, value: _T) -> _T:
        """See :meth:`Scheduler.from_first`."""
        found: _T = self.communicator.bcast(value)
        return found

    def from_all(self, value: _T) -> list[_T]:
        """See :meth:`Scheduler.from_all`."""
        self.wait()
        found: list[_T] = self.communicator.allgather(value)
        return found

    def wait(self) -> None:
        """Wait for all ranks without spinning."""
        request = self.communicator.Ibarrier()
        while not request.Test():
            time.sleep(_POLITE)

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples; see :class:`Scheduler`.  Only rank 0's samples are looked at."""
        slot = Slot(work.solver, work.scene, work.limits)
        try:
            return (
                self._schedule(deque(samples), slot, work)
                if self.rank == 0
                else self._serve(slot, work)
            )
        finally:
            slot.close()

    def _schedule(self, queue: deque[int], slot: Slot, work: Work) -> str:
        held: dict[int, deque[int]] = {rank: deque() for rank in range(1, self.workers)}
        silent, mean, reason, fault, delay = set(held), 0.0, "", "", _SHORTEST
        while True:
            moved = False
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
            while self.communicator.iprobe(tag=_TO_RANK_0):
                moved = True
                rank, message = self.communicator.recv(tag=_TO_RANK_0)
                silent.discard(rank)
                if isinstance(message, Result):
                    mean += 0.1 * (message.seconds - mean)
                    work.finished(message)
                    held[rank].popleft()
                    if held[rank]:
                        work.started(held[rank][0])
                elif message is not None:
                    kind, text = message
                    reason = reason or text
                    if kind == "gone":
                        fault = fault or text
                        del held[rank]
            try:
                if queue and not slot.busy:
                    sample = queue.popleft()
                    slot.submit(work.task(sample))
                    work.started(sample)
                result = slot.poll() if slot.busy else None
                if result is not None:
                    moved = True
                    work.keep(result)
                    work.finished(result)
            except InputError as error:
                fault = str(error)
            delay = _SHORTEST if moved else min(1.5 * delay, _LONGEST)
            if not moved:
                _rest(slot, delay)
        slot.close()
        for rank in range(1, self.workers):
            self.communicator.send(None, dest=rank, tag=_TO_WORKER)
        self._drain(work, set(held))
        if fault:
            raise InputError(fault)
        return reason or work.stop()

    def _ahead(self, mean: float, left: int) -> int:
        """Samples that a rank may hold: two, more if they are short, one towards the end."""
        wanted = max(2, min(int(_AHEAD_SECONDS / max(mean, 1e-4)), _MOST_AHEAD))
        return max(1, min(wanted, left // (2 * self.workers)))

    def _drain(self, work: Work, there: set[int]) -> None:
        """Take what the others sent before they heard of the end."""
        while there:
            if not self.communicator.iprobe(tag=_TO_RANK_0):
                time.sleep(_LONGEST)
                continue
            rank, message = self.communicator.recv(tag=_TO_RANK_0)
            if isinstance(message, Result):
                work.finished(message)
            elif isinstance(message, tuple) and message[0] in ("gone", "left"):
                there.discard(rank)

    def _serve(self, slot: Slot, work: Work) -> str:
        self._tell(None)
        told, delay, queue = False, _SHORTEST, deque[int]()
        while True:
            if self.communicator.iprobe(source=0, tag=_TO_WORKER):
                batch = self.communicator.recv(source=0, tag=_TO_WORKER)
                if batch is None:
                    self._tell(("left", ""))
                    return ""
                queue.extend(batch)
            try:
                result = slot.poll() if slot.busy else None
                if result is not None:
                    work.keep(result)
                    self._tell(replace(result, body=b""))
                if queue and not slot.busy:
                    slot.submit(work.task(queue.popleft()))
                    delay = _SHORTEST
            except InputError as error:
                slot.close()
                self._tell(("gone", str(error)))
                self._wait_for_the_end()
                return str(error)
            if work.stop() and not told:
                self._tell(("stop", work.stop()))
                told = True
            delay = min(1.5 * delay, _LONGEST)
            _rest(slot, delay)

    def _tell(self, message: Any) -> None:
        self.communicator.send((self.rank, message), dest=0, tag=_TO_RANK_0)

    def _wait_for_the_end(self) -> None:
        while True:
            while not self.communicator.iprobe(source=0, tag=_TO_WORKER):
                time.sleep(_LONGEST)
            if self.communicator.recv(source=0, tag=_TO_WORKER) is None:
                return


def _rest(slot: Slot, seconds: float) -> None:
    if slot.busy:
        slot.pipe.poll(seconds)
    else:
        time.sleep(seconds)
