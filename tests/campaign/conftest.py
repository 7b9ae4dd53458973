"""Fixtures of the campaign tests."""

from __future__ import annotations

import shutil

import pytest

from campaign_bench import MPIEXEC, START, Bench


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.close()


@pytest.fixture
def mpi():
    if MPIEXEC is None:
        pytest.skip("there is no mpiexec: install ringsim[mpich]")


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """A finished campaign; look, but do not change it."""
    bench = Bench(tmp_path_factory.mktemp("whole"))
    bench.write()
    bench.run(*START)
    return bench


@pytest.fixture
def copied(whole, tmp_path):
    """A copy of the finished campaign."""
    shutil.copytree(whole.folder, tmp_path, dirs_exist_ok=True)
    return Bench(tmp_path)
