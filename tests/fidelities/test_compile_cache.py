"""Compiled code has a folder of its own that can be written, and one process compiles at a time."""

from __future__ import annotations

import os
import platform
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from ringsim.compile_cache import VARIABLE, choose_folder, compile_once

CHOOSES = "from ringsim.compile_cache import choose_folder\nprint(choose_folder())"
FRAMES_FIRST = "import os, ringsim.compiled\nprint(os.environ['NUMBA_CACHE_DIR'])"
COMPILES = """
import sys, time
from pathlib import Path
from ringsim.compile_cache import compile_once

def compiling():
    with open("trace", "a") as trace:
        trace.write("begin ")
    time.sleep(0.5)
    with open("trace", "a") as trace:
        trace.write("end ")

compile_once("ring", compiling)
assert "end" in Path("trace").read_text()
"""
RUNS = """
from ringsim.scene import load_scene
from ringsim.simulation import run_frame
found = run_frame(load_scene("truss2").with_values({"solver.end_time": 0.5}))
print(found.status, found.values["peak_tension"], found.values["steps"])
"""


def started(code: str, folder: Path, **environment: str) -> subprocess.Popen[str]:
    """A fresh interpreter; variables that are empty are left out."""
    mine = {"XDG_CACHE_HOME": "", VARIABLE: "", **environment}
    kept = {name: value for name, value in (os.environ | mine).items() if value}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code], cwd=folder, env=kept, text=True, **pipes
    )  # fmt: skip


def ended(process: subprocess.Popen[str]) -> tuple[str, str]:
    out, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    return out.strip(), errors


def test_compiled_code_goes_to_the_users_cache(tmp_path: Path) -> None:
    out, errors = ended(started(CHOOSES, tmp_path, HOME=str(tmp_path)))
    assert Path(out).parent == tmp_path / ".cache" / "ringsim"
    assert errors == ""
    out, _ = ended(started(CHOOSES, tmp_path, HOME=str(tmp_path), XDG_CACHE_HOME="/tmp"))
    assert Path(out).parent == Path("/tmp/ringsim")


def test_who_imports_a_kernel_first_has_its_code_in_the_same_folder(tmp_path: Path) -> None:
    """Else numba keeps it beside the sources, and whoever runs a scene compiles it anew."""
    chosen, found = (
        ended(started(code, tmp_path, HOME=str(tmp_path)))[0] for code in (CHOOSES, FRAMES_FIRST)
    )
    assert found == chosen


def test_a_folder_that_is_given_is_taken(tmp_path: Path) -> None:
    given = str(tmp_path / "mine")
    assert ended(started(CHOOSES, tmp_path, **{VARIABLE: given}))[0] == given


def test_without_a_home_to_write_to_a_temporary_folder_is_told(tmp_path: Path) -> None:
    """Nothing can be made below a file, whoever asks."""
    home = tmp_path / "home"
    home.write_text("")
    places = {"HOME": str(home), "TMPDIR": str(tmp_path)}
    out, errors = ended(started(CHOOSES, tmp_path, **places))
    assert Path(out).parent == tmp_path
    assert len(errors.strip().splitlines()) == 1
    assert "cannot be written: make room, or let it be written to, or set NUMBA_CACHE" in errors
    assert f"compiled code goes to {out}" in errors
    # The next run finds what this one compiled, but not in a folder that others can write to.
    assert ended(started(CHOOSES, tmp_path, **places))[0] == out
    Path(out).chmod(0o777)
    assert ended(started(CHOOSES, tmp_path, **places))[0] != out


def test_a_given_folder_that_cannot_be_written_is_told_once_for_all(tmp_path: Path) -> None:
    """numba would leave it in silence, and every process might compile on its own."""
    (tmp_path / "file").write_text("")
    code = f"{CHOOSES}\nimport subprocess, sys\nsubprocess.run([sys.executable, '-c', {CHOOSES!r}])"
    places = {VARIABLE: str(tmp_path / "file" / "mine"), "TMPDIR": str(tmp_path)}
    out, errors = ended(started(code, tmp_path, **places))
    assert len(set(out.splitlines())) == 1
    assert len(errors.splitlines()) == 1
    assert f"or set {VARIABLE} to a folder of your own" in errors


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("whose", ["another user's", "open to all", "open to the group"])
def test_code_of_others_is_not_run(
    whose: str, given: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("numba.config.CACHE_DIR", "")  # and back to what it was
    monkeypatch.delenv(VARIABLE, raising=False)
    folder = choose_folder()
    assert folder.parent == tmp_path / "cache" / "ringsim"
    if not given:
        monkeypatch.delenv(VARIABLE)
    if whose == "another user's":
        monkeypatch.setattr("os.getuid", lambda: 1 + folder.stat().st_uid)
    else:
        folder.chmod(0o777 if whose == "open to all" else 0o770)
    assert choose_folder().parent == tmp_path
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{folder}: ")
    assert "whose code would run" in line
    cure = "chown" if whose == "another user's" else "chmod go-w"
    assert cure in line


TINY = """
from ringsim.compiled.vectors import compiled, packed

@compiled
def half(x):
    return 0.5 * x

@packed
def more(x):
    return half(x) + 1.0
"""


@pytest.mark.parametrize("damage", [b"", b"no pickle", b"\x80\x05"])
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_code_is_compiled_anew(
    kind: str, damage: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """Files of two functions, one of which calls the other; after that they are whole again."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "cache"))
    source = tmp_path / "tiny.py"
    source.write_text(TINY)

    def hits() -> list[int]:
        tiny = runpy.run_path(str(source))
        assert tiny["more"](3.0) == 2.5
        found = [sum(tiny[name].stats.cache_hits.values()) for name in ("more", "half")]
        return found

    assert hits() == [0, 0]
    assert hits()[0] == 1
    for path in (tmp_path / "cache").rglob(f"*.{kind}"):
        path.write_bytes(damage)
    assert hits() == [0, 0]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("compiled code is damaged: it is compiled anew")
    assert hits()[0] == 1


def test_of_two_processes_one_compiles_and_the_other_waits(tmp_path: Path) -> None:
    places = {VARIABLE: str(tmp_path / "cache")}
    with started(COMPILES, tmp_path, **places) as one, started(COMPILES, tmp_path, **places) as two:
        ended(one)
        ended(two)
    assert (tmp_path / "trace").read_text() == "begin end "


def test_every_kind_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    done = []
    for kind in ("ring", "ring", "truss", "ring"):
        compile_once(kind, lambda kind=kind: done.append(kind))
    assert done == ["ring", "truss"]


def test_what_breaks_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    with pytest.raises(ZeroDivisionError):
        compile_once("ring", lambda: 1 / 0)
    done = []
    compile_once("ring", lambda: done.append("ring"))
    assert done == ["ring"]


@pytest.mark.slow  # compiles everything; that one waits for the other is tested above
def test_two_runs_on_an_empty_cache_give_the_same(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.write_text("")
    places = {"HOME": str(home), "TMPDIR": str(tmp_path)}
    one, other = (ended(p)[0] for p in [started(RUNS, tmp_path, **places) for _ in range(2)])
    assert one == other == ended(started(RUNS, tmp_path, **places))[0]
    assert list(tmp_path.rglob("*.nbc"))


FRONTS = """
import hashlib
import numpy as np
from numba import config
from ringsim.frame.elimination import Fronts, factor, solve, solve_one
from ringsim.frame.model import FrameModel
from ringsim.scene import load_scene
mesh = FrameModel(load_scene("ring18").with_values({"structure.sections": 4})).mesh
fronts, random = Fronts.empty(mesh), np.random.default_rng(0)
for front, size in zip(fronts.whole, mesh.size, strict=True):
    front[:size, :size] = random.normal(size=(size, size)) + 30.0 * np.eye(size)
assert factor(mesh, fronts)
many, one = random.normal(size=(mesh.unknowns, 16)), random.normal(size=mesh.unknowns)
solve(mesh, fronts, many)
solve_one(mesh, fronts, one)
assert config.SLP_VECTORIZE == 0
code = "".join(factor.inspect_asm().values())
print(hashlib.sha256(many.tobytes() + one.tobytes()).hexdigest(), code.count("mulpd"))
"""


def test_packed_fronts_are_the_same_bit_by_bit(tmp_path: Path) -> None:
    """With and without the pass that numba leaves out; each has a folder of its own."""
    cache = {"XDG_CACHE_HOME": str(tmp_path)}
    told = [
        ended(started(FRONTS, tmp_path, **cache, **more))[0].split()
        for more in ({}, {"NUMBA_SLP_VECTORIZE": "0"})
    ]
    assert len(told[0][0]) == 64
    assert told[0][0] == told[1][0]
    if platform.machine() == "x86_64":  # its name for several products at once
        assert int(told[0][1]) > 2 * int(told[1][1])
    assert len(list((tmp_path / "ringsim").glob("ringsim-*"))) == 2
