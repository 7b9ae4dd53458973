"""Bad scene files: exit code 2 and one line that names the field and the cure."""

import subprocess
import sys
from pathlib import Path

import preloaded
import pytest
from click.testing import CliRunner, Result
from loops import for_each

from bad_scenes import BAD_SCENES, Bad
from ringsim.cli import cli
from ringsim.refusal import EXIT_BAD_INPUT


def check(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["check", *arguments])


def the_line(result: Result) -> str:
    """The only line of a refusal."""
    assert result.exit_code == EXIT_BAD_INPUT, result.output
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert result.stderr.endswith("\n")
    return result.stderr


def write(folder: Path, bad: Bad) -> Path:
    path = folder / "bad.toml"
    path.write_bytes(bad.content if isinstance(bad.content, bytes) else bad.content.encode())
    return path


def test_there_are_more_than_a_hundred_bad_scenes() -> None:
    assert len(BAD_SCENES) > 100


@pytest.mark.quick
@for_each("key", BAD_SCENES)
def test_bad_scene_gets_one_line_with_file_field_and_cure(key: str, tmp_path: Path) -> None:
    bad = BAD_SCENES[key]
    line = the_line(check(str(write(tmp_path, bad))))
    assert line.startswith("bad.toml: ")
    for word in bad.named:
        assert word in line
    assert len(line) < 400


@pytest.mark.parametrize(
    "key",
    [
        "unknown-key-solver",
        *(
            pytest.param(key, marks=pytest.mark.slow)
            for key in ("range-not a number", "broken-binary", "impossible-no forces")
        ),
    ],
)
def test_the_installed_command_ends_alike(key: str, tmp_path: Path) -> None:
    bad = BAD_SCENES[key]
    done = subprocess.run(
        [sys.executable, "-m", "ringsim", "check", str(write(tmp_path, bad))],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == EXIT_BAD_INPUT
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr
    for word in bad.named:
        assert word in done.stderr


def test_several_faults_are_one_line_that_names_them_all(tmp_path: Path) -> None:
    path = tmp_path / "many.toml"
    path.write_text(
        'name = "many"\nsolvr = 1\nnet.damping = -1.0\n[structure]\nsections = 0\nhalf_bar = "x"\n'
    )
    line = the_line(check(str(path)))
    for field in ("structure.sections", "structure.half_bar", "net.damping", "solvr"):
        assert field in line


def test_a_folder_is_refused(tmp_path: Path) -> None:
    assert "folder" in the_line(check(str(tmp_path)))


def test_an_absent_file_names_the_built_in_scenes(tmp_path: Path) -> None:
    assert "ring18" in the_line(check(str(tmp_path / "absent.toml")))
    assert "did you mean ring18?" in the_line(check("ring81"))


@for_each("name", ["", "a\0b", "x" * 5000, "with\nbreak"])
def test_impossible_file_names_are_refused(name: str) -> None:
    the_line(check(name))


@pytest.mark.quick
@for_each(
    ("assignment", "named"),
    [
        ("loads.force", "must read PATH=VALUE"),
        ("=3", "must read PATH=VALUE"),
        ("loads.force=", "must read PATH=VALUE"),
        ("loads.forc=0.02", "loads.forc is not a known key (did you mean force?)"),
        ("loads.force=strong", 'loads.force = "strong" must be a finite number in N'),
        ("loads.force=0.02\nname='x'", "loads.force"),
        ("loads.force[0]=0.02", "choose one from 1 to 18"),
        ("loads.force[19]=0.02", "choose one from 1 to 18"),
        ("loads.force[3]=x", "loads.force[3]"),
        ("loads.force[x]=0.02", "not a field name"),
        ("loads.force[99999999999]=0.02", "not a field name"),
        ("loads[2].force=0.02", "not the name of a table"),
        ("loads..force=0.02", "not the name of a table"),
        (".=1", "not the name of a table"),
        ("name.first=x", "name is a value"),
        ("rods=none", "rods"),
        ("nets=none", "did you mean net?"),
        ("boom.kind=flexibel", "did you mean flexible?"),
        ("boom.elements=3", '(kind = "flexible" has it, "rigid" has not: leave it out'),
        ("structure.sections=2", "at least 3"),
        ("rods.diagonal[2]=0.01", "rods.diagonal"),
        ("solver.end_time=[", "solver.end_time"),
    ],
)
def test_bad_assignments_are_refused(assignment: str, named: str) -> None:
    assert named in the_line(check("ring18", "--set", assignment))


@pytest.mark.parametrize(
    "arguments",
    [["check"], ["check", "a", "b"], ["chek", "ring18"], ["check", "ring18", "--st", "a=1"],
     ["scenes", "ring81"], ["check", "ring18", "--set"]],
)  # fmt: skip
def test_bad_usage_ends_with_one_line(arguments: list[str]) -> None:
    done = preloaded.ringsim(*arguments)
    assert done.returncode == EXIT_BAD_INPUT
    assert len(done.stderr.splitlines()) == 1
