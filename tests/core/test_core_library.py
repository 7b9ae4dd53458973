"""The border to the core: what it refuses, which library it takes, and how it is compiled."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.metadata import Distribution
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ringsim.cli import cli
from ringsim.core import library
from ringsim.core.chain import Seen
from ringsim.core.library import call
from ringsim.core.tension import Drums, RopeTable, Spans
from ringsim.core.winches import Answering
from ringsim.frame import elimination
from ringsim.frame.cables import Arms, PathPoints, PulleyLaws, Roped
from ringsim.frame.elimination import Border, Fronts
from ringsim.frame.laws import Acting, Tape, play, taped
from ringsim.frame.mesh import Mesh
from ringsim.frame.model import FrameModel, System
from ringsim.frame.springs import Web
from ringsim.frame.state import Coefficients, Followed, Held, Moving, Pose, Strains
from ringsim.refusal import EXIT_BAD_INPUT, NotBuiltError
from ringsim.scene import load_scene
from ringsim.simulation import simulate

# It stands beside pyproject.toml, and needs setuptools, which a run does not.
sys.path.insert(0, str(Path(__file__).parents[2]))
import building

WIDE = library.has_wide_registers()


def pose(axes: np.ndarray) -> Pose:
    return Pose(np.zeros((len(axes), 3)), axes, np.zeros(0))


@pytest.mark.quick
def test_arrays_that_are_not_whole_or_of_other_numbers_are_refused() -> None:
    axes = np.tile(np.eye(3), (4, 1, 1))
    with pytest.raises(TypeError, match=r"arrays of real numbers of 64 bits, not float64 .* \(144"):
        call("straighten", pose(axes[::2]))
    for other in np.float32, np.int64:
        with pytest.raises(TypeError, match=f"real numbers of 64 bits, not {other.__name__}"):
            call("straighten", pose(axes.astype(other)))
    with pytest.raises(ValueError, match="shorter"):
        call("straighten")


@pytest.mark.quick
def test_tables_are_as_large_here_as_in_c_and_so_are_constants() -> None:
    tables = (
        Mesh, Pose, Strains, Fronts, Border, Tape, Acting, Web, Coefficients, Followed, Moving,
        Held, PathPoints, Arms, PulleyLaws, RopeTable, Drums, Spans, Seen, Answering, Roped, System,
    )  # fmt: skip
    sizes = {kind.__name__: library.words_of(kind) for kind in tables}
    assert sizes == {k.__name__: call("words_of_table", n) for n, k in enumerate(tables)}
    here = elimination.PANEL, elimination.WIDE, elimination.EIGHT
    assert here == tuple(call("constant_of_fronts", n) for n in range(3))


@pytest.mark.quick
def test_a_checkout_that_is_not_compiled_takes_the_installed_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where a campaign is started in a checkout, and ringsim is installed from it."""
    installed = tmp_path / "site-packages"
    (installed / "ringsim" / "core").mkdir(parents=True)
    compiled = Path(library.loaded()._name).parent
    (installed / "ringsim" / "core" / "c").symlink_to(compiled)
    checkout = tmp_path / "checkout"
    shutil.copytree(library.FOLDER, checkout, ignore=shutil.ignore_patterns("*.so"))
    made = [Distribution.at(place / "ringsim.dist-info") for place in (checkout, installed)]
    monkeypatch.setattr(library, "FOLDER", checkout)
    monkeypatch.setattr(library, "distributions", lambda name: made)
    assert library.loaded.__wrapped__().compiled_from().decode() == library.digest()
    (checkout / "laws.c").write_text("other sources")
    with pytest.raises(NotBuiltError, match="from other sources"):
        library.loaded.__wrapped__()


@pytest.mark.quick
def test_a_library_of_other_sources_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a change of them a checkout must be compiled again: tables may have other fields."""
    monkeypatch.setattr(library, "digest", lambda: "0123")
    with pytest.raises(NotBuiltError, match="was compiled from other sources: run pip install"):
        library.loaded.__wrapped__()


@pytest.mark.quick
def test_no_other_engine_takes_the_place_of_a_core_that_is_not_built(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(name: str) -> None:
        raise NotBuiltError("the core is not compiled here")

    monkeypatch.setattr(library, "_function", refuse)
    done = CliRunner().invoke(cli, ["run", "ring18"], standalone_mode=False)
    assert (done.return_value, done.stdout) == (EXIT_BAD_INPUT, "")
    assert done.stderr == "the core is not compiled here\n"
    with pytest.raises(NotBuiltError):
        simulate("ring18")


def test_a_very_long_ring_has_a_tangent() -> None:
    """144 sections with ropes: what is proportional to the square does not stand on the stack."""
    scene = load_scene("ring18-cable").with_values({"structure.sections": 144})
    model = FrameModel(scene)
    after = model.start.copy()
    after.strains.lead[0] = 1e3
    assert model.core("unbalance", 1e-3, 1e-3, after, model.start.table, after.table) == 0
    assert model.core("stiffen", 1e-3, 1e-3, after, after.table) == 0


@pytest.mark.quick
def test_tables_are_forgotten_one_day_and_never_mistaken() -> None:
    """More tables than are kept: each call sees its own arrays, also where an id comes again."""
    for n in range(3 * library.MOST_KNOWN):
        axes = (1.0 + 1e-9 * n) * np.tile(np.eye(3), (2, 1, 1))
        call("straighten", pose(axes))
        np.testing.assert_allclose(axes, np.tile(np.eye(3), (2, 1, 1)), atol=1e-12)
    assert len(library._known) <= library.MOST_KNOWN


@pytest.mark.quick
def test_a_core_that_is_not_compiled_is_told_with_the_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(library, "FOLDER", tmp_path)
    monkeypatch.setattr(library, "distributions", lambda name: [])
    with pytest.raises(NotBuiltError, match=r"not compiled here: run pip install \."):
        library.loaded.__wrapped__()


BITS = """
import json, sys
from ringsim.core import library
library.has_wide_registers = lambda: sys.argv[1] == "wide"
import ringsim
scene = ringsim.load_scene("ring18-cable").with_values(
    {"structure.sections": 3, "solver.end_time": 2.0}
)
run = ringsim.simulate(scene, fidelity="frame")
assert run.status.item() == 0, run.reason
print(json.dumps([run[n].values.ravel().tolist() for n in ("opening_angle", "cable_tension")]))
"""


@pytest.mark.skipif(not WIDE, reason="the processor has no AVX2")
def test_results_are_the_same_bits_with_and_without_wide_registers() -> None:
    def found(name: str) -> list[list[float]]:
        done = subprocess.run(
            [sys.executable, "-c", BITS, name], capture_output=True, text=True, check=True
        )
        return json.loads(done.stdout)

    narrow, wide = found("narrow"), found("wide")
    assert len(narrow[0]) > 100
    assert narrow == wide


@pytest.mark.quick
def test_a_compiler_is_asked_for_only_where_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = building.get_requires_for_build_wheel
    monkeypatch.setattr(building.build_meta, "get_requires_for_build_wheel", lambda _: ["other"])
    monkeypatch.setattr(building, "has_compiler", lambda: True)
    assert asked() == ["other"]
    monkeypatch.setattr(building, "has_compiler", lambda: False)
    assert asked() == ["other", building.COMPILER]
    monkeypatch.setattr(os, "environ", {})
    building.choose_compiler()
    assert os.environ["CC"].endswith("-m ziglang cc -mcpu=baseline")


@pytest.mark.slow  # a compiler of 80 MB is fetched, and the core compiled twice
def test_a_machine_without_a_compiler_builds_a_core_of_the_same_bits(tmp_path: Path) -> None:
    """In a copy, so that nothing compiled lies there."""
    root = Path(building.__file__).parent
    listed = subprocess.run(
        ["git", "-C", str(root), "ls-files", "-z"], capture_output=True, text=True, check=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        (tmp_path / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / name, tmp_path / "source" / name)
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps"]
    none_there = os.environ | {"CC": "no-such-compiler"}
    installed = tmp_path / "installed"
    subprocess.run(
        [*pip, "--target", str(installed), str(tmp_path / "source")], env=none_there, check=True
    )
    told = "import ringsim; d = ringsim.simulate(ringsim.load_scene('truss2'), fidelity='frame'); "
    told += "print(ringsim.__file__, float(d.deployment_time).hex(), float(d.peak_tension).hex())"

    def run(**path: str) -> list[str]:
        done = subprocess.run(
            [sys.executable, "-c", told], env=os.environ | path, cwd=tmp_path, check=True,
            capture_output=True, text=True,
        )  # fmt: skip
        return done.stdout.split()

    own, (file, *found) = run(), run(PYTHONPATH=str(installed))
    assert file.startswith(str(installed))
    assert found == own[1:]


@pytest.mark.quick
def test_a_number_that_is_none_stays_none_in_laws() -> None:
    """As numpy has it: what is lost in a law must not look like a value."""
    tape = taped([(lambda x, y: np.maximum(np.minimum(x, y), -1.0), (3,), object())], 2, 1)
    tape.rows[0], tape.rows[1] = [np.nan, 1.0, -5.0], 2.0
    play(tape)
    np.testing.assert_array_equal(tape.rows[2], [np.nan, 1.0, -1.0])
