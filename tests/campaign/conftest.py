"""Fixtures of the campaign tests."""

from __future__ import annotations

import pytest

from campaign_bench import MPIEXEC, Bench


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.close()


@pytest.fixture
def mpi():
    if MPIEXEC is None:
        pytest.skip("there is no mpiexec: install ringsim[mpich]")
