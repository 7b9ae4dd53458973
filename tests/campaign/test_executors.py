"""Campaigns whose parts are tasks of an executor: the same file from all of them, nothing lost."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

import ringsim
from campaign_bench import comparable
from ringsim import Campaign, CampaignError, InputError
from ringsim.campaign.python import run_part
from ringsim.campaign.specification import SOLVERS
from ringsim.execution.work import Allowance

PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
MPIEXEC = shutil.which("mpiexec", path=PATH)
MADE = """
    import sys
    import ringsim
    def made(samples=5, **more):
        return ringsim.Campaign(
            "truss2", {"loads.force": {"kind": "uniform", "low": 0.0, "high": 0.01}},
            {"kind": "random", "samples": samples}, seed=3, name="parts", fidelity="frame",
            check_every=3, set={"solver.end_time": 0.2}, **more,
        )
"""
DASK = """
from distributed import Client, LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            growing().run(2, out="parts", executor=client.get_executor())
"""
KILLED = """
import os, pathlib, signal, threading, time
from distributed import Client, LocalCluster
def kill(pid):
    folder = pathlib.Path("o/journals")
    while not folder.exists() or not any(each.stat().st_size for each in folder.iterdir()):
        time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)
    print("killed")
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            pid = min(client.run(os.getpid).values())
            threading.Thread(target=kill, args=(pid,), daemon=True).start()
            try:
                made().run(2, out="o", executor=client.get_executor())
            except ringsim.CampaignError as lost:
                print(lost)
                made().run(2, out="o", executor=client.get_executor())
"""
BY_RANKS = """
from mpi4py.futures import MPIPoolExecutor
if __name__ == "__main__":
    with MPIPoolExecutor() as pool:
        made().run(2, out="o", executor=pool)
"""
NAMES: dict[str, Any] = {}
exec(textwrap.dedent(MADE), NAMES)


def made(samples: int = 5, **more: Any) -> Campaign:
    campaign: Campaign = NAMES["made"](samples, **more)
    return campaign


def in_a_script(text: str, folder: Path, *launcher: str) -> subprocess.CompletedProcess[str]:
    script = folder / "script.py"
    script.write_text(textwrap.dedent(MADE) + textwrap.dedent(text), encoding="utf-8")
    return subprocess.run(
        [*launcher, str(script)], capture_output=True, text=True, timeout=300, check=False,
        cwd=folder, env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
    )  # fmt: skip


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    found = made().run(workers=0, out=tmp_path_factory.mktemp("known") / "o")
    assert (found["status_checked"] == 0).sum() == 2  # there is something to compare
    return comparable(found)


def require_same(folder: Path, known: xr.Dataset) -> None:
    found = comparable(ringsim.open_campaign(folder))
    xr.testing.assert_equal(found.drop_attrs(), known.drop_attrs())
    assert len(list((folder / "journals").iterdir())) == 2  # one a part


@pytest.mark.skipif(MPIEXEC is None, reason="there is no mpiexec: ringsim[mpich]")
def test_ranks_of_mpi_give_what_workers_give(tmp_path: Path, known: xr.Dataset) -> None:
    launcher = str(MPIEXEC), "-n", "3", sys.executable, "-m", "mpi4py.futures"
    done = in_a_script(BY_RANKS, tmp_path, *launcher)
    assert done.returncode == 0, done.stderr
    require_same(tmp_path / "o", known)


def wait_for_a_sample(out: Path) -> None:
    folder, end = out / "journals", time.monotonic() + 200.0
    while not folder.exists() or not any(each.stat().st_size for each in folder.iterdir()):
        assert time.monotonic() < end, "no sample has ended"
        time.sleep(0.05)


def test_a_killed_worker_loses_nothing(tmp_path: Path, known: xr.Dataset) -> None:
    """The call says which part, and the same call goes on with what is left."""

    def kill(pool: ProcessPoolExecutor) -> None:
        wait_for_a_sample(tmp_path / "o")
        os.kill(next(iter(pool._processes)), signal.SIGKILL)

    with ProcessPoolExecutor(2) as pool, ThreadPoolExecutor(1) as other:
        killed = other.submit(kill, pool)
        with pytest.raises(CampaignError, match=r"part \d/2 was lost .*: call again"):
            made().run(2, out=tmp_path / "o", executor=pool)
        killed.result()
    before = {each: each.stat().st_size for each in (tmp_path / "o" / "journals").iterdir()}
    with ProcessPoolExecutor(2) as pool:
        found = made().run(2, out=tmp_path / "o", executor=pool)
    xr.testing.assert_equal(comparable(found).drop_attrs(), known.drop_attrs())
    assert all(each.exists() and each.stat().st_size >= size for each, size in before.items())


@pytest.mark.slow  # a killed worker of a process pool, above, goes the same way
@pytest.mark.skipif(MPIEXEC is None, reason="there is no mpiexec: ringsim[mpich]")
def test_a_killed_rank_loses_nothing(tmp_path: Path, known: xr.Dataset) -> None:
    """MPI ends the job; the same command goes on with what is left."""
    (tmp_path / "script.py").write_text(textwrap.dedent(MADE) + BY_RANKS, encoding="utf-8")
    command = [str(MPIEXEC), "-n", "3", sys.executable, "-m", "mpi4py.futures", "script.py"]
    job = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL)
    wait_for_a_sample(tmp_path / "o")
    ranks = [
        int(each.parent.name) for each in Path("/proc").glob("[0-9]*/cmdline")
        if each.read_bytes().split(b"\0")[1:4] == [b"-m", b"mpi4py.futures", b"script.py"]
    ]  # fmt: skip
    os.kill(max(ranks), signal.SIGKILL)
    assert job.wait(timeout=60) != 0
    subprocess.run(command, cwd=tmp_path, check=True, timeout=300)
    found = comparable(ringsim.open_campaign(tmp_path / "o"))
    xr.testing.assert_equal(found.drop_attrs(), known.drop_attrs())


@pytest.mark.slow  # it starts a cluster
def test_a_killed_worker_of_dask_loses_nothing(tmp_path: Path, known: xr.Dataset) -> None:
    """The cluster starts the worker and its task anew, or the same call goes on."""
    pytest.importorskip("distributed")
    done = in_a_script(KILLED, tmp_path, sys.executable)
    assert done.returncode == 0, done.stderr
    assert "killed" in done.stdout
    found = comparable(ringsim.open_campaign(tmp_path / "o"))
    xr.testing.assert_equal(found.drop_attrs(), known.drop_attrs())


GROWING = """
import ringsim
from ringsim.campaign.python import run_part
from ringsim.campaign.specification import SOLVERS
from ringsim.execution.work import Allowance
SOLVERS["full"] = "fake_solver:run"  # deploys in 2 / sqrt(force) (1 + 1e9 / E)
def growing():
    return ringsim.Campaign(
        "ring18",
        {"loads.force": {"kind": "lognormal", "mean": 0.02, "standard_deviation": 0.004}},
        {"kind": "subset-simulation", "of": "deployment_time", "above": 14.9, "samples": 20,
         "share": 0.5, "replicates": 2},
        fidelity="full", set={"structure.sections": 6, "boom": "none", "net": "none",
                              "solver.end_time": 30.0},
    )
"""


def test_the_listing_of_the_docs_works_where_processes_begin_anew(tmp_path: Path) -> None:
    """They read the script once more: on Python 3.14, and below MPI."""
    page = (Path(__file__).parents[2] / "docs/howto/cluster.md").read_text(encoding="utf-8")
    (listing,) = [x for x in re.findall(r"```python\n(.*?)```", page, re.S) if "Process" in x]
    campaigns = Path(__file__).parents[2] / "campaigns"
    own = "import multiprocessing\nmultiprocessing.set_start_method('forkserver', force=True)\n"
    text = listing.replace('"campaigns/', f'"{campaigns}/').replace('toml")', 'toml", samples=2)')
    text = text.replace("executor=pool)", 'executor=pool, out="o")')
    done = in_a_script(own + text, tmp_path, sys.executable)
    assert done.returncode == 0, done.stderr
    assert (ringsim.open_campaign(tmp_path / "o")["status"] == 0).all()


def test_a_design_that_grows_goes_on_from_level_to_level_on_a_dask_cluster(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each level is another round of tasks; dask would take equal ones for those of the last."""
    pytest.importorskip("distributed")
    monkeypatch.setitem(SOLVERS, "full", SOLVERS["full"])  # as it is now, again in the end
    names: dict[str, Any] = {}
    exec(GROWING, names)
    known = comparable(names["growing"]().run(workers=0, out=tmp_path / "alone"))
    done = in_a_script(GROWING + DASK, tmp_path, sys.executable)
    assert done.returncode == 0, done.stderr
    found = comparable(ringsim.open_campaign(tmp_path / "parts"))
    assert found.sizes["sample"] == known.sizes["sample"] > 40
    xr.testing.assert_equal(found.drop_attrs(), known.drop_attrs())


def test_failures_of_all_parts_count_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SOLVERS, "full", "fake_solver:fated")  # fails above 0.012 N
    force = {"kind": "discrete", "values": [0.02, 0.021]}
    keys: dict[str, Any] = {"set": {"structure.sections": 6, "boom": "none", "net": "none"}}
    own = Campaign("ring18", {"loads.force": force}, {"kind": "random", "samples": 4},
                   fidelity="full", max_failed=2, **keys)  # fmt: skip
    with (
        ThreadPoolExecutor(2) as pool,
        pytest.raises(CampaignError, match="more samples than max_failed = 2 failed"),
    ):
        own.run(2, out=tmp_path / "o", executor=pool)


@pytest.mark.quick
def test_a_folder_that_a_task_does_not_see_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such folder"):
        run_part(
            tmp_path / "nowhere", (Allowance(), None, None, frozenset(), {}), (1, 2), False, ""
        )


@pytest.mark.quick
def test_what_is_refused(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(InputError, match="workers = None: an executor runs so many tasks"):
            made().run(out=tmp_path / "o", executor=pool)
        with pytest.raises(InputError, match="part = 1/2: an executor runs all parts"):
            made().run(2, out=tmp_path / "o", part="1/2", executor=pool)
    assert not (tmp_path / "o").exists()
