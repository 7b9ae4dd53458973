"""Modules that files import: kinds of one's own in workers, under MPI, resumed, replayed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from preloaded import ringsim

from campaign_bench import MPIEXEC, PYTHON
from ringsim import Campaign, InputError, extensions, load_scene
from ringsim.analysis import derived
from ringsim.cli import cli
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE, EXIT_FAILED

MODULE = '''
"""A bearing, a controller, an output and a distribution."""

from typing import ClassVar, Literal

import numpy as np

from ringsim.cable.control import Controller
from ringsim.cable.friction import Bearing
from ringsim.outputs import Output
from ringsim.sampling.distributions import Uniform
from ringsim.units import PositiveSpeed, Ratio
from ringsim.variables import Variable


class {word}Friction(Bearing):
    """f = coefficient (kinetic + (1 - kinetic) exp(-(s / speed)^2))."""

    kind: Literal["{word}"] = "{word}"
    kinetic: Ratio
    """Share of the friction that is left where the rope runs fast."""
    speed: PositiveSpeed
    """Of the rope, at which the friction has fallen by two thirds of the way."""
    moves: ClassVar[bool] = True

    def decay(self, pulleys, radius):
        faded = np.exp(-np.square(pulleys.speed / self.speed))
        lever = self.coefficients * (self.kinetic + (1.0 - self.kinetic) * faded)
        return -2.0 * np.arctanh(lever / radius * np.cos(0.5 * pulleys.angle))


class {word}Controller(Controller):
    """Adds the same speed in each of the first two steps."""

    kind: Literal["{word}"] = "{word}"
    speed: PositiveSpeed
    """Added."""

    def reset(self):
        self.state["told"] = 0

    def step(self, time, readings):
        self.state["told"] = min(self.state["told"] + 1, 2)
        return dict.fromkeys(readings.speed, self.state["told"] * self.speed)


class {word}Angle(Output):
    variables = (
        Variable("{word}_angle", ("plane", "section", "time"), "degree", "opening angle again"),
        Variable("{word}_most", (), "degree", "largest of them"),
    )

    def read(self, now):
        return np.degrees(now.angles)


class {word}Half(Uniform):
    """The lower half of a uniform distribution."""

    kind: Literal["{word}-half"] = "{word}-half"

    def quantile(self, probability):
        return super().quantile(0.5 * probability)
'''
FILE = """
name = "own"
seed = 3
scene = "truss2"
fidelity = "frame"
imports = ["{word}"]
design = {{ kind = "random", samples = 4 }}

[set]
"solver.end_time" = 1.0
"cables.upper.friction.kind" = "{word}"
"cables.upper.friction.kinetic" = 1.0
"cables.upper.friction.speed" = 1e-3
"cables.upper.winch.winding" = {{ kind = "commanded", max_speed = 0.1 }}
"cables.lower.winch.winding" = {{ kind = "commanded", max_speed = 0.1 }}
controller = {{ kind = "{word}", period = 0.25, speed = 0.01, encoder.bias = 0.1 }}

[inputs]
"cables.upper.friction.coefficient" = {{ kind = "{word}-half", low = 1e-4, high = 9e-4 }}
"controller.seed" = {{ kind = "uniform", low = 0.0, high = 1e6 }}

[requirements]
{word}_most = {{ max = 180.0, probability = 0.5, confidence = 0.5 }}
"""
WORD = "stribeck_here"
TWICE = """
from ringsim.outputs import Output
from ringsim.variables import Variable


class Again(Output):
    variables = (Variable("asynchrony", (), "1", "again"),)
"""


def call(
    *words: str, code: int = EXIT_DONE, ranks: int = 0, cwd: Path | None = None, fresh: bool = False
) -> str:
    """What a command prints; MPI, and ``fresh`` workers, start processes that know nothing."""
    if ranks or fresh:
        launcher = [str(MPIEXEC), "-n", str(ranks)] if ranks else []
        done = subprocess.run(
            [*launcher, *PYTHON, *words], capture_output=True, text=True, timeout=300, check=False,
            cwd=cwd,
        )  # fmt: skip
    else:
        done = ringsim(*words, folder=cwd)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study, half of which has run under MPI where there is one."""
    folder = tmp_path_factory.mktemp("study")
    (folder / f"{WORD}.py").write_text(MODULE.format(word=WORD), encoding="utf-8")
    (folder / "own.toml").write_text(FILE.format(word=WORD), encoding="utf-8")
    ranks = 2 if MPIEXEC else 0
    call("campaign", "own.toml", "--out=done", "--part=1/2", ranks=ranks, cwd=folder)
    return folder


def test_own_kinds_run_everywhere(study: Path, tmp_path: Path) -> None:
    """Ranks, workers, replays from another folder, the folder moved; the law is that of a bearing
    here, and so are the numbers.
    """
    call("campaign", "own.toml", "--out=done", "--workers=1", cwd=study, fresh=True)
    assert "4 of 4" in call("status", str(study / "done"), cwd=tmp_path)
    found = xr.load_dataset(study / "done/campaign.nc")
    assert found["status"].values.tolist() == [0] * 4
    assert "identical" in call("replay", str(study / "done"), "3", cwd=tmp_path)
    told = call("analyse", str(study / "done"), cwd=tmp_path)
    assert f"{WORD}_most <= 180 deg" in told
    # Between steps the one is interpolated with rates and the other without.
    np.testing.assert_allclose(found[f"{WORD}_angle"], found["opening_angle"], rtol=1e-4)
    drawn = found["cables_upper_friction_coefficient"].values
    assert ((drawn > 1e-4) & (drawn < 5e-4)).all()
    winch = {"winding": {"kind": "commanded", "max_speed": 0.1}}
    plain = load_scene("truss2").with_values(
        {"solver.end_time": 1.0, "cables.upper.friction.coefficient": float(drawn[1]),
         "cables.upper.winch": winch, "cables.lower.winch": winch}
    )  # fmt: skip
    from ringsim import steps

    run = steps(plain, period=0.25)
    for _ in run:
        speed = 0.01 if run.time == 0.0 else 0.02
        run.command(upper=speed, lower=speed)
    np.testing.assert_allclose(
        found["opening_angle"].sel(sample=1), run.result["opening_angle"], rtol=1e-7
    )

    # Where a module lies decides about nothing, what it says about everything.
    moved = Path(shutil.move(study, tmp_path / "moved"))
    call("campaign", "own.toml", "--out=done", "--workers=1", cwd=moved)
    file = moved / f"{WORD}.py"
    file.write_text(file.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    refused = call("campaign", "own.toml", "--out=done", code=EXIT_BAD_INPUT, cwd=moved)
    assert "has changed since it began" in refused
    # Nothing is left, and the numbers hold: status has no word on it; else it has.
    assert "not continued" not in call("status", "done", cwd=moved)
    shutil.copytree(moved / "done", moved / "half")
    for journal in (moved / "half/journals").iterdir():
        journal.unlink()
    told = call("status", "half", cwd=moved)
    assert "has changed since it began: what is left is refused" in told
    file.unlink()
    refused = call("campaign", "own.toml", "--out=done", code=EXIT_BAD_INPUT, cwd=moved)
    assert f"there is no module {WORD}" in refused


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("absent.py", None, "there is no such file"),
        ("absent", None, "there is no module absent, neither beside the file nor installed"),
        ("broken_here", "def f(:\n", "it cannot be imported: SyntaxError"),
        ("failing_here", "\n1 / 0\n", "ZeroDivisionError: division by zero"),
        ("not-a-name.py", "", "is no name of a module"),
        ("json", "", "another module of this name is in use"),
        ("leaving_here", "raise SystemExit(3)\n", "SystemExit: 3"),
        ("..", None, "must be the name of a module"),
        ("sys", None, "it has no file"),
        ("twice_here", TWICE, "there is an output asynchrony already"),
    ],
)  # fmt: skip
def test_what_cannot_be_imported_is_refused_in_one_line(
    name: str, text: str | None, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    if text is not None:
        (tmp_path / f"{name.removesuffix('.py')}.py").write_text(text, encoding="utf-8")
    scene = load_scene("truss2").to_toml().replace("imports = []", f'imports = ["{name}"]')
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_scene(tmp_path / "scene.toml")
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_own_kinds_are_explained(tmp_path: Path) -> None:
    """Beside the others, and in the schema."""
    word = "explained_here"
    file = tmp_path / f"{word}.py"
    file.write_text(MODULE.format(word=word), encoding="utf-8")
    told = call("explain", "cables.upper.friction.kinetic", f"{word}_most", f"--import={file}")
    assert "Share of the friction that is left where the rope runs fast." in told
    assert "largest of them" in told
    assert word in call("explain", "--schema=scene", f"--import={file}")
    refused = CliRunner().invoke(cli, ["explain", f"{word}_most"])
    assert refused.exit_code == EXIT_BAD_INPUT


SPRING = """
from typing import Literal

from ringsim.parts.joints import HingeSpring


class {name}(HingeSpring):
    kind: {form} = "{word}"
"""


@pytest.mark.parametrize(
    ("name", "form", "word", "told"),
    [
        ("AnotherTape", 'Literal["tape"]', "tape", "kind tape is defined twice"),
        ("NoLiteral", "str", "no-literal", 'write kind: Literal["no-literal"] = "no-literal"'),
        ("Misspelt", 'Literal["tape"]', "tpae", 'write kind: Literal["tpae"] = "tpae"'),
    ],
)
def test_kinds_that_no_scene_could_choose_are_refused(
    name: str, form: str, word: str, told: str, tmp_path: Path
) -> None:
    """Before anything is explained."""
    file = tmp_path / "springs_here.py"
    file.write_text(SPRING.format(name=name, form=form, word=word), encoding="utf-8")
    scene = load_scene("ring18").to_toml().replace("imports = []", 'imports = ["springs_here"]')
    (tmp_path / "scene.toml").write_text(f'{scene}\n[hinge_spring]\nkind = "{word}"\n', "utf-8")
    for arguments in (
        ("check", f"{tmp_path / 'scene.toml'}"),
        ("explain", "hinge_spring", f"--import={file}"),
        ("explain", "--schema=scene", f"--import={file}"),
    ):
        refused = ringsim(*arguments)
        assert refused.returncode == EXIT_BAD_INPUT, refused.stderr
        assert told in refused.stderr
        assert refused.stderr.count("\n") == 1


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_an_error_within_a_law_names_its_line(fidelity: str, tmp_path: Path) -> None:
    """Not one of ringsim's own lines, wherever these lie."""
    text = MODULE.format(word="failing_law").replace("faded = np.exp", "faded = math.exp")
    text = text.replace("from typing", "import math\nfrom typing", 1)
    (tmp_path / "failing_law.py").write_text(text, encoding="utf-8")
    line = next(k for k, each in enumerate(text.splitlines(), 1) if "math.exp" in each)
    scene = load_scene("truss2").to_toml().replace("imports = []", 'imports = ["failing_law"]')
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    own = ["kind='failing_law'", "kinetic=1.0", "speed=1e-3"]
    words = [f"--set=cables.upper.friction.{each}" for each in own]
    done = ringsim("run", "scene.toml", *words, f"--fidelity={fidelity}", folder=tmp_path)
    # Frames refuse a law before they run; the other engine meets it as the run begins.
    assert done.returncode == {"frame": EXIT_BAD_INPUT, "full": EXIT_FAILED}[fidelity]
    assert f"(failing_law.py, line {line})" in done.stdout + done.stderr


def test_an_entry_point_names_a_module_of_a_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As an installed package has it; its digest is of all files of the package."""
    package, told = tmp_path / "hoops_here", tmp_path / "hoops_here-1.0.dist-info"
    for folder in (package, told):
        folder.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    (package / "laws.py").write_text("LOADED = True\n", encoding="utf-8")
    (told / "METADATA").write_text("Name: hoops_here\nVersion: 1.0\n", encoding="utf-8")
    (told / "entry_points.txt").write_text("[ringsim]\nhoops = hoops_here.laws\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    extensions.load(["hoops"])
    assert sys.modules["hoops_here.laws"].LOADED
    before = extensions.digest(["hoops"])
    assert before
    (package / "more.py").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="imports: hoops has changed since it was loaded"):
        extensions.digest(["hoops"])
    with pytest.raises(InputError, match=r"there is no module hoop, .* \(known: hoops\)|did you"):
        extensions.load(["hoop"])


def test_a_campaign_in_python_imports_and_derives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the file has it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    Path("empty_here.py").write_text("", encoding="utf-8")
    campaign = Campaign(
        "truss2", {"cables.lower.axial_stiffness": {"kind": "uniform", "low": 9e4, "high": 1e5}},
        {"kind": "random", "samples": 2}, imports=["empty_here"], fidelity="frame",
        outputs={"lag_here": "difference(lock_time)"}, set={"solver.end_time": 0.3},
    )  # fmt: skip
    found = campaign.run(workers=0)
    assert found["lag_here"].isnull().all()  # nothing has locked
    assert found.attrs["modules"]
    assert str(tmp_path / "empty_here.py") in found.attrs["scene"]
    derived.forget(derived.declared())


def test_what_a_module_imports_beside_it_counts_and_what_it_prints_is_no_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also a part of a package beside the file."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "chatty_here.py").write_text("import helper_here\nprint('hello')\n", "utf-8")
    helper = tmp_path / "helper_here.py"
    helper.write_text("VALUE = 1\n", encoding="utf-8")
    package = tmp_path / "package_here"
    package.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    (package / "values.py").write_text("VALUE = 2\n", encoding="utf-8")
    (package / "laws.py").write_text("from .values import VALUE\n", encoding="utf-8")
    names = extensions.located(["chatty_here", "package_here.laws"], tmp_path)
    extensions.load(names)
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "hello\n")
    assert sys.modules["package_here.laws"].VALUE == 2
    assert extensions.digest(names)
    for file in (helper, package / "values.py"):
        text = file.read_text(encoding="utf-8")
        file.write_text("VALUE = 3\n", encoding="utf-8")
        with pytest.raises(InputError, match="has changed since it was loaded"):
            extensions.digest(names)
        file.write_text(text, encoding="utf-8")
