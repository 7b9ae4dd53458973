"""A campaign of many cheap real runs: kills, memory over time, and every command after it.

python benchmarks/large_campaign.py run DIR [--samples 100000] [--workers 2]
python benchmarks/large_campaign.py commands DIR
python benchmarks/large_campaign.py memory DIR

``run`` ends the supervisor by SIGKILL after a fifth of the samples, a worker after two fifths, and
the supervisor by SIGTERM after three fifths, and starts the campaign again each time.  It writes
resident memory of the supervisor and of its workers to ``DIR/memory.csv``, which ``memory`` sums
up.  ``commands`` tells time and greatest resident memory of each command about the results.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ringsim.storage.journal import NAME
from ringsim.tables import text_table

TEXT = """
name = "large"
title = "Three-section ring on its last 30 deg, coarse settings"
seed = 1
scene = "ring18"
fidelity = "frame"
check_every = 5000
max_failed = 1000
design = { kind = "random", samples = 100_000 }

[set]
"structure.sections" = 3
boom = "none"
net = "none"
"solver.tolerance" = 0.1
"structure.opening_angle" = 150.0
"solver.end_time" = 0.75
"record.interval" = 0.0125

[inputs]
"rods.young_modulus" = { kind = "normal", mean = 120e9, standard_deviation = 6e9 }
"loads.force" = { kind = "uniform", low = 0.01, high = 0.02 }
"joints.vjoint.viscous" = { kind = "uniform", low = 0.0, high = 0.001, each_section = true }

[outputs]
spread = "asynchrony_max / deployment_time"

[requirements]
outcome = { is = "deployed", probability = 0.95, confidence = 0.95 }
deployment_time = { max = 0.7, probability = 0.9, confidence = 0.95 }
"""
ROLES = ("supervisor", "worker")
PERIOD = 10.0
"""Seconds between two looks at the memory."""


def children(pid: int) -> list[int]:
    """Processes that another one has started."""
    try:
        return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def resident(pid: int) -> float:
    """Resident memory, MB; 0 if the process is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


@dataclass
class Campaign:
    """The campaign in a folder, and the process that supervises it now."""

    folder: Path
    samples: int
    workers: int
    begin: float = field(default_factory=time.monotonic)
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it, or go on with it."""
        words = ["campaign", str(self.folder / "large.toml"), "--samples", str(self.samples)]
        words += ["--workers", str(self.workers), "--out", str(self.folder / "out")]
        log = (self.folder / "log.txt").open("ab")
        command = [sys.executable, "-m", "ringsim", *words]
        self.process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        self.note("started")

    def done(self) -> int:
        """Samples done, by the file that tells others of the progress."""
        try:
            told = json.loads((self.folder / "out" / "progress-all.json").read_text())
        except (OSError, ValueError):
            return 0
        return int(told["done"])

    def look(self) -> None:
        """Write a row of memory for each process."""
        pid = self.process.pid
        rows = [(ROLES[0], pid), *((ROLES[1], each) for each in children(pid))]
        with (self.folder / "memory.csv").open("a", newline="") as file:
            write = csv.writer(file).writerow
            for role, each in rows:
                write((f"{time.monotonic() - self.begin:.0f}", self.done(), role, each,
                       f"{resident(each):.1f}"))  # fmt: skip

    def note(self, text: str) -> None:
        """Tell what happens, and when."""
        print(f"{time.monotonic() - self.begin:6.0f} s  {self.done():6d} done, load "
              f"{os.getloadavg()[0]:.1f}: {text}", flush=True)  # fmt: skip

    def follow(self, until: int) -> bool:
        """Look on until so many samples are done, or it ends: whether it still runs."""
        last = -PERIOD
        while self.process.poll() is None:
            if self.done() >= until:
                return True
            if time.monotonic() - last >= PERIOD:
                last = time.monotonic()
                self.look()
            time.sleep(0.2)
        return False


def kill_supervisor(campaign: Campaign) -> None:
    """End the supervisor without a word, and go on."""
    campaign.process.kill()
    campaign.process.wait()
    campaign.note("supervisor killed (SIGKILL)")
    campaign.start()
    time.sleep(20.0)  # until its progress counts what it found


def kill_worker(campaign: Campaign) -> None:
    """End one worker without a word."""
    os.kill(children(campaign.process.pid)[0], signal.SIGKILL)
    campaign.note("worker killed (SIGKILL)")


def stop_supervisor(campaign: Campaign) -> None:
    """Ask the supervisor to stop, and go on."""
    campaign.process.terminate()
    code = campaign.process.wait()
    campaign.note(f"supervisor stopped (SIGTERM), exit code {code}")
    campaign.start()
    time.sleep(20.0)


EVENTS: tuple[tuple[float, Callable[[Campaign], None]], ...] = (
    (0.2, kill_supervisor), (0.4, kill_worker), (0.6, stop_supervisor),
)  # fmt: skip


def run(given: argparse.Namespace) -> None:
    """The campaign with its kills."""
    given.folder.mkdir(parents=True)
    (given.folder / "large.toml").write_text(TEXT)
    campaign = Campaign(given.folder, given.samples, given.workers)
    campaign.start()
    for share, event in EVENTS:
        if campaign.follow(int(share * given.samples)):
            event(campaign)
    campaign.follow(given.samples)
    campaign.note("all samples done")
    campaign.follow(given.samples + 1)  # while it merges
    campaign.note(f"ended with exit code {campaign.process.wait()}")


COMMANDS: dict[str, tuple[str, ...]] = {
    "status, nothing remembered": ("status", "out"),
    "status": ("status", "out"),
    "merge": ("merge", "out"),
    "analyse": ("analyse", "out"),
    "plot": ("plot", "out/campaign.nc"),
    "report": ("report", "out", "--out", "report.html"),
    "dossier": ("dossier", "out", "--out", "dossier.html"),
    "compare with itself": ("compare", "out", "out"),
    "replay of one sample": ("replay", "out", "4711"),
}
"""What follows a campaign, in this order."""


def measured(words: tuple[str, ...], folder: Path) -> tuple[int, float, float, float]:
    """Exit code, elapsed and processor seconds, and greatest resident memory in MB of a command."""
    code = (
        "import resource, subprocess, sys; "
        "done = subprocess.run(sys.argv[1:]); "
        "used = resource.getrusage(resource.RUSAGE_CHILDREN); "
        "print(done.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss, file=sys.stderr)"
    )
    begin = time.perf_counter()
    told = subprocess.run(
        [sys.executable, "-c", code, sys.executable, "-m", "ringsim", *words],
        cwd=folder, check=True, capture_output=True, text=True,
    )  # fmt: skip
    spent = time.perf_counter() - begin
    (folder / f"{words[0]}.txt").write_text(told.stdout)
    failed, used, kilobytes = told.stderr.split()[-3:]
    return int(failed), spent, float(used), float(kilobytes) / 1024


def commands(given: argparse.Namespace) -> None:
    """Every command about the campaign, and what its folder takes."""
    (given.folder / "out" / NAME).unlink(missing_ok=True)
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
    rows = []
    for name, words in COMMANDS.items():
        failed, spent, used, memory = measured(words, given.folder)
        rows.append((name, f"{spent:.1f}", f"{used:.1f}", f"{memory:.0f}", str(failed)))
        print(*rows[-1], flush=True)
    head = ("command", "elapsed, s", "processor, s", "memory, MB", "exit code")
    print("\n".join(text_table(head, rows)))
    files = [path for path in (given.folder / "out").rglob("*") if path.is_file()]
    sizes = {path.name: path.stat().st_size / 1e6 for path in files}
    print(f"{len(files)} files, {sum(sizes.values()):.0f} MB, of these campaign.nc "
          f"{sizes['campaign.nc']:.0f} MB; load {os.getloadavg()[0]:.1f}")  # fmt: skip


def memory(given: argparse.Namespace) -> None:
    """Resident memory at the start, the quarters, and the end of ``memory.csv``."""
    with (given.folder / "memory.csv").open() as file:
        looks = [(int(done), role, float(size)) for _, done, role, _, size in csv.reader(file)]
    most = max(done for done, *_ in looks)
    for share in (0.01, 0.25, 0.5, 0.75, 1.0):
        near = min((done for done, *_ in looks), key=lambda done: abs(done - share * most))
        there = {r: [s for d, role, s in looks if (d, role) == (near, r)] for r in ROLES}
        told = ", ".join(f"{role} {max(sizes):.0f} MB" for role, sizes in there.items() if sizes)
        print(f"{near:6d} samples done: {told}")


def main() -> None:
    """Run the campaign, or tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(required=True)
    for act in (run, commands, memory):
        verb = verbs.add_parser(act.__name__)
        verb.add_argument("folder", type=Path)
        verb.set_defaults(act=act)
        if act is run:
            verb.add_argument("--samples", type=int, default=100_000)
            verb.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    given.act(given)


if __name__ == "__main__":
    main()
