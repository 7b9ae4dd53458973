"""Running samples on all ranks of an MPI world, which only schedules.

Every rank supervises one solver process; rank 0 also hands out the samples.  Nobody spins: a
rank with nothing to do sleeps on its solver's pipe, a little longer each time.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ringsim.execution.slot import Slot
from ringsim.execution.work import Work
from ringsim.refusal import InputError
from ringsim.storage.record import Result

_TO_WORKER, _TO_RANK_0 = 11, 12
_SHORTEST, _LONGEST = 1e-4, 2e-3
_LONGEST_OF_WORKER = 1e-2


class Mpi:
    """All ranks of a communicator; each must call :meth:`run` with its own work.

    Parameters
    ----------
    communicator
        From mpi4py.
    """

    def __init__(self, communicator: Any) -> None:
        self.communicator = communicator
        self.rank: int = communicator.Get_rank()
        self.size: int = communicator.Get_size()

    def run(self, samples: Sequence[int], work: Work) -> str:
        """Run samples; see :class:`Scheduler`.  Only rank 0's samples are looked at."""
        slot = Slot(work.solver, work.scene, work.limits, work.retry)
        try:
            return (
                self._schedule(deque(samples), slot, work)
                if self.rank == 0
                else self._serve(slot, work)
            )
        finally:
            slot.close()

    def _schedule(self, queue: deque[int], slot: Slot, work: Work) -> str:
        idle: list[int] = []
        busy = 0
        gone: set[int] = set()
        reason = fault = ""
        delay = _SHORTEST
        while True:
            moved = False
            reason = reason or fault or work.stop()
            if reason:
                break
            while queue and idle:
                sample = queue.popleft()
                self.communicator.send(sample, dest=idle.pop(), tag=_TO_WORKER)
                work.started(sample)
                busy += 1
            if queue and not slot.busy:
                sample = queue.popleft()
                slot.submit(work.task(sample))
                work.started(sample)
            if not queue and not busy and not slot.busy:
                break
            while self.communicator.iprobe(tag=_TO_RANK_0):
                moved = True
                rank, message = self.communicator.recv(tag=_TO_RANK_0)
                if isinstance(message, Result):
                    busy -= 1
                    work.finished(message)
                    idle.append(rank)
                elif message is None:
                    idle.append(rank)
                else:
                    kind, text = message
                    gone |= {rank} if kind == "gone" else set()
                    fault = fault or (text if kind == "gone" else "")
                    reason = reason or text
            try:
                result = slot.poll() if slot.busy else None
                if result is not None:
                    moved = True
                    work.keep(result)
                    work.finished(replace(result, arrays=(), body=b""))
            except InputError as error:
                fault = str(error)
            delay = _SHORTEST if moved else min(1.5 * delay, _LONGEST)
            if not moved:
                _rest(slot, delay)
        slot.close()
        for rank in range(1, self.size):
            self.communicator.send(None, dest=rank, tag=_TO_WORKER)
        self._drain(work, gone)
        if fault:
            raise InputError(fault)
        return reason or work.stop()

    def _drain(self, work: Work, gone: set[int]) -> None:
        """Take what the others sent before they heard of the end."""
        open_ranks = set(range(1, self.size)) - gone
        while open_ranks:
            if not self.communicator.iprobe(tag=_TO_RANK_0):
                time.sleep(_LONGEST)
                continue
            rank, message = self.communicator.recv(tag=_TO_RANK_0)
            if isinstance(message, Result):
                work.finished(message)
            elif isinstance(message, tuple) and message[0] in ("gone", "left"):
                open_ranks.discard(rank)

    def _serve(self, slot: Slot, work: Work) -> str:
        self._tell(None)
        told, delay, reason = False, _SHORTEST, ""
        while True:
            if self.communicator.iprobe(source=0, tag=_TO_WORKER):
                sample = self.communicator.recv(source=0, tag=_TO_WORKER)
                if sample is None:
                    self._tell(("left", reason))
                    return reason
                slot.submit(work.task(sample))
                delay = _SHORTEST
            try:
                result = slot.poll() if slot.busy else None
                if result is not None:
                    work.keep(result)
                    self._tell(replace(result, arrays=(), body=b""))
                    delay = _SHORTEST
            except InputError as error:
                slot.close()
                self._tell(("gone", str(error)))
                self._wait_for_the_end()
                return str(error)
            reason = work.stop()
            if reason and not told:
                self._tell(("stop", reason))
                told = True
            delay = min(1.5 * delay, _LONGEST_OF_WORKER)
            _rest(slot, delay)

    def _tell(self, message: Any) -> None:
        self.communicator.send((self.rank, message), dest=0, tag=_TO_RANK_0)

    def _wait_for_the_end(self) -> None:
        while True:
            while not self.communicator.iprobe(source=0, tag=_TO_WORKER):
                time.sleep(_LONGEST_OF_WORKER)
            if self.communicator.recv(source=0, tag=_TO_WORKER) is None:
                return


def _rest(slot: Slot, seconds: float) -> None:
    if slot.busy:
        slot.pipe.poll(seconds)
    else:
        time.sleep(seconds)
