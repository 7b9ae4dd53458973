"""One run of the built-in scene for all tests of this folder."""

from __future__ import annotations

import pytest

from ringsim.scene import load_scene
from ringsim.simulation import run
from truss_runs import TrussRun


@pytest.fixture(scope="session")
def truss_run():
    scene = load_scene("planar-truss")
    return TrussRun(scene, run(scene))
