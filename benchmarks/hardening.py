"""What becomes of ringsim where processes are killed, disks fill up and files are hostile.

python benchmarks/hardening.py [NAMES...] [--cases N] [--jobs N]
    [--out docs/evidence/hardening.md]

To be run before each release, on a machine where nothing is lost: as root it mounts small file
systems below its own folder.  NAMES are groups (kills, faults, files, fuzz) or parts of drills'
names.  Prints a row a drill, and ends with exit code 1 if any does not hold; ``--out`` writes the
page.  What only root may do is skipped for others, and says so.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import drills_of_faults  # noqa: F401
import drills_of_files
import drills_of_kills  # noqa: F401
from drills import DRILLS, Skipped
from stamp import stamp

TITLE = """# Kills, full disks and hostile files

{stamp}

Each row is a drill of `benchmarks/hardening.py`, which is run before a release: what was done to
a small campaign of the frame engine, what must become of it, and what did.

"""


def row(place_in_table: int) -> tuple[list[str], bool]:
    """The table's row of one drill, and whether it held."""
    drill = DRILLS[place_in_table]
    with tempfile.TemporaryDirectory(prefix="ringsim-drill-") as place:
        folder = Path(place) / "own"
        folder.mkdir()
        try:
            happened, held = drill.run(folder), "yes"
        except Skipped as why:
            happened, held = str(why), "skipped"
        except AssertionError as fault:
            happened, held = " ".join(str(fault).split())[:1500], "no"
        except subprocess.TimeoutExpired as late:
            happened, held = f"no end within {late.timeout:g} s: {late.cmd}"[:1500], "no"
    cells = [drill.name, drill.did, drill.expected, happened.replace("|", "\\|"), held]
    return cells, held != "no"


def main() -> int:
    """Exit code 1 if any drill does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help="groups, or parts of names")
    parser.add_argument("--cases", type=int, help="cases of each kind of fuzzing")
    parser.add_argument("--jobs", type=int, default=2, help="drills at once")
    parser.add_argument("--out", type=Path, help="page to write")
    given = parser.parse_args()
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup has it ignored, also in what is drilled
    groups = ("kills", "faults", "files", "fuzz")
    DRILLS.sort(key=lambda each: groups.index(each.group))
    if given.cases:
        drills_of_files.CASES = dict.fromkeys(drills_of_files.CASES, given.cases)
    chosen = [place for place, each in enumerate(DRILLS) if not given.names
              or any(name == each.group or name in each.name for name in given.names)]  # fmt: skip
    lines, good = ["| drill | done | expected | happened | held |", "|---|---|---|---|---|"], True
    print(*lines, sep="\n", flush=True)
    with ProcessPoolExecutor(given.jobs) as drilling:  # forked, so that they know all drills
        for cells, held in drilling.map(row, chosen):
            lines.append(f"| {' | '.join(cells)} |")
            print(lines[-1], flush=True)
            good &= held
    if given.out is not None:
        cases = f"--cases {given.cases} " * bool(given.cases)
        made = stamp(f"python benchmarks/hardening.py {cases}--out docs/evidence/hardening.md")
        given.out.write_text(TITLE.format(stamp=made) + "\n".join(lines) + "\n", encoding="utf-8")
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
