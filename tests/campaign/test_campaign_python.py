"""Campaigns from Python: the model and the results of the verb, in scripts and notebooks."""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from click.testing import CliRunner
from loops import for_each

import fake_solver
import ringsim
from campaign_bench import comparable
from ringsim import Campaign, CampaignError, InputError, open_campaign
from ringsim.campaign.specification import SOLVERS
from ringsim.cli import cli
from ringsim.plots import figures
from ringsim.refusal import EXIT_BAD_INPUT
from ringsim.sampling.distributions import Uniform
from ringsim.storage.netcdf import locked

TABLE: dict[str, Any] = {
    "name": "small", "seed": 5, "scene": "ring18", "fidelity": "full",
    "set": {"structure.sections": 6, "boom": "none", "net": "none", "solver.end_time": 20.0},
    "inputs": {"loads.force": {"kind": "uniform", "low": 0.02, "high": 0.05}},
    "design": {"kind": "random", "samples": 4},
}  # fmt: skip


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of its own, and the quick stand-in for the solver."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(SOLVERS, "full", "fake_solver:run")


def small(**more: Any) -> Campaign:
    return Campaign(**{**TABLE, **more})


def test_it_gives_what_the_verb_gives() -> None:
    """With the same tables, the scene by name or as an object, in solver processes or in this."""
    Path("small.toml").write_text(tomli_w.dumps(TABLE), encoding="utf-8")
    done = CliRunner().invoke(cli, ["campaign", "small.toml", "--workers=0"])
    assert done.exit_code == 0, done.output
    known = comparable(xr.load_dataset("runs/small/campaign.nc"))
    assert known.sizes["sample"] == 4
    scene = ringsim.load_scene("ring18")
    runs = {
        "same": small().run(workers=0),  # in the verb's folder: nothing is left to run
        "named": small().run(workers=2, out="named"),
        "object": small(scene=scene).run(workers=0, out=Path("object")),
        "read": Campaign.read("small.toml").run(workers=0, out="read"),
    }
    for name, found in runs.items():
        xr.testing.assert_identical(comparable(found).drop_attrs(), known.drop_attrs())
        assert found.attrs["seed"] == 5
        assert found.attrs["scene"].startswith('name = "ring18"'), name


def test_arguments_may_be_of_numpy_or_models() -> None:
    inputs = {"loads.force": Uniform(low=0.02, high=0.05)}
    design = {"kind": "random", "samples": np.int64(2)}
    limits = {"timeout": np.float64(60.0), "memory": None}
    found = small(inputs=inputs, design=design, limits=limits).run(workers=0)
    xr.testing.assert_identical(
        found["loads_force"].drop_attrs(),
        small().run(workers=0, out="four")["loads_force"][:2].drop_attrs(),
    )


@for_each(
    ("more", "words"),
    [
        ({"desing": {}}, "ringsim.Campaign: desing is not a known key (did you mean design?)"),
        ({"design": None}, "ringsim.Campaign: design is missing"),
        ({"scene": "truss3"}, "ringsim.Campaign: scene: truss3: no such file"),
        ({"set": {"solver.end_time": -1.0}}, "ringsim.Campaign: set: "),
        ({"inputs": {"loads.farce": {"kind": "uniform", "low": 0, "high": 1}}}, "farce"),
    ],
)
def test_what_is_refused_is_an_input_error(more: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        small(**more).run(workers=0)
    assert words in str(caught.value)
    assert not Path("runs").exists()


def test_another_campaigns_folder_is_refused() -> None:
    small().run(workers=0)
    with pytest.raises(InputError, match="this folder has another campaign"):
        small(seed=6).run(workers=0)


def interrupting(monkeypatch: pytest.MonkeyPatch, at: int) -> list[int]:
    """Lets the user press Ctrl-C during the ``at``-th run; returns a list that grows with runs."""
    real, runs = fake_solver.run, list[int]()

    def run(scene: Any) -> Any:
        runs.append(len(runs) + 1)
        if len(runs) == at:
            os.kill(os.getpid(), signal.SIGINT)
        return real(scene)

    monkeypatch.setattr(fake_solver, "run", run)
    return runs


def test_ctrl_c_stops_it_and_the_same_call_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = interrupting(monkeypatch, at=2)
    with pytest.raises(KeyboardInterrupt):
        small().run(workers=0)
    assert "run the same command again to continue" in capsys.readouterr().err
    assert len(runs) == 2
    partly = open_campaign("runs/small")
    assert (partly["status"] == 0).sum() == 2
    assert (partly["status"] == -1).sum() == 2
    found = small().run(workers=0)
    assert len(runs) == 4
    assert (found["status"] == 0).all()


def test_verbs_merge_what_was_interrupted_but_not_what_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    interrupting(monkeypatch, at=2)
    with pytest.raises(KeyboardInterrupt):
        small().run(workers=0)
    folder = Path("runs/small")
    with locked(folder / "lock", shared=True) as held:  # as any process that runs it
        assert held
        done = CliRunner().invoke(cli, ["analyse", str(folder)])
        assert done.exit_code == EXIT_BAD_INPUT
        assert "is running, and merges its results at its end: wait for that, or run" in done.output
        assert not (folder / "campaign.nc").exists()
    few = [each for each in figures.PICTURES if each.name == "distributions"]
    monkeypatch.setattr(figures, "PICTURES", few)
    line = f"{folder}: merged its results into campaign.nc, 2 samples not run"
    for verb in ("analyse", "export", "report", "plot", "compare"):
        (folder / "campaign.nc").unlink(missing_ok=True)
        others = [str(folder)] if verb == "compare" else []
        done = CliRunner().invoke(cli, [verb, str(folder), *others])
        assert done.exit_code == 0, done.output
        assert done.output.splitlines().count(line) == 1
    assert line not in CliRunner().invoke(cli, ["analyse", str(folder)]).output
    # Its file that is behind is no older result, named by itself.
    os.utime(folder / "campaign.nc", (0.0, 0.0))
    assert line in CliRunner().invoke(cli, ["analyse", str(folder / "campaign.nc")]).output
    assert line not in CliRunner().invoke(cli, ["analyse", str(folder / "campaign.nc")]).output


def test_too_many_failures_are_an_error_and_some_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(scene: Any) -> Any:
        raise RuntimeError("it broke")

    monkeypatch.setattr(fake_solver, "run", broken)
    with pytest.raises(CampaignError, match="more samples than max_failed = 1 failed, 2 are left"):
        small(max_failed=1).run(workers=0)
    found = small().run(workers=0, out="all")
    assert (found["status"] > 0).all()


def test_failed_samples_run_again_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(fake_solver, "run", lambda scene: 1 / 0)
        small().run(workers=0)
    assert (small().run(workers=0)["status"] > 0).all()
    found = small().run(workers=0, retry_failed=True, settings={"solver.tolerance": 1e-5})
    assert (found["status"] == 0).all()
    assert "solver.tolerance = 1e-05" in str(found["overrides"].to_numpy()[0])


def test_parts_are_merged_when_they_are_opened() -> None:
    one = small().run(workers=0, part="1/2")
    assert one["status"].to_numpy().tolist() == [0, -1, 0, -1]
    assert (small().run(workers=0, part="2/2")["status"] == 0).all()
    Path("runs/small/campaign.nc").unlink()
    assert (open_campaign("runs/small")["status"] == 0).all()
    with open_campaign("runs/small/campaign.nc") as found:
        assert (found["status"] == 0).all()


def test_large_files_are_read_as_far_as_they_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    from ringsim.campaign import python

    small().run(workers=0)
    assert open_campaign("runs/small")["opening_angle"].variable._in_memory
    monkeypatch.setattr(python, "IN_MEMORY", 1.0)
    with open_campaign("runs/small") as found:
        assert not found["opening_angle"].variable._in_memory


@for_each("where", ["gone", ".", "run.nc"])
def test_opening_what_is_no_campaign_is_refused(where: str) -> None:
    xr.Dataset({"status": 0}).to_netcdf("run.nc")
    with pytest.raises(InputError, match=r"no such file or folder|no campaign"):
        open_campaign(where)


def test_it_runs_in_a_thread() -> None:
    """As notebooks and servers may call it: signals are the main thread's."""
    found: list[xr.Dataset] = []
    thread = threading.Thread(target=lambda: found.append(small().run(workers=0)))
    thread.start()
    thread.join()
    assert (found[0]["status"] == 0).all()


def test_notebooks_have_a_bar(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # tqdm's on widgets that are missing
        small().run(workers=0)
    assert "100%" in capsys.readouterr().err


def test_the_plan_tells_the_cost() -> None:
    told = small().plan(workers=2)
    assert "4 samples (random design), 4 to run" in told
    assert "from a trial run of sample" in told
    assert not Path("runs").exists()


def test_replay_refuses_checks_that_a_campaign_does_not_have() -> None:
    small().run(workers=0)
    done = CliRunner().invoke(cli, ["replay", "runs/small", "1", "--check"])
    assert done.exit_code == 2
    told = "--check: runs/small has no checks with the full engine (check_every): leave it out"
    assert told in done.output


def test_settings_alone_are_refused_with_what_they_are_for() -> None:
    with pytest.raises(InputError, match=r"settings: solver\.step: .* give retry_failed=True, too"):
        small().run(workers=0, settings={"solver.step": 0.1})


def test_failed_samples_of_a_scene_of_the_script_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = ringsim.load_scene("ring18").with_values(TABLE["set"] | {"solver.end_time": 15.0})

    def own() -> Campaign:
        return small(scene=scene, set={})

    with monkeypatch.context() as patched:
        patched.setattr(fake_solver, "run", lambda scene: 1 / 0)
        own().run(workers=0)
    assert (own().run(workers=0, retry_failed=True)["status"] == 0).all()
