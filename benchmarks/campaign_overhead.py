"""What a campaign costs beside the simulations: overhead, efficiency, many ranks.

python benchmarks/campaign_overhead.py [overhead] [efficiency] [scheduler] [look] [ranks]

Figures depend on what else the machine does: the load is printed with them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import netCDF4
import numpy as np

from ringsim.storage.journal import FOLDER, Journal, survey
from ringsim.storage.result import Result, pack
from ringsim.variables import Status

HERE = Path(__file__).parent
CAMPAIGN = """
name = "bench"
scene = "ring18"
design = {{ kind = "random", samples = {samples} }}
[set]
"rods.damping" = {seconds}
[inputs]
"rods.young_modulus" = {{ kind = "normal", mean = 120e9, standard_deviation = 6e9 }}
"loads.force" = {{ kind = "uniform", low = 0.01, high = 0.02 }}
"""


def tree(pid):
    found = [pid]
    try:
        below = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return found
    return found + [deep for child in below for deep in tree(int(child))]


class Watch(threading.Thread):
    """Looks at a process tree now and then: greatest memory, processor time by process."""

    def __init__(self, pid):
        super().__init__(daemon=True)
        self.pid, self.peak, self.total_peak, self.seconds, self.words = pid, 0, 0, {}, {}

    def run(self):
        tick, page = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")
        while Path(f"/proc/{self.pid}").exists():
            total = 0
            for pid in tree(self.pid):
                try:
                    stat = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
                    held = int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * page
                    self.words[pid] = Path(f"/proc/{pid}/cmdline").read_bytes()
                except OSError:
                    continue
                self.seconds[pid] = (int(stat[11]) + int(stat[12])) / tick
                self.peak, total = max(self.peak, held), total + held
            self.total_peak = max(self.total_peak, total)
            time.sleep(0.2)


def run(samples, seconds, solver, *, workers=0, ranks=0):
    folder = Path(tempfile.mkdtemp(prefix="ringsim-bench-"))
    (folder / "bench.toml").write_text(CAMPAIGN.format(samples=samples, seconds=seconds))
    command = [sys.executable, "-m", "ringsim", "campaign", "bench.toml", "--out", "out"]
    command += ["--solver", f"campaign_solvers:{solver}"]
    command += ["--workers", str(workers)] if workers else []
    command = ["mpiexec", "-n", str(ranks), *command] if ranks else command
    begin, before = time.perf_counter(), os.times()
    process = subprocess.Popen(
        command, cwd=folder, env=os.environ | {"PYTHONPATH": str(HERE)}, stderr=subprocess.DEVNULL
    )
    watch = Watch(process.pid)
    watch.start()
    if process.wait() != 0:
        raise SystemExit(f"{' '.join(command)} failed with {process.returncode}")
    wall, after = time.perf_counter() - begin, os.times()
    watch.join()
    with netCDF4.Dataset(folder / "out" / "campaign.nc") as result:
        assert (result["status"][:] == 0).all()
    shutil.rmtree(folder)
    used = after.children_user + after.children_system
    used -= before.children_user + before.children_system
    return wall, used, watch


def who(workers, ranks):
    return f"{ranks} MPI ranks" if ranks else f"{workers} local workers"


def overhead():
    few, many = 500, 8500
    for workers, ranks in ((1, 0), (2, 0), (0, 2)):
        short, long = (
            run(count, 0.0, "nothing", workers=workers, ranks=ranks) for count in (few, many)
        )
        wall, used = ((long[k] - short[k]) / (many - few) * 1e3 for k in (0, 1))
        print(
            f"no-op samples, {who(workers, ranks)}: {wall:.2f} ms a sample elapsed, "
            f"{used:.2f} ms of processor time",
            flush=True,
        )


def bare_loops(seconds):
    """Elapsed time of two processes that do nothing but use so much processor time each."""
    code = f"import time\nwhile time.process_time() < {seconds}: sum(range(1000))"
    begin = time.perf_counter()
    both = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(2)]
    assert [process.wait() for process in both] == [0, 0]
    return time.perf_counter() - begin


def efficiency():
    few, many = 10, 70
    for workers, ranks in ((2, 0), (0, 2)):
        short, _, _ = run(few, 1.0, "busy", workers=workers, ranks=ranks)
        bare = bare_loops((many - few) // 4)
        wall, _, watch = run(many, 1.0, "busy", workers=workers, ranks=ranks)
        bare += bare_loops((many - few) // 4)
        supervising = sum(s for pid, s in watch.seconds.items() if is_supervisor(watch, pid))
        print(
            f"{many - few} samples of 1 s of processor time, {who(workers, ranks)}: "
            f"{wall - short:.1f} s, two bare loops of the same work {bare:.1f} s, efficiency "
            f"{bare / (wall - short):.3f}; starting and merging take "
            f"{short - few * (wall - short) / (many - few):.1f} s once; all supervising "
            f"processes together {supervising:.1f} s of {wall:.0f} s",
            flush=True,
        )


def is_supervisor(watch, pid):
    words = watch.words[pid]
    return b"campaign" in words and b"execution.child" not in words and b"mpiexec" not in words


def scheduler():
    """Processor time of the scheduling rank while 60 s pass, starting and merging taken off."""
    spent = []
    for samples in (2, 122):
        wall, _, watch = run(samples, 1.0, "asleep", ranks=2)
        ranks = [s for pid, s in watch.seconds.items() if is_supervisor(watch, pid)]
        spent.append((wall, max(ranks)))
    share = (spent[1][1] - spent[0][1]) / (spent[1][0] - spent[0][0])
    print(f"busiest rank of 2 while samples of 1 s run: {share:.2%} of a core", flush=True)


def look():
    """Looking at the journals for the first time, and once more."""
    samples, times, angles = 4000, np.linspace(0.0, 60.0, 601), np.linspace(30.0, 180.0, 601)
    noise = np.random.default_rng(1).normal(size=(2, 18, 601))
    arrays = {"plane": np.array(["upper", "lower"]), "section": np.arange(1, 19), "time": times}
    form, body = pack(arrays | {"opening_angle": angles + noise})
    with tempfile.TemporaryDirectory(prefix="ringsim-bench-") as name:
        folder = Path(name)
        (folder / FOLDER).mkdir()
        journal = Journal(folder, "all-rank0")
        for k in range(samples):
            journal.append(Result(k, Status.OK, "locked", seconds=1.0, form=form, body=body))
        journal.close()
        spent = []
        for _ in range(2):
            begin = time.perf_counter()
            assert len(survey(folder, [""] * samples).missing) == 0
            spent.append(time.perf_counter() - begin)
        size = journal.path.stat().st_size
    print(
        f"journals of {samples} samples ({size / 1e6:.0f} MB) looked through in {spent[0]:.3f} s, "
        f"once more in {spent[1]:.4f} s: {spent[0] / spent[1]:.0f} times faster",
        flush=True,
    )


def ranks():
    wall, used, _ = run(1280, 1.0, "asleep", ranks=64)
    print(
        f"64 ranks on {os.cpu_count()} cores, 1280 samples that sleep 1 s: {wall:.1f} s elapsed "
        f"(20 s at least), {used:.0f} s of processor time",
        flush=True,
    )


ALL = {f.__name__: f for f in (overhead, efficiency, scheduler, look, ranks)}

if __name__ == "__main__":
    for name in sys.argv[1:] or ALL:
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
        ALL[name]()
