"""Finding out under which launcher this process runs, and leaving an MPI world safely."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import traceback
from collections.abc import Iterator
from typing import Any

from ringsim.refusal import InputError

OF_MPI = ("PMI", "PMIX", "OMPI", "OPAL", "PRTE", "HYDRA", "HYDI", "MPI", "I_MPI", "MPIR")
"""How names of variables begin by which launchers and libraries speak to each other."""

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
    """The communicator of all processes that the launcher has started.

    InputError if there is no MPI library, or if it does not belong to the launcher.
    """
    expected = launched_size()
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        # Other libraries do not even start under this launcher: they end the process.
        environment = {k: v for k, v in os.environ.items() if not k.startswith(OF_MPI)}
        library = subprocess.run(
            [sys.executable, "-c", _LIBRARY], env=environment, capture_output=True, text=True,
            check=False,
        ).stdout.strip()  # fmt: skip
        if library and not library.startswith("Open MPI"):
            raise _stranger(expected, library)
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"started {expected} times by a launcher, but MPI cannot be loaded ({error}): install "
            "an MPI library (pip install 'ringsim[mpich]'), or use --workers instead"
        ) from None
    world = MPI.COMM_WORLD
    if world.Get_size() != expected:
        raise _stranger(expected, MPI.Get_library_version())
    return world


def _stranger(expected: int, library: str) -> InputError:
    name = library.splitlines()[0].strip(" \0")
    return InputError(
        f"the launcher has started {expected} processes, but each is alone in its MPI world: the "
        f"launcher belongs to another MPI than the one loaded ({name}); use that one's mpiexec "
        "(under Slurm: srun --mpi=pmi2)"
    )


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
