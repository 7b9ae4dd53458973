"""Small campaigns, run by the real command line with a quick stand-in for the solver."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

HERE = Path(__file__).parent
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
"""Where programs of the virtual environment are found, also if it is not activated."""

MPIEXEC = shutil.which("mpiexec", path=PATH)
NOT_COMPARED = ("wall_time", "cpu_time", "log")
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
    processes: list[subprocess.Popen] = field(default_factory=list)

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
        front = [sys.executable, "-m", "ringsim"]
        if ranks:
            front = [
                MPIEXEC or "mpiexec",
                "-n",
                str(ranks),
                sys.executable,
                "-m",
                "mpi4py",
                "-m",
                "ringsim",
            ]
        end = ["--solver", solver] if solver and arguments[0] == "campaign" else []
        return [*front, *map(str, arguments), *end]

    def environment(self):
        return os.environ | {"PYTHONPATH": str(HERE)} | self.extra

    def start(self, *arguments, ranks=0, solver="fake_solver:run"):
        process = subprocess.Popen(
            self.command(*arguments, ranks=ranks, solver=solver),
            cwd=self.folder, env=self.environment(), text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def close(self):
        """End what is still running."""
        for process in self.processes:
            if process.poll() is None:
                process.kill()
                process.communicate()

    def run(self, *arguments, ranks=0, solver="fake_solver:run", code=0, timeout=120):
        done = subprocess.run(
            self.command(*arguments, ranks=ranks, solver=solver),
            cwd=self.folder, env=self.environment(), text=True, timeout=timeout,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        )  # fmt: skip
        assert done.returncode == code, done.stdout
        return done.stdout

    def result(self, out):
        return opened(self.folder / out / "campaign.nc")


def opened(path):
    with xr.open_dataset(path) as found:
        return found.load()


def comparable(dataset):
    """Every value, without what differs between two runs of the same thing."""
    return dataset.drop_vars([n for n in NOT_COMPARED if n in dataset]).drop_attrs()
