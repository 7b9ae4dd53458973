"""One simulation: scene in, outcome or dataset out.  Failures are values, not exceptions."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from ringsim.engine.solve import SOLVERS
from ringsim.scene import Scene
from ringsim.variables import Outcome

if TYPE_CHECKING:
    import xarray as xr


def run(scene: Scene) -> Outcome:
    """Build and integrate a scene.

    Parameters
    ----------
    scene
        What to simulate.

    Returns
    -------
    Outcome
        Arrays on the scene's output grid.  A solve that fails or does not reach its goal has a
        status other than OK and the reason; it never raises.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    finish = SOLVERS[type(scene.structure)](scene)
    return finish(wall_time=time.perf_counter() - wall, cpu_time=time.process_time() - cpu)


def simulate(scene: Scene) -> xr.Dataset:
    """Run a scene and return its dataset (see ``ringsim.dataset.to_dataset``)."""
    from ringsim.dataset import to_dataset

    return to_dataset(run(scene), scene)
