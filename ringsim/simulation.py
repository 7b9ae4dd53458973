"""One simulation: scene in, outcome or dataset out.  Failures are values, not exceptions.

Two fidelities answer the same questions: the full multibody model (``run``), and the ideal ring
of rigid rods (``run_ideal``), which knows neither asynchrony nor stress and costs a fraction.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ringsim.engine.solve import SOLVERS
from ringsim.scene import Scene
from ringsim.theory.ideal_fidelity import run_ideal, run_ideal_many
from ringsim.variables import Fidelity, Outcome, Status

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIDELITIES", "run", "run_ideal", "run_ideal_many", "simulate"]


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
    try:
        finish = SOLVERS[type(scene.structure)](scene)
        outcome = finish(wall_time=time.perf_counter() - wall, cpu_time=time.process_time() - cpu)
    except Exception as error:  # whatever broke, a campaign goes on and the user learns of it
        traceback.print_exc()  # a campaign keeps it in the sample's log
        outcome = Outcome(Status.ERROR, f"{type(error).__name__}: {error}")
    outcome.values["fidelity"] = np.array(int(Fidelity.FULL))
    return outcome


FIDELITIES: dict[str, Callable[[Scene], Outcome]] = {"full": run, "ideal": run_ideal}
"""What answers a scene, by the word that chooses it."""


def simulate(scene: Scene, fidelity: str = "full") -> xr.Dataset:
    """Run a scene and return its dataset (see ``ringsim.dataset.to_dataset``).

    Raises
    ------
    InputError
        If the ideal ring cannot represent the scene.
    """
    from ringsim.dataset import to_dataset

    return to_dataset(FIDELITIES[fidelity](scene), scene)
