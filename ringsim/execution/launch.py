"""Finding out under which launcher this process runs, and leaving an MPI world safely."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Iterator
from typing import Any

from ringsim.refusal import InputError

_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS")
_POLITE = 5e-3


def launched_size() -> int:
    """Number of processes that a launcher says it has started; 1 without a launcher."""
    for name in _SIZES:
        size = os.environ.get(name, "")
        if size.isdigit():
            return int(size)
    return 1


def mpi_world() -> Any:
    """The communicator of all processes that the launcher has started.

    Raises
    ------
    InputError
        If there is no MPI library, or if it does not belong to the launcher.
    """
    expected = launched_size()
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"started {expected} times by a launcher, but MPI cannot be loaded ({error}): install "
            "an MPI library (pip install 'ringsim[mpich]'), or use --workers instead"
        ) from None
    world = MPI.COMM_WORLD
    if world.Get_size() != expected:
        library = MPI.Get_library_version().split("\n")[0].strip()
        raise InputError(
            f"the launcher has started {expected} processes, but each is alone in its MPI world: "
            f"the launcher belongs to another MPI than the one loaded ({library}); use that one's "
            "mpiexec (under Slurm: srun --mpi=pmi2)"
        )
    return world


def describe(communicator: Any) -> str:
    """Size and library of an MPI world, in words."""
    from mpi4py import MPI

    library = " ".join(MPI.Get_library_version().split("\n")[0].split())
    return f"MPI, {communicator.Get_size()} ranks, {library}"


def polite_barrier(communicator: Any) -> None:
    """Wait for all ranks without spinning."""
    request = communicator.Ibarrier()
    while not request.Test():
        time.sleep(_POLITE)


@contextlib.contextmanager
def aborting(communicator: Any) -> Iterator[None]:
    """End the whole MPI job if an error leaves the block: the other ranks would wait for ever."""
    try:
        yield
    except Exception:
        traceback.print_exc()
        sys.stderr.flush()
        communicator.Abort(1)
        raise
