"""From the history of a planar truss to its outcome on the scene's own time grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.engine.outcome import add_energies, on_grid, output_times
from ringsim.engine.planar_truss import TrussModel
from ringsim.engine.planar_truss_run import TrussHistory
from ringsim.variables import Outcome

Array = NDArray[np.float64]


def to_outcome(
    history: TrussHistory, model: TrussModel, *, wall_time: float, cpu_time: float
) -> Outcome:
    """Put a run on the output grid; what lies after its end is NaN.

    The strain is given at the nodes of the upper beam, where a beam loaded at its nodes is bent
    most.
    """
    grid, times = output_times(model.scene), np.array(history.times)
    tensions, strains = np.array(history.tensions), np.array(history.strains)
    slack = np.array(history.slack, dtype=float)
    angles = on_grid(grid, times, np.array(history.angles), np.array(history.rates))
    values: dict[str, Array] = {"opening_angle": np.degrees(angles)[None, None]}
    add_energies(values, grid, times, history.energies, history.gaps)
    values |= {
        "cable_length": on_grid(grid, times, np.array(history.cable_lengths))[None],
        "wound_length": on_grid(grid, times, np.array(history.wound))[None],
        "cable_tension": on_grid(grid, times, tensions).T[None],
        "bending_strain": on_grid(grid, times, strains).T,
        "peak_tension": np.array(tensions.max()),
        "peak_tension_time": np.array(times[np.argmax(tensions.max(axis=1))]),
        "peak_bending_strain": np.array(np.abs(strains).max()),
        "slack_duration": np.array([np.sum(0.5 * np.diff(times) * (slack[1:] + slack[:-1]))]),
        "steps": np.array(len(times) - 1),
        "newton_iterations": np.array(history.newton_iterations),
        "jacobians": np.array(history.jacobians),
        "final_time": np.array(times[-1]),
        "wall_time": np.array(wall_time),
        "cpu_time": np.array(cpu_time),
    }
    coordinates = {
        "plane": np.array(model.truss.planes),
        "section": np.arange(1, model.truss.sections + 1),
        "time": grid,
        "span": np.arange(1, tensions.shape[1] + 1),
        "station": model.upper.places,
    }
    return Outcome(history.status, history.reason, coordinates, values)
