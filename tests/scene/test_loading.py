"""Importing ringsim costs nothing: heavy libraries are loaded by whoever needs them."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import ringsim

HEAVY = ("exudyn", "mpi4py", "matplotlib", "xarray", "netCDF4", "scipy")


def loaded_by(statements: str) -> set[str]:
    """Heavy libraries among the modules of a fresh interpreter after ``statements``."""
    report = f"{statements}\nimport sys\nprint(*[n for n in {HEAVY!r} if n in sys.modules])"
    return set(printed(report).splitlines()[-1].split())


def printed(statements: str) -> str:
    """By a fresh interpreter.

    With the ringsim that is tested and not the one of this folder (-P), whose core may not be
    compiled.
    """
    command = [sys.executable, "-P", "-c", statements]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def calling(*arguments: str) -> str:
    """Statements that call the command and go on after it has ended."""
    return (
        f"import sys\nsys.argv = {['ringsim', *arguments]!r}\nfrom ringsim.cli import main\n"
        "try:\n    main()\nexcept SystemExit as done:\n    assert not done.code\n"
    )


def test_nothing_heavy_is_loaded() -> None:
    """By any of them, one after the other in the same interpreter."""
    verbs = (["--help"], ["--version"], ["scenes"], ["scenes", "ring18"], ["check", "ring18"])
    scene = "from ringsim import Scene, load_scene\nload_scene('ring18')\n"
    assert loaded_by(scene + "".join(calling(*words) for words in verbs)) == set()


@pytest.mark.parametrize(("fidelity", "loaded"), [("full", {"exudyn"}), ("frame", set())])
def test_a_run_loads_its_own_engine_only(fidelity: str, loaded: set[str], tmp_path: Path) -> None:
    out = str(tmp_path / "run.nc")
    words = "run", "truss2", "--fidelity", fidelity, "--set", "solver.end_time=0.1", "--out", out
    assert loaded_by(calling(*words)) & {"exudyn"} == loaded


def test_importing_ringsim_does_not_even_load_numpy_or_pydantic() -> None:
    report = "import ringsim, sys\nprint('numpy' in sys.modules, 'pydantic' in sys.modules)"
    assert printed(report).split() == ["False", "False"]


def test_public_words_are_listed_and_unknown_ones_refused() -> None:
    assert set(ringsim.__all__) <= set(dir(ringsim))
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = ringsim.simulat


def test_it_says_its_version_and_what_things_are(tmp_path: Path) -> None:
    assert ringsim.__version__ == version("ringsim")
    scene = ringsim.load_scene("ring18-cable")
    kinds = "structure pantograph-ring, rods geometrically-exact, stop spring-damper"
    assert repr(scene).startswith(f"Scene('ring18-cable': {scene.title}; {kinds}")
    assert str(scene) == repr(scene)
    force = {"kind": "uniform", "low": 0.01, "high": 0.02}
    campaign = ringsim.Campaign("truss2", {"loads.force": force}, {"kind": "sobol", "samples": 8})
    assert repr(campaign) == (
        "Campaign('campaign': scene truss2; design sobol, samples 8, replicates 1; inputs "
        "loads.force)"
    )
    shown = campaign._repr_html_()
    assert "<code>loads.force</code></td><td>uniform(high=0.02, low=0.01)</td>" in shown
    assert "&lt;b&gt;" in scene.model_copy(update={"title": "<b>"})._repr_html_()


def test_public_words_are_the_things_themselves() -> None:
    from ringsim.scene import Scene, load_scene

    assert ringsim.Scene is Scene
    assert ringsim.load_scene is load_scene
