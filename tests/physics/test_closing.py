"""A run that has ended holds nothing: campaigns run thousands in one process."""

from __future__ import annotations

import gc
import weakref

import pytest

from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration
from ringsim.scene import load_scene


@pytest.mark.parametrize("name", ["truss2", "planar-truss"])
def test_a_run_that_is_over_is_collected(name: str) -> None:
    scene = load_scene(name).with_values({"solver.end_time": 0.1})
    run = Integration(build(scene))
    history = run.run()
    left = weakref.ref(run)
    del run
    gc.collect()
    assert left() is None
    assert history.newton_iterations > 0
