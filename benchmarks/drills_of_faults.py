"""Drills with full disks, closed streams, signals, small limits, odd names and wrong clocks."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

from drills import (
    CAMPAIGN,
    CHANCE,
    SAMPLES,
    SHORT,
    Faults,
    Skipped,
    drafts,
    drill,
    limited,
    require,
    require_whole,
    same_values,
    sound,
)
from fuzz import fault_of, page_fault
from preloaded import ringsim

from campaign_bench import Bench, records
from killing import children_of, strike, until

MERGED = "out/campaign.nc"


def require_good(
    done: subprocess.CompletedProcess[str], names: tuple[str, ...] = (),
    codes: tuple[int, ...] = (0, 2, 3),
) -> None:  # fmt: skip
    """That a command ended as ``fuzz.fault_of`` wants it."""
    require(not (fault := fault_of(done, names, codes)), fault)


def writers(own: Path) -> dict[str, tuple[str, ...]]:
    """Commands that write something, into the folder that they run in; ``own`` has a campaign."""
    made = str(sound() / "out")
    return {
        "run": ("run", "truss2", *SHORT, "--out", "run.nc"),
        "campaign": ("campaign", str(sound() / "drill.toml"), "--samples", "8", "--out", "few"),
        "merge": ("merge", str(own)),
        "analyse": ("analyse", made, "--out", "analysis.nc"),
        "report": ("report", made), "dossier": ("dossier", made),
        "plot": ("plot", str(sound() / "run.nc"), "--out", "."),
        "export": ("export", made, "--format", "csv,mat", "--out", "."),
        "compare": ("compare", made, made, "--report", "both.html", "--out", "both.nc"),
        "replay": ("replay", made, "1", "--save", "replay.nc"),
        "scenes": ("scenes", "truss2", "--out", "scene.toml"),
    }  # fmt: skip


def unmerged(folder: Path) -> Path:
    """A copy of the campaign in a folder, not merged."""
    shutil.copytree(sound() / "out", folder / "own")
    (folder / "own/campaign.nc").unlink()
    return folder / "own"


@contextlib.contextmanager
def mounted(folder: Path, *options: str) -> Iterator[Path]:
    folder.mkdir(exist_ok=True)
    done = subprocess.run(["mount", *options, str(folder)], capture_output=True, text=True)
    if done.returncode:
        raise Skipped(f"nothing can be mounted: {done.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


@drill("faults", "full disk", "every command that writes, with 0, 16 and 200 kB left on the disk",
       "refused in one line or done; no half-written file or draft; done with room")  # fmt: skip
def full_disk(folder: Path) -> str:
    refused, faults = 0, Faults()
    with mounted(folder / "disk", "-t", "tmpfs", "-o", "size=20m", "tmpfs") as disk:
        for name, kilobytes in itertools.product(writers(disk), (0, 16, 200)):
            for path in disk.iterdir():
                shutil.rmtree(path) if path.is_dir() else path.unlink()
            words = writers(unmerged(disk))[name]
            free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize
            (disk / "ballast").write_bytes(bytes(free - 1024 * kilobytes))
            done = ringsim(*words, folder=disk)
            (disk / "ballast").unlink()
            with faults.within(name, "with", kilobytes, "kB"):
                require_good(done, ("cannot be written",))
                refused += done.returncode == 2
                require_whole(disk)
                require(not drafts(disk), "a draft takes room")
                require_good(ringsim(*words, folder=disk), codes=(0,))
    return faults.ended(f"{refused} of {faults.tried} commands refused, the others done")


@drill("faults", "file size limit", "every command that writes, with `ulimit -f 8` (8 kB)",
       "refused in one line that tells the limit, or done")  # fmt: skip
def file_limit(folder: Path) -> str:
    faults, refused = Faults(), 0
    for name, words in writers(unmerged(folder)).items():
        with faults.within(name):
            done = limited("ulimit -f 8", words, folder)
            require_good(done, ("ulimit -f",))
            refused += done.returncode == 2
            require_whole(folder)
    return faults.ended(f"{refused} of {faults.tried} commands refused, the others done")


@drill("faults", "read-only folder", "every command, in a folder that is mounted read-only",
       "what writes is refused in one line, what reads works")  # fmt: skip
def read_only(folder: Path) -> str:
    (folder / "disk").mkdir()
    own, faults = unmerged(folder / "disk"), Faults()
    merged = shutil.copytree(sound() / "out", folder / "disk/merged")
    with mounted(folder / "disk", "--bind", str(folder / "disk")) as disk:
        subprocess.run(["mount", "-o", "remount,bind,ro", str(disk)], check=True)
        for name, words in writers(own).items():
            with faults.within(name):
                done = ringsim(*words, folder=disk)
                require_good(done, ("cannot be written", "Read-only"), codes=(2,))
        for words in (
            ("status", own),
            ("status", merged),
            ("analyse", merged),
            ("replay", merged, 1),
            ("explain", "time"),
            ("check", "truss2"),
        ):
            with faults.within(*words):
                require_good(ringsim(*words, folder=disk), codes=(0,))
    return faults.ended(f"{len(writers(own))} writers refused, 6 readers worked")


@drill(
    "faults",
    "standard streams",
    "stdout or stderr closed, full (/dev/full), or its reader gone",
    "the work is done; a full stdout is told with exit code 2, all else is 0",
)
def streams(folder: Path) -> str:
    made, faults = sound() / "out", Faults()
    cases = {
        ">&-": 0, "2>&-": 0, "<&-": 0, ">/dev/full": 2, "2>/dev/full": 0, ">&- 2>&- <&-": 0,
        "| head -c 1": 0,
    }  # fmt: skip
    commands = (
        (("analyse", made, "--out", "a.nc"), "a.nc"),
        (("run", "truss2", *SHORT, "--out", "r.nc"), "r.nc"),
        (("campaign", sound() / "drill.toml", "--samples", 3, "--out", "c"), "c/campaign.nc"),
    )
    for (end, code), (words, product) in itertools.product(cases.items(), commands):
        with faults.within(words[0], end):
            done = limited("set -o pipefail", words, folder, end)
            # What a campaign tells goes to stderr.
            require_good(done, codes=(0 if words[0] == "campaign" else code,))
            require((folder / product).exists(), "wrote nothing")
        target = folder / product.split("/")[0]
        shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
    return faults.ended(f"{faults.tried} commands did their work")


@drill("faults", "signals", "SIGHUP, SIGTERM, SIGINT, SIGUSR1 in a campaign, and two in a row",
       "exit code 130; the same command finishes it, campaign.nc as if never stopped")  # fmt: skip
def signals(folder: Path) -> str:
    (folder / "drill.toml").write_text(CAMPAIGN)
    bench, faults = Bench(folder), Faults()
    # So many samples that no machine has run them all before the signal comes.
    words = ("campaign", "drill.toml", "--workers", 2, "--out", "out", "--samples", 400)
    bench.run(*words[:-3], "whole", *words[-2:], solver="")
    sent = [
        (signal.SIGHUP,),
        (signal.SIGTERM,),
        (signal.SIGINT,),
        (signal.SIGUSR1,),
        (signal.SIGINT, signal.SIGINT),
        (signal.SIGTERM, signal.SIGINT),
    ]
    for numbers in sent:
        shutil.rmtree(folder / "out", ignore_errors=True)
        process = bench.start(*words, solver="", fresh=True)
        until(lambda p=process: records(folder / "out") >= 5 or p.poll() is not None, 60.0)
        for number in numbers:
            process.send_signal(number)
            time.sleep(0.05)
        told, _ = process.communicate(timeout=60)
        with faults.within(*(number.name for number in numbers)):
            require(process.returncode == 130, f"exit code {process.returncode}: {told[-200:]}")
            require("Traceback" not in told, told[-300:])
            require_whole(folder)
            require(not drafts(folder), "drafts are left")
            bench.run(*words, solver="")
            whole = folder / MERGED.replace("out", "whole")
            require(same_values(folder / MERGED, whole), "other values")
    return faults.ended(f"{len(sent)} times stopped and finished")


@drill("faults", "signals elsewhere", "SIGTERM, SIGHUP and SIGINT in `run`, `plot` and `report`",
       "ends at once without a traceback, half-written file or draft")  # fmt: skip
def other_signals(folder: Path) -> str:
    bench, faults = Bench(folder), Faults()
    long = {**writers(folder), "run": ("run", "ring18-cable", "--out", "run.nc")}
    numbers = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
    for name, number, wait in itertools.product(("run", "plot", "report"), numbers, (0.3, 2.5)):
        process = bench.start(*long[name], fresh=True)
        time.sleep(wait + CHANCE.random())
        process.send_signal(number)
        told, _ = process.communicate(timeout=20)
        with faults.within(name, number.name, "after", wait, "s"):
            require(process.returncode in (130, 0, -number), f"exit code {process.returncode}")
            require("Traceback" not in told, told[-300:])
            require_whole(folder)
            require(not drafts(folder), "a draft is left")
    return faults.ended(f"{faults.tried} commands ended so")


@drill("faults", "few open files", "`campaign`, `status`, `report` with `ulimit -n` 20, 32 and 64",
       "done, or refused in one line")  # fmt: skip
def few_files(folder: Path) -> str:
    codes, faults, made = [], Faults(), sound() / "out"
    few = ("campaign", sound() / "drill.toml", "--samples", 3, "--workers", 2, "--out")
    for number in (20, 32, 64):
        for words in ((*few, f"few{number}"), ("status", made), ("report", made)):
            with faults.within(words[0], "with", number, "files"):
                done = limited(f"ulimit -n {number}", words, folder)
                require_good(done)
                codes.append(done.returncode)
    return faults.ended(f"{codes.count(0)} done, {codes.count(2)} refused")


@drill("faults", "little memory", "`run`, `campaign`, `report` with `ulimit -v` 250 MB to 1.2 GB",
       "done, or ended with exit code 2 or 3 and without a traceback")  # fmt: skip
def little_memory(folder: Path) -> str:
    codes, faults = [], Faults()
    for megabytes in (250, 400, 460, 600, 900, 1200):
        few = ("--samples", 3, "--out", f"few{megabytes}")
        for words in (
            ("run", "truss2", *SHORT, "--out", "run.nc"),
            ("report", sound() / "out"),
            ("campaign", sound() / "drill.toml", *few),
        ):
            with faults.within(words[0], "with", megabytes, "MB"):
                done = limited(f"ulimit -v {megabytes}000", words, folder)
                require_whole(folder)
                require_good(done)
                codes.append(done.returncode)
    return faults.ended(f"{codes.count(0)} done, {len(codes) - codes.count(0)} refused or failed")


NAMES = (
    "with space", "-dash", "a'b\"c", "$(touch hit)", "*[a]?", "%s{0}", "two\nlines",
    "<script>alert(1)<script>", "x" * 200,
)  # fmt: skip


@drill(
    "faults",
    "names of folders",
    f"a campaign and its readers in {len(NAMES)} folders of odd names",
    "all work as elsewhere",
)
def odd_names(folder: Path) -> str:
    faults = Faults()
    for name in NAMES:
        own, out = shutil.copytree(sound(), folder / name), f"./{name}/out"
        for words in (
            ("campaign", f"./{name}/drill.toml", "--samples", 3, f"--out=./{name}/few"),
            ("status", out),
            ("merge", "--", f"{name}/out"),
            ("analyse", "--", f"{name}/out"),
            ("report", out, f"--out=./{name}/r.html"),
            ("plot", f"./{name}/run.nc"),
            ("compare", "--", f"{name}/out", f"{name}/few"),
            ("export", f"./{name}/run.nc"),
            ("replay", out, 1, f"--save=./{name}/re.nc"),
            ("dossier", out, f"--out=./{name}/d.html"),
        ):
            with faults.within(repr(name), words[0]):
                require_good(ringsim(*words, folder=folder), codes=(0,))
                require(not (fault := page_fault(own)), fault)
    require(not (folder / "hit").exists(), "a name was run")
    return faults.ended(f"{faults.tried} commands worked")


@drill("faults", "names in the locale C", "a folder with a name that is not ASCII, under LC_ALL=C",
       "done, or refused in one line that tells the cure")  # fmt: skip
def locale_c(folder: Path) -> str:
    codes, faults = [], Faults()
    own = shutil.copytree(sound(), folder / "\u00e9 \u00fc")
    plain_c = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    for extra in ({"LC_ALL": "C"}, plain_c):
        for words in (
            ("status", "out"),
            ("campaign", "drill.toml", "--samples", 3, "--out", "few"),
            ("report", own / "out"),
            ("plot", own / "run.nc"),
            ("analyse", own / "out"),
        ):
            with faults.within(words[0], extra):
                done = limited("", words, own, environment=extra)
                require_good(done, ("PYTHONUTF8",), codes=(0, 2))
                codes.append(done.returncode)
    return faults.ended(f"{codes.count(0)} done, {codes.count(2)} refused")


@drill(
    "faults",
    "clock set back",
    "a campaign killed half-way, finished with a clock ten years back",
    "campaign.nc as if nothing had happened; `status` tells no time below zero",
)
def clock_back(folder: Path) -> str:
    (folder / "drill.toml").write_text(CAMPAIGN)
    bench, faults = Bench(folder), Faults()
    words = ("campaign", "drill.toml", "--workers", 2, "--out", "out")
    process = bench.start(*words, solver="", fresh=True)
    until(lambda: records(folder / "out") >= SAMPLES // 3 or process.poll() is not None, 60.0)
    strike([process.pid], children_of(process.pid))
    process.communicate()
    clock = "import time\nnow = time.time\ntime.time = lambda: now() - 3.15e8\n"
    (folder / "sitecustomize.py").write_text(clock)
    bench.extra["PYTHONPATH"] = f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    with faults.within("status"):
        told = bench.run("status", "out", fresh=True)
        require(not re.search(r"-\d+(\.\d+)? (s|min|h|d)\b", told), told)
    with faults.within("campaign"):
        bench.run(*words, solver="", fresh=True)
        require(same_values(folder / MERGED, sound() / MERGED), "other values")
    for path in (folder / "out").rglob("*.journal"):
        os.utime(path, (4e9, 4e9))
    with faults.within("journals of the year 2096"):
        bench.run("merge", "out", fresh=True)
        require(same_values(folder / MERGED, sound() / MERGED), "other values")
    return faults.ended("finished; all values equal")
