"""Fixtures of the campaign tests."""

from __future__ import annotations

import shutil

import pytest

from campaign_bench import Bench


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.close()


@pytest.fixture
def mpi():
    if shutil.which("mpiexec") is None:
        pytest.skip("there is no mpiexec: install ringsim[mpich]")
