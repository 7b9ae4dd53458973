"""Leaving an MPI world: an error on one rank ends the job, a wrong launcher is refused."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from ringsim.execution.mpi import launched_size, mpi_world
from ringsim.refusal import InputError

PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
MPIEXEC = shutil.which("mpiexec", path=PATH)
needs_mpi = pytest.mark.skipif(MPIEXEC is None, reason="there is no mpiexec: ringsim[mpich]")


def under_mpi(script, ranks=2):
    return subprocess.run(
        [MPIEXEC, "-n", str(ranks), sys.executable, "-c", textwrap.dedent(script)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


@needs_mpi
def test_error_on_one_rank_ends_the_others_too():
    done = under_mpi(
        """
        from ringsim.execution.mpi import aborting, mpi_world
        world = mpi_world()
        with aborting(world):
            if world.Get_rank() == 1:
                raise ZeroDivisionError("on purpose")
            world.Barrier()
        """
    )
    assert done.returncode != 0
    assert "on purpose" in done.stderr


@needs_mpi
def test_nobody_passes_the_barrier_before_all_are_there(tmp_path):
    done = under_mpi(
        f"""
        import time
        from pathlib import Path
        from ringsim.execution.mpi import Mpi, mpi_world
        world, sign = mpi_world(), Path({str(tmp_path / "sign")!r})
        if world.Get_rank() == 1:
            time.sleep(0.3)
            sign.touch()
        Mpi(world).wait()
        print(sign.exists())
        """
    )
    # Lines of two ranks may run into each other.
    assert done.stdout.split() == ["True", "True"] or done.stdout.strip() == "TrueTrue", done.stderr


@pytest.mark.parametrize(
    ("variables", "size"),
    [
        ({}, 1),
        ({"PMI_SIZE": "3"}, 3),
        ({"OMPI_COMM_WORLD_SIZE": "5"}, 5),
        ({"SLURM_STEP_NUM_TASKS": "7"}, 7),
    ],
)
def test_launchers_tell_their_size(variables, size, monkeypatch):
    for name in ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert launched_size() == size


def test_world_without_a_library_is_refused_with_the_cure(monkeypatch):
    monkeypatch.setenv("PMI_SIZE", "2")
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    with pytest.raises(InputError, match=r"ringsim\[mpich\].*--workers"):
        mpi_world()
