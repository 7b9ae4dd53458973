"""Fixtures of the campaign tests."""

from __future__ import annotations

import shutil

import pytest

from campaign_bench import Bench


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


@pytest.fixture
def mpi():
    if shutil.which("mpiexec") is None:
        pytest.skip("there is no mpiexec: install ringsim[mpich]")
