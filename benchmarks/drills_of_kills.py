"""Drills in which processes are killed."""

from __future__ import annotations

import contextlib
import functools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from drills import (
    CAMPAIGN,
    CHANCE,
    SAMPLES,
    SHORT,
    Skipped,
    drafts,
    drill,
    require,
    require_whole,
    same_values,
    sound,
)
from preloaded import ringsim

from campaign_bench import MPIEXEC, Bench, records
from killing import alive, children_of, is_solver, strike, targets_of, until


@functools.cache
def optimum() -> tuple[Path, float]:
    """A folder with a short optimisation that has ended, and how long that took."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "optimisation"))
    from test_optimise import FILE

    folder = Path(tempfile.mkdtemp(prefix="ringsim-drills-"))
    (folder / "best.toml").write_text(FILE)
    begin = time.monotonic()
    done = ringsim("optimise", "best.toml", "--workers", 2, "--out", "best", folder=folder)
    assert done.returncode == 0, done.stderr
    return folder, time.monotonic() - begin


@functools.cache
def test_stand() -> Path:
    """A folder with a short calibration, and the readings that it takes."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "measured"))
    from test_calibrate import TRUTH, write_file, write_test

    folder = Path(tempfile.mkdtemp(prefix="ringsim-drills-"))
    write_test(folder, TRUTH)
    write_file(folder, runs=32, stages=2)
    return folder


# Kills.


def killed_campaign(folder: Path, kind: str, ranks: int = 0, kills: int = 4) -> str:
    """Kill processes of a campaign some times, and let the same command finish it."""
    if ranks and MPIEXEC is None:
        raise Skipped("there is no mpiexec")
    bench = Bench(folder)
    (folder / "drill.toml").write_text(CAMPAIGN)
    words = ("campaign", "drill.toml", "--out", "out", *(() if ranks else ("--workers", 2)))
    hits, process = 0, None
    for number in range(kills):
        if process is None:
            process = bench.start(*words, ranks=ranks, solver="", fresh=True)
        least = SAMPLES * (number + CHANCE.random()) / (kills + 1)
        until(lambda p=process, n=least: records(folder / "out") >= n or p.poll() is not None, 60.0)
        below = children_of(process.pid)
        solvers = [pid for pid in below if is_solver(pid)]
        targets = targets_of(process, kind, CHANCE)
        hit = strike(targets, below if kind == "tree" else [])
        if records(folder / "out") >= SAMPLES:
            hit = False  # what had finished all samples before may end as if nothing were
        hits += hit
        if hit and kind not in ("solver", "all solvers"):
            process.communicate(timeout=60)
            require(process.returncode != 0, "exit code 0 of what was killed")
            require(
                until(lambda s=solvers: not any(map(alive, s))), "solvers outlived their parent"
            )
            process = None
        require_whole(folder)
    if process is not None:
        process.communicate(timeout=120)
        require(process.returncode == 0, f"exit code {process.returncode} though workers died only")
    require(hits, "nothing was there to be killed")
    again = bench.start(*words, ranks=ranks, solver="", fresh=True)
    told, _ = again.communicate(timeout=120)
    require(again.returncode == 0, told)
    require(same_values(folder / "out/campaign.nc", sound() / "out/campaign.nc"), "other values")
    require_whole(folder)
    require(not drafts(folder), f"{drafts(folder)} drafts are left")
    return f"{hits} kills; the same command finished it, all values equal"


for kind, ranks, what in (
    ("manager", 0, "supervisor"), ("solver", 0, "worker"), ("all solvers", 0, "all workers"),
    ("tree", 0, "all processes"), ("rank", 2, "MPI rank"), ("launcher", 2, "MPI launcher"),
    ("solver", 2, "worker below MPI"),
):  # fmt: skip
    drill(
        "kills", f"kill {what}", f"kill -9 of the {what} of a campaign, 4 times",
        "the same command finishes it; campaign.nc as if never killed",
    )(functools.partial(killed_campaign, kind=kind, ranks=ranks))  # fmt: skip


def stopped_writing(process: subprocess.Popen[str], folder: Path, seconds: float) -> bool:
    """Stop a process while a draft of its own stands in a folder; False if it ended before."""
    old, end = {*folder.rglob("*.draft")}, time.monotonic() + seconds
    while process.poll() is None and time.monotonic() < end:
        if {*folder.rglob("*.draft")} - old:
            process.send_signal(signal.SIGSTOP)
            if {*folder.rglob("*.draft")} - old:
                return True
            process.send_signal(signal.SIGCONT)  # it was faster
        time.sleep(0.001)
    return False


def killed_command(folder: Path, words: tuple[str, ...], product: str, kills: int = 5) -> str:
    """Kill a command while it writes and at random times, and run it once more."""
    shutil.copytree(test_stand() if "cal.toml" in words else sound(), folder, dirs_exist_ok=True)
    bench, begin = Bench(folder), time.monotonic()
    done = bench.run(*words, solver="", fresh=True)
    seconds, hits, writing = time.monotonic() - begin, 0, 0
    shutil.copytree(folder, folder.with_name("before"), dirs_exist_ok=True)
    before = folder.with_name("before") / product
    for number in range(kills):
        if number % 2 == 0:  # a first time, and over what is there
            target = folder / product
            shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
        process = bench.start(*words, solver="", fresh=True)
        if number < kills - 2:
            writing += stopped_writing(process, folder, seconds + 60.0)
        else:
            time.sleep(seconds * CHANCE.random())
        hits += process.poll() is None
        process.kill()
        process.communicate()
        require_whole(folder)
        if product.endswith(".nc") and (folder / product).exists():
            require(same_values(folder / product, before), "other values at the place of the file")
    require(writing, "never struck while it wrote")
    for draft in folder.rglob("*.draft"):  # whose writer might live, were it younger
        os.utime(draft, (time.time() - 7200.0,) * 2)
    done = bench.run(*words, solver="", fresh=True)
    require("Traceback" not in done, done)
    if product.endswith(".nc"):
        require(same_values(folder / product, before), "other values")
    elif before.is_dir():
        names = [sorted(p.name for p in each.iterdir() if not p.name.endswith(".draft"))
                 for each in (folder / product, before)]  # fmt: skip
        require(names[0] == names[1], f"{names[0]} instead of {names[1]}")
    require_whole(folder)
    require(
        not (left := drafts(folder)), f"{hits} kills; whole in the end, but {left} drafts are left"
    )
    return f"{hits} kills, {writing} while it wrote; whole files only, the same command does it"


COMMANDS = {
    "merge": (("merge", "out"), "out/campaign.nc"),
    "plot": (("plot", "out/campaign.nc", "--out", "figures"), "figures"),
    "report": (("report", "out", "--out", "report.html"), "report.html"),
    "replay": (("replay", "out", "3", "--save", "replay.nc"), "replay.nc"),
    "export": (("export", "out", "--format", "csv,mat", "--out", "tables"), "tables"),
    "run": (("run", "truss2", *SHORT, "--out", "new.nc"), "new.nc"),
    "analyse": (("analyse", "out", "--out", "analysis.nc"), "analysis.nc"),
    "dossier": (("dossier", "out", "--out", "dossier.html"), "dossier.html"),
    "compare": (("compare", "out", "out", "--out", "both.nc", "--report", "both.html"), "both.nc"),
    "calibrate": (("calibrate", "cal.toml", "--workers", "2", "--out", "cal"), "cal"),
}
for name, (words, product) in COMMANDS.items():
    drill(
        "kills", f"kill {name}", f"kill -9 of `{name}`, 3 times while it writes, 2 at random",
        "no half-written file; the same command does it",
    )(functools.partial(killed_command, words=words, product=product))  # fmt: skip


@drill("kills", "kill optimise", "kill -9 of `optimise` and all below it, 3 times",
       "the same command finishes it with the same front")  # fmt: skip
def killed_optimisation(folder: Path) -> str:
    before, seconds = optimum()
    shutil.copy(before / "best.toml", folder)
    bench, hits = Bench(folder), 0
    words = ("optimise", "best.toml", "--workers", 2, "--out", "best")
    for _ in range(3):
        process = bench.start(*words, fresh=True)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(2.0 + 0.3 * seconds * CHANCE.random())
        hits += process.poll() is None
        strike([process.pid], children_of(process.pid))
        process.communicate()
        require_whole(folder)
    require(hits, "nothing was there to be killed")
    bench.run(*words, timeout=300)
    (front,) = (path.name for path in (before / "best").glob("*.nc"))
    require(same_values(folder / "best" / front, before / "best" / front), "another front")
    require(not drafts(folder), f"{drafts(folder)} drafts are left")
    return f"{hits} kills; the same front"
