"""``ringsim scenes`` and ``ringsim check``."""

import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli, command_of
from ringsim.scene import builtin_scenes, load_scene


def run(*arguments: str) -> str:
    result = CliRunner().invoke(cli, list(arguments))
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    return result.stdout


def line(summary: str, label: str) -> str:
    (found,) = [text for text in summary.splitlines() if text.startswith(label)]
    return found.removeprefix(label).strip()


def test_scenes_lists_every_built_in_scene_with_its_title() -> None:
    listed = run("scenes")
    assert len(listed.splitlines()) == len(builtin_scenes())
    for name in builtin_scenes():
        scene = load_scene(name)
        assert re.search(rf"^{name} +{scene.structure.sections} section", listed, re.MULTILINE)
        assert scene.title in listed


@for_each("name", builtin_scenes())
def test_printed_scene_is_a_starting_point(name: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(run("scenes", name), encoding="utf-8")
    assert load_scene(path) == load_scene(name)
    assert run("check", str(path)) == run("check", name)


def test_check_says_what_is_built() -> None:
    summary = run("check", "ring18")
    assert "closed ring, 18 sections" in line(summary, "structure")
    assert "0.5909 m" in line(summary, "polygon")
    assert "3.5184 m and 3.2856 m" in line(summary, "polygon")
    assert line(summary, "deployed").endswith("x 0.630 m")
    assert line(summary, "rods").startswith("108 geometrically-exact")
    assert line(summary, "points") == "36 hinge assemblies, 36 V-joints, 18 pivots"
    assert line(summary, "joints").startswith("198 revolutes")
    assert line(summary, "mobility").startswith("1 internal degree of freedom")
    assert (
        line(summary, "left out")
        == "cables, controller, gravity, latch, offload, spacecraft, joint friction, stress output"
    )
    assert summary.splitlines()[-1].startswith("valid")


def test_check_tells_parts_within_parts_by_name_and_on_lines_that_can_be_read() -> None:
    lines = run("check", "ring18-motor").splitlines()
    assert max(map(len, lines)) <= 110
    labels = [each.partition("  ")[0] for each in lines]
    assert {"cables.upper", "cables.lower", "hinge spring"} <= {*labels}
    assert 'winch.winding.kind = "motor"' in line("\n".join(lines), "cables.upper")
    assert not [each for each in lines if re.search(r"=$|\.\d{13}", each)]
    # 0.005 N m of the shaft, 100 turns for one of a drum of 20 mm, with 0.6 of the work.
    assert line("\n".join(lines), "winches") == (
        "cables.upper.winch and cables.lower.winch pull at most 15 N"
    )
    # A second part that is as the first is told so.
    even = run("check", "ring18-cable")
    assert line(even, "cables.lower") == "as cables.upper"
    assert "pull at most" not in even  # with any force


def test_mass_is_the_sum_of_its_parts() -> None:
    """Tubes by hand: 18 (4 x 0.4275 m and 4 x 0.2889 m) of 1800 kg/m^3; 72 points of 19.8 g."""
    total, _, parts = line(run("check", "ring18"), "mass").partition(" kg: ")
    by_name = {name: float(mass) for name, mass in re.findall(r"([\w-]+) ([\d.e-]+)", parts)}
    quarter_pi = 0.785398
    assert by_name["diagonals"] == pytest.approx(
        1800 * 18 * 4 * 0.4275 * quarter_pi * (0.01**2 - 0.00915**2), rel=1e-3
    )
    assert by_name["bars"] == pytest.approx(
        1800 * 18 * 4 * 0.2889 * quarter_pi * (0.012**2 - 0.01115**2), rel=1e-3
    )
    assert by_name["hinges"] + by_name["V-joints"] == pytest.approx(72 * 0.0198, rel=1e-3)
    assert float(total) == pytest.approx(sum(by_name.values()), rel=1e-3)


def test_check_of_an_open_arc_without_parts() -> None:
    summary = run(
        "check", "ring18", "--set", "structure.closed=false", "--set", "structure.sections=2",
        "--set", "boom=none", "--set", "net=none", "--set", "loads=none", "--set", "stop=none",
    )  # fmt: skip
    assert "open arc of a polygon with 18 sides, 2 sections" in line(summary, "structure")
    assert line(summary, "points") == "6 hinge assemblies, 4 V-joints, 2 pivots"
    assert line(summary, "mobility").startswith("5 internal degrees of freedom")
    for part in ("boom", "net", "loads", "stop"):
        assert part in line(summary, "left out")


@pytest.mark.parametrize("sections", [3, 5, 72, 73, 120])
def test_check_of_any_number_of_sections(sections: int) -> None:
    summary = run("check", "ring18", "--set", f"structure.sections={sections}")
    assert f"{sections} sections" in line(summary, "structure")
    axes = [float(axis) for axis in re.findall(r"([\d.]+) m", line(summary, "polygon"))][1:]
    # Printed to 0.1 mm, and the smallest of these rings is 0.68 m wide.
    assert axes[1] / axes[0] == pytest.approx(3.2856 / 3.5184, abs=1.5e-4)


@for_each("verb", ["scenes", "check", "run", "campaign"])
def test_help_lists_the_verb(verb: str) -> None:
    assert verb in run("--help")


@pytest.mark.parametrize("verb", [pytest.param("check", marks=pytest.mark.slow), "run"])
def test_a_reader_that_stops_reading_costs_no_result(verb: str, tmp_path: Path) -> None:
    """As ``ringsim run ... | head -1`` does."""
    out = tmp_path / "pipe.nc"
    quick = ["--fidelity", "frame", "--set", "solver.end_time=0.2", "--out", str(out)]
    with subprocess.Popen(
        [sys.executable, "-m", "ringsim", verb, "ring18", *(quick if verb == "run" else [])],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert process.returncode == 0
    assert out.exists() == (verb == "run")


@pytest.mark.parametrize(
    ("output", "code", "told"),
    [
        (">&- 2>&-", 0, ""),
        (">/dev/full", 2, "standard output cannot be written: No space left"),
        pytest.param("2>/dev/full", 0, "", marks=pytest.mark.slow),
    ],
    ids=["closed", "full", "full-error"],
)
def test_an_output_that_takes_nothing_costs_no_result(
    output: str, code: int, told: str, tmp_path: Path
) -> None:
    words = "run truss2 --fidelity frame --set solver.end_time=0.2 --out run.nc"
    done = subprocess.run(
        ["sh", "-c", f"{sys.executable} -m ringsim {words} {output}"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert told in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "run.nc").exists()


INTERRUPTED = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
from ringsim.__main__ import main
from ringsim.exudyn.cables import CableDrive
evaluate, calls = CableDrive.evaluate, []
def interrupted(*given):
    calls.append(1)
    if len(calls) == 50:
        signal.raise_signal(signal.SIGINT)
    return evaluate(*given)
CableDrive.evaluate = interrupted
main()
"""


def test_an_interrupted_run_writes_nothing(tmp_path: Path) -> None:
    """Where the signal comes while the solver is within one of ringsim's functions, exudyn makes a
    failure of its own of it."""
    words = ["run", "ring18-cable", "--fidelity", "full", "--out", str(tmp_path / "run.nc")]
    with subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        told = process.communicate()[1]
    assert process.returncode == 130, told
    assert told.strip() == "interrupted"
    assert not list(tmp_path.iterdir())


WRITING = """
import os, signal
from ringsim.__main__ import main
def replaced(*given):  # the draft is complete, and not in its place yet
    signal.raise_signal(signal.NUMBER)
os.replace = replaced
main()
"""


@pytest.mark.parametrize("number", ["SIGTERM", "SIGHUP"])
def test_a_signal_to_a_command_that_writes_leaves_no_draft(tmp_path: Path, number: str) -> None:
    words = ["run", "truss2", "--set", "solver.end_time=0.1", "--set", "solver.step=0.1"]
    done = subprocess.run(
        [sys.executable, "-c", WRITING.replace("NUMBER", number), *words, "--out", "run.nc"],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stderr.splitlines()[-1]) == (130, "interrupted")
    assert not list(tmp_path.iterdir())


EARLY = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Interrupted:
    def find_spec(self, name, path, target=None):
        if name == "click":
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Interrupted())
from ringsim.__main__ import main
main()
"""


@pytest.mark.quick
@pytest.mark.parametrize("how", [
    "signal.raise_signal(signal.SIGTERM)",
    "exec('signal.raise_signal(signal.SIGINT)')",  # as the code of a named tuple
    "type('', (), {'name': type('', (), {'__set_name__': lambda *_: "
    "signal.raise_signal(signal.SIGTERM)})()})",  # comes out as a RuntimeError
])  # fmt: skip
def test_a_command_interrupted_while_it_loads_says_so_in_one_line(tmp_path: Path, how: str) -> None:
    code = EARLY.replace("signal.raise_signal(signal.SIGINT)", how)
    (tmp_path / "early.py").write_text(code)
    done = subprocess.run(
        [sys.executable, "-m", "early"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.quick
@pytest.mark.parametrize(
    "error",
    ["MemoryError()", "ImportError('libz.so.1: failed to map segment from shared object')"],
)
def test_too_little_memory_is_told_in_one_line(error: str) -> None:
    code = EARLY.replace("signal.raise_signal(signal.SIGINT)", f"raise {error}")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("there is too little memory: raise the limit (ulimit -v)")
    assert len(done.stderr.splitlines()) == 1


def test_a_limit_with_which_openblas_would_try_for_ever_is_refused() -> None:
    limit = "import resource; resource.setrlimit(resource.RLIMIT_AS, (400_000 * 1024,) * 2)"
    code = f"{limit}; from ringsim.__main__ import main; main()"
    words = [sys.executable, "-c", code, "check", "truss2"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert done.stderr.startswith("there is too little memory: raise the limit (ulimit -v)")


@pytest.mark.quick
def test_a_shell_completes_paths_after_set() -> None:
    def offered(begun: str) -> list[str]:
        option = next(each for each in command_of("run").params if each.name == "settings")
        return [item.value for item in option.shell_complete(click.Context(cli), begun)]

    assert "solver.step=" in offered("solver.")
    assert offered("cables.upper.wi") == ["cables.upper.winch"]
    assert offered("rods.you") == ["rods.young_modulus="]
    assert offered("nothing") == []


def test_names_that_a_locale_cannot_write_are_refused_with_the_cure(tmp_path: Path) -> None:
    """netCDF4 writes names of files as text: a locale of ASCII alone cannot."""
    folder = tmp_path / "gerät"
    folder.mkdir()
    locale = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    (folder / "a.nc").write_bytes(b"")
    done = subprocess.run(
        [sys.executable, "-m", "ringsim", "analyse", folder / "a.nc"], env=os.environ | locale,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    line = done.stderr.decode("ascii", "replace")
    assert "a file or folder has a name that this locale" in line
    assert "set PYTHONUTF8=1" in line
    assert "Traceback" not in line
