"""Running samples on all ranks of an MPI world: finding, using and leaving it.

Every rank supervises one solver process; rank 0 also hands out the samples.  Nobody spins: a
rank with nothing to do sleeps on its solver's pipe, a little longer each time.
"""

import contextlib
import os
import subprocess
import sys
import time
import traceback
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

from ringsim.execution.slot import Slot, without_mpi
from ringsim.execution.work import Scheduler, Work
from ringsim.refusal import InputError
from ringsim.tables import counted

_TO_WORKER, _TO_RANK_0 = 11, 12
_SHORTEST, _LONGEST = 1e-4, 2e-2
_AHEAD_SECONDS, _MOST_AHEAD = 0.02, 32
_POLITE = 5e-3
_HEARD = 0.2
"""Time for a launcher to read what a rank has said, s: it polls its ranks' pipes."""
_T = TypeVar("_T")

_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS")
_LIBRARY = """
import mpi4py
mpi4py.rc.initialize = False
from mpi4py import MPI
print(MPI.Get_library_version())
"""
"""Tells the version of the MPI library without starting it; nothing if it cannot be loaded."""


def launched_size() -> int:
    """Number of processes that a launcher says it has started; 1 without a launcher."""
    sizes = (os.environ.get(name, "") for name in _SIZES)
    return next((int(size) for size in sizes if size.isdigit()), 1)


def mpi_world() -> Any:
    """The communicator of all started processes; InputError without the launcher's own library."""
    expected = launched_size()
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        # Other libraries do not even start under this launcher: they end the process.
        library = subprocess.run(
            [sys.executable, "-c", _LIBRARY], env=without_mpi(), capture_output=True, text=True,
            check=False,
        ).stdout.strip()  # fmt: skip
        if library and not library.startswith("Open MPI"):
            raise _stranger(expected, library)
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"the launcher has started {expected} processes, but MPI cannot be loaded ({error}): "
            "install an MPI library (pip install 'ringsim[mpich]'), or use --workers instead"
        ) from None
    world = MPI.COMM_WORLD
    if world.Get_size() != expected:
        raise _stranger(expected, MPI.Get_library_version())
    return world


def _stranger(expected: int, library: str) -> InputError:
    name = library.splitlines()[0].strip(" \0")
    return InputError(
        f"the launcher has started {expected} processes, but they do not see each other: the "
        f"launcher belongs to another MPI library than the one loaded ({name}); use the mpiexec "
        "of that library (under Slurm: srun --mpi=pmi2)"
    )


@contextlib.contextmanager
def aborting(communicator: Any) -> Iterator[None]:
    """End the whole MPI job if an error leaves the block: the other ranks would wait for ever."""
    try:
        yield
    except Exception:
        sys.stderr.write(traceback.format_exc())
        sys.stderr.flush()
        # mpiexec drops what it has not read yet when a job aborts.
        time.sleep(_HEARD)
        communicator.Abort(1)
        raise


class Mpi(Scheduler):
    """All ranks of a communicator of mpi4py; each must call :meth:`run` with its own work."""

    def __init__(self, communicator: Any) -> None:
        from mpi4py import MPI

        self.communicator = communicator
        self.rank: int = communicator.Get_rank()
        self.workers: int = communicator.Get_size()
        library = " ".join(MPI.Get_library_version().split("\n")[0].split())
        self.description = f"MPI, {counted(self.workers, 'rank')}, {library}"

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
        with contextlib.closing(Slot(work.solver, work.scene, work.allowance, work.judge)) as slot:
            if self.rank == 0:
                return self._schedule(deque(samples), slot, work)
            return self._serve(slot, work)

    def _schedule(self, queue: deque[int], slot: Slot, work: Work) -> str:
        held: dict[int, deque[int]] = {}  # by rank, once it has said hello
        left, mean, reason, fault, delay = self.workers - 1, 0.0, "", "", _SHORTEST

        def receive() -> bool:
            """Take one message, if there is one."""
            nonlocal left, mean, reason, fault
            if not self.communicator.iprobe(tag=_TO_RANK_0):
                return False
            rank, kind, content = self.communicator.recv(tag=_TO_RANK_0)
            mine = held.setdefault(rank, deque())
            if kind == "result":
                mean += 0.1 * (content.seconds - mean)
                work.finished(content)
                mine.popleft()
                if mine:
                    work.started(mine[0])
            elif kind == "fault":
                fault = fault or content
            elif kind == "stop":
                reason = reason or content
            elif kind == "left":
                left -= 1
            return True

        while True:
            try:
                reason = reason or fault or work.stop()
            except InputError as error:  # or the other ranks would wait for ever
                reason = fault = str(error)
            if reason or not (queue or slot.busy or any(held.values())):
                break
            # A rank may hold two samples, more if they are short, one towards the end.
            wanted = max(2, min(int(_AHEAD_SECONDS / max(mean, 1e-4)), _MOST_AHEAD))
            ahead = max(1, min(wanted, len(queue) // (2 * self.workers)))
            for rank, mine in held.items():
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
            delay = _SHORTEST if moved else _rest(slot, delay)
        slot.close()
        for rank in range(1, self.workers):
            self.communicator.send(None, dest=rank, tag=_TO_WORKER)
        while left:  # what they sent before they heard of the end
            if not receive():
                time.sleep(_LONGEST)
        if fault:
            raise InputError(fault)
        return reason or work.stop()

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
                if not fault and (result := slot.serve(queue, work)) is not None:
                    self._tell("result", replace(result, body=b""))
                    delay = _SHORTEST
            except InputError as error:
                fault = str(error)
                slot.close()
                self._tell("fault", fault)
            if not told and (told := work.stop()):
                self._tell("stop", told)
            delay = _rest(slot, delay)

    def _tell(self, kind: str, content: Any) -> None:
        self.communicator.send((self.rank, kind, content), dest=0, tag=_TO_RANK_0)


def _rest(slot: Slot, seconds: float) -> float:
    """Sleep until the solver says something, not longer than so; how long to sleep next."""
    if slot.busy:
        slot.pipe.poll(seconds)
    else:
        time.sleep(seconds)
    return min(1.5 * seconds, _LONGEST)
