"""The core under the compiler's sanitizers: no access beyond an array, nothing that C leaves open.

Arrays are numpy's, whose memory comes from malloc, so that what the sanitizer puts around it is
found on either side of each.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ringsim.core import library

GCC = shutil.which("gcc")
FLAGS = (
    "-std=gnu11", "-O0", "-g1", "-fPIC", "-shared", "-Wno-psabi", "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
)  # fmt: skip
START = """
import sys
from pathlib import Path
import numpy as np
from ringsim.core import library
library.files_of = lambda name: [Path(sys.argv[1])]
one = np.ones(9)
"""
RUN = """
from law_scenes import CABLES, FORCES, of_cables, of_forces
from ringsim.simulation import run_frame
for name in sys.argv[2:]:
    scene = of_cables(CABLES[name]) if name in CABLES else of_forces(FORCES[name])
    found = run_frame(scene)
    assert not found.status.failed, (name, found.reason)
    print(name, int(found.values["total_newton_iterations"]))
"""
SCENES = (
    "dry-hinge", "two-elements", "net-sections", "edge-net", "ramps", "prismatic", "arc-1",
    "faults", "both-bar-half", "two-winches", "motor", "boom-and-net", "arc-2-flexible",
)  # fmt: skip
"""Together they go every way through the core that these do, too, as gcov tells."""
OTHERS = (
    "all-joints", "latched-stop", "rigid-fixed", "flexible-free", "capstan-pulleys", "feedback",
    "slack",
)  # fmt: skip


def runtime(name: str) -> str:
    """The sanitizer's own library; empty where the compiler has none."""
    if GCC is None:
        return ""
    told = subprocess.run([GCC, f"-print-file-name={name}"], capture_output=True, text=True)
    return told.stdout.strip() if os.path.isabs(told.stdout.strip()) else ""


Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Runs Python on the sanitized core, whose file is the first argument."""
    if not runtime("libasan.so"):
        pytest.skip("there is no gcc with sanitizers")
    built = tmp_path_factory.mktemp("sanitized") / "_core.so"
    made, sources = f'-DSOURCES="{library.digest()}"', sorted(library.FOLDER.glob("*.c"))
    subprocess.run([str(GCC), *FLAGS, made, *sources, "-o", built, "-lm"], check=True)
    environment = os.environ | {
        "LD_PRELOAD": f"{runtime('libasan.so')}:{runtime('libubsan.so')}",
        # What Python never frees is no leak of the core's, which asks for no memory.
        "ASAN_OPTIONS": "detect_leaks=0",
        "PYTHONPATH": str(Path(__file__).parents[1] / "frame"),
    }

    def run(text: str, *words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", START + text, str(built), *words]
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)

    return run


@pytest.mark.parametrize(
    "scenes",
    [pytest.param(SCENES, id="few"), pytest.param(OTHERS, id="others", marks=pytest.mark.slow)],
)
def test_nothing_is_beyond_an_array_or_undefined(sanitized: Run, scenes: tuple[str, ...]) -> None:
    done = sanitized(RUN, *scenes)
    assert done.returncode == 0, done.stderr[-4000:]
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(scenes)


def test_the_sanitizer_finds_what_is_beyond_an_array(sanitized: Run) -> None:
    """So that the test above can fail: room for one change, where two are made."""
    done = sanitized("library.call('learn', one, one, np.ones(1), 1, one.copy())")
    assert done.returncode != 0
    assert "AddressSanitizer" in done.stderr
