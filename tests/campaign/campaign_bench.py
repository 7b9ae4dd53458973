"""Small campaigns, run by the real command line with a quick stand-in for the solver."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr
from preloaded import Started, ringsim

from ringsim.campaign.folder import open_folder
from ringsim.storage.journal import Journal, read_journal

HERE = Path(__file__).parent
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
"""Where programs of the virtual environment are found, also if it is not activated."""

MODULES = os.pathsep.join(filter(None, [str(HERE), os.environ.get("PYTHONPATH", "")]))
"""Where the stand-ins for the solver are found."""

PYTHON = [sys.executable, "-m", "ringsim"]
MPIEXEC = shutil.which("mpiexec", path=PATH)
NOT_COMPARED = ("wall_time", "cpu_time", "log", "wall_time_checked", "cpu_time_checked")
"""Timings, and the text that a dying process prints."""

CAMPAIGN = """
name = "small"
seed = 7
scene = "ring18"
design = {{ kind = "random", samples = {samples} }}

[set]
name = "ring6"
"structure.sections" = 6
boom = "none"
"solver.end_time" = 20.0
{shared}

[inputs]
"net.stiffness" = {{ kind = "lognormal", mean = 0.001, standard_deviation = 0.0002 }}
"loads.force" = {{ kind = "uniform", low = 0.01, high = 0.05 }}
{inputs}

[inputs.rods.young_modulus]
kind = "normal"
mean = 120e9
standard_deviation = 6e9
each_section = true

{more}
"""


LISTED = """
name = "listed"
scene = "ring18"
design = {{ kind = "list", file = "ways.csv" }}

[set]
name = "ring6"
"structure.sections" = 6
boom = "none"
"solver.end_time" = 20.0
{shared}

{more}
"""


@dataclass
class Bench:
    """A folder with a campaign file, and the command line to run it."""

    folder: Path
    extra: dict[str, str] = field(default_factory=dict)
    processes: list[subprocess.Popen | Started] = field(default_factory=list)

    def write(self, samples=20, *, shared="", inputs="", more="", name="small.toml"):
        path = self.folder / name
        path.write_text(CAMPAIGN.format(samples=samples, shared=shared, inputs=inputs, more=more))
        return path

    def write_listed(self, ways, *, more="", shared="", name="listed.toml"):
        """A campaign whose samples fail in the given ways, see fake_solver.poisoned; 30 is none."""
        rows = [f"{way / 100},{0.01 + 0.0005 * k}" for k, way in enumerate(ways)]
        table = "\n".join(["rods.poisson_ratio,loads.force", *rows])
        (self.folder / "ways.csv").write_text(table + "\n")
        path = self.folder / name
        path.write_text(LISTED.format(more=more, shared=shared))
        return path

    def command(self, *arguments, ranks=0, solver="fake_solver:run"):
        front = PYTHON
        if ranks:
            mpi = [MPIEXEC or "mpiexec", "-n", str(ranks)]
            front = [*mpi, sys.executable, "-m", "mpi4py", "-m", "ringsim"]
        end = ["--solver", solver] if solver and arguments[0] in ("campaign", "replay") else []
        return [*front, *map(str, arguments), *end]

    def environment(self):
        return os.environ | {"PYTHONPATH": MODULES} | self.extra

    def start(self, *arguments, ranks=0, solver="fake_solver:run", fresh=False):
        """A process that goes on; ``fresh`` starts one that has loaded nothing."""
        command = self.command(*arguments, ranks=ranks, solver=solver)
        environment = self.environment()
        if ranks or fresh:
            process = subprocess.Popen(
                command, cwd=self.folder, env=environment, text=True,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
        else:
            words = command[len(PYTHON) :]
            process = Started(*words, folder=self.folder, environment=environment)
        self.processes.append(process)
        return process

    def close(self):
        """End what is still running, and close the pipes of what has ended, too."""
        for process in self.processes:
            if isinstance(process, Started):
                process.close()
                continue
            if process.poll() is None:
                process.kill()
                process.communicate()
            process.stdout.close()

    def run(self, *arguments, ranks=0, solver="fake_solver:run", code=0, timeout=120, fresh=False):
        """What the command prints; ``fresh`` starts a process that has loaded nothing."""
        command = self.command(*arguments, ranks=ranks, solver=solver)
        environment = self.environment()
        if ranks or fresh:
            done = subprocess.run(
                command, cwd=self.folder, env=environment, text=True, timeout=timeout,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
            )  # fmt: skip
        else:
            done = ringsim(
                *command[len(PYTHON) :], folder=self.folder, environment=environment,
                joined=True, timeout=timeout,
            )  # fmt: skip
        assert done.returncode == code, done.stdout
        return done.stdout

    def result(self, out):
        return opened(self.folder / out / "campaign.nc")


def opened(path):
    with xr.open_dataset(path) as found:
        return found.load()


def finished(out):
    """Samples that have a result on file."""
    if not (out / "design.nc").exists():
        return set()
    folder = open_folder(out)
    return set(range(folder.table.samples)) - set(folder.survey().missing.tolist())


def comparable(dataset):
    """Every value, without what differs between two runs of the same thing."""
    return dataset.drop_vars([n for n in NOT_COMPARED if n in dataset]).drop_attrs()


START = ("campaign", "small.toml", "--workers", 2, "--out", "out")
"""Runs the campaign of the fixtures ``whole`` and ``copied``."""


def assert_same(bench, other):
    """The merged files of two benches have the same values."""
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(other.result("out")))


def journals(bench):
    return sorted((bench.folder / "out" / "journals").iterdir())


def lose(bench, samples):
    """Take the results of some samples out of the journals, and the merged file away."""
    folder = open_folder(bench.folder / "out")
    paths, new = journals(bench), Journal(folder.path, "all-rank0")
    for path in paths:
        for *_, result in read_journal(path):
            if result.sample not in samples:
                new.append(result)
        path.unlink()
    new.close()
    (folder.path / "campaign.nc").unlink(missing_ok=True)


def records(folder, writer="*"):
    """Records in the journals of running writers; looking at them costs nothing."""
    paths = (folder / "journals").glob(f"{writer}.journal")
    return sum(path.read_bytes().count(b"ringsim3") for path in paths)


def ranks_of(bench, number):
    """Processes of the bench that are a certain rank of an MPI world."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            pairs = (path / "environ").read_bytes().split(b"\0")
            words = dict(pair.split(b"=", 1) for pair in pairs if b"=" in pair)
            here = os.readlink(path / "cwd") == str(bench.folder)
            python = b"ringsim" in (path / "cmdline").read_bytes()
            if here and python and words.get(b"PMI_RANK") == number:
                found.append(int(path.name))
    return found
