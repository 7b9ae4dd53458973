"""From the history of a run to its outcome on the scene's own time grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ringsim.engine.history import History
from ringsim.layout.halves import halves
from ringsim.layout.layout import Layout
from ringsim.scene import Scene
from ringsim.stepping.instant import Energies
from ringsim.stepping.locks import lock_times
from ringsim.variables import Outcome

Array = NDArray[np.float64]
_POINTS = 8
"""Points in each step at which the largest asynchrony is looked for."""


def output_times(scene: Scene) -> Array:
    """The scene's output grid in s: multiples of ``record.interval`` up to the end time."""
    count = math.floor(scene.solver.end_time / scene.record.interval * (1.0 + 1e-12))
    return np.asarray(np.arange(count + 1) * scene.record.interval, dtype=float)


def largest_spread(times: Array, angles: Array, rates: Array, until: float) -> float:
    """Largest difference between the joints' angles up to a time, rad.

    Looked for at ``_POINTS`` points in each step, on the cubics that fit angles and rates at its
    ends, and at ``until`` itself: a few long steps step over the moment of the largest one.

    Parameters
    ----------
    times, angles, rates
        Shapes (n,), (n, joints) and the same; s, rad, rad/s.
    until
        s; infinite for the whole run.
    """
    largest = float(np.ptp(angles[0]))
    begun = int(np.searchsorted(times[:-1], until))
    span = np.diff(times[: begun + 1])[:, None]
    part = np.minimum(until - times[:begun, None], span) / span
    first, last = angles[:begun], angles[1 : begun + 1]
    leaving, arriving = rates[:begun], rates[1 : begun + 1]
    for point in range(1, _POINTS + 1):
        s = point / _POINTS * part
        value = s**2 * (3.0 - 2.0 * s) * (last - first)  # in place: no spline of the whole run
        value += first
        value += s * (1.0 - s) ** 2 * span * leaving
        value -= s**2 * (1.0 - s) * span * arriving
        largest = max(largest, float(np.ptp(value, axis=1).max(initial=0.0)))
    return largest


def to_outcome(history: History, scene: Scene, layout: Layout) -> Outcome:
    """Put a run on the output grid; what lies after its end is NaN."""
    sections = scene.structure.sections
    grid = output_times(scene)
    times = np.array(history.times)
    angles, rates = np.array(history.angles), np.array(history.rates)
    values: dict[str, Array] = {}

    deployed = math.nan
    if scene.structure.locks:
        locks = lock_times(times, angles, rates)
        deployed = float(locks.max()) if np.isfinite(locks).all() else math.nan
        values["lock_time"] = locks
        values["deployment_time"] = np.array(deployed)

    opening = on_grid(grid, times, angles, rates)
    values["opening_angle"] = np.degrees(np.moveaxis(opening, 0, -1))
    if scene.structure.locks:
        flat = values["opening_angle"].reshape(-1, len(grid))
        values["asynchrony"] = flat.max(axis=0) - flat.min(axis=0)
        until = deployed if math.isfinite(deployed) else math.inf
        joints = angles.reshape(len(times), -1), rates.reshape(len(times), -1)
        largest = math.degrees(largest_spread(times, *joints, until))
        on_time = values["asynchrony"][grid <= until]
        values["asynchrony_max"] = np.array(np.fmax.reduce(on_time, initial=largest))

    add_energies(values, grid, times, history.energies, history.gaps)
    if history.stresses:
        stresses = np.array(history.stresses)
        values["rod_stress"] = np.moveaxis(on_grid(grid, times, stresses), 0, -1)
        values["peak_rod_stress"] = np.array(stresses.max())
    _add_cables(values, history, scene, grid, deployed)
    counts = {
        "steps": len(times) - 1,
        "repeated_steps": history.halvings,
        "newton_iterations": history.newton_iterations,
        "jacobians": history.jacobians,
    }
    values.update({name: np.array(count) for name, count in counts.items()})
    values["final_time"] = np.array(times[-1])
    coordinates = {
        "plane": np.array(scene.structure.planes),
        "section": np.arange(1, sections + 1),
        "time": grid,
    }
    if "rod_stress" in values:
        coordinates["rod"] = np.array(list(halves(layout)))
    if history.strains:
        strains = np.array(history.strains)
        values["bending_strain"] = on_grid(grid, times, strains).T
        values["peak_bending_strain"] = np.array(np.abs(strains).max())
        number = next(k for k, r in enumerate(layout.rods) if r.name == scene.structure.gauge)
        gauge = layout.rods[number]
        coordinates["station"] = np.array(gauge.stations) * gauge.length
        values["cable_length"] = on_grid(grid, times, np.array(history.lengths)[:, -1])[None]
    if "cable_tension" in values:
        coordinates["span"] = np.arange(1, values["cable_tension"].shape[1] + 1)
    return Outcome(history.status, history.reason, coordinates, values)


def add_energies(
    values: dict[str, Array],
    grid: Array,
    times: Array,
    readings: Sequence[Energies],
    gaps: Sequence[float],
) -> None:
    """Energies and joint gaps (m) over time, what the balance lacks, and the largest gap."""
    energies = np.array(readings)
    kinetic, elastic = energies[:, 0], energies[:, 1]
    lost = np.cumsum(energies[:, 3])
    work = energies[:, 2] + np.cumsum(energies[:, 4])
    for name, series in (
        ("kinetic_energy", kinetic),
        ("elastic_energy", elastic),
        ("work", work),
        ("dissipation", lost),
        ("constraint_violation", np.array(gaps)),
    ):
        values[name] = on_grid(grid, times, series)
    balance = kinetic - kinetic[0] + elastic - elastic[0] + lost - work
    exchanged = max(np.abs(work).max(), np.ptp(kinetic), np.ptp(elastic), 1e-300)
    values["energy_error"] = np.array(np.abs(balance).max() / exchanged)
    values["constraint_error"] = np.array(max(gaps))


def _add_cables(
    values: dict[str, Array], history: History, scene: Scene, grid: Array, deployed: float
) -> None:
    """Tensions by plane and span; NaN where a plane has no cable, or the other one more spans.

    The peak counts up to the deployment time (s; NaN for the whole run): winches that go on
    pulling at a locked ring raise the tension for as long as one cares to simulate.
    """
    if scene.cables is None or not history.tensions:
        return
    times = np.array(history.times)
    tensions = np.array(history.tensions)
    slack = np.array(history.slack)
    planes = len(scene.structure.planes)
    by_plane = np.full((planes, scene.spans, len(grid)), np.nan)
    loose = np.full(planes, np.nan)
    wound = np.full((planes, len(grid)), np.nan)
    begin = 0
    for number, (plane, cable) in enumerate(scene.cables.present()):
        end = begin + scene.pulleys_of(cable) + 1
        by_plane[plane, : end - begin] = on_grid(grid, times, tensions[:, begin:end]).T
        begin = end
        ends = slack[:, number]
        loose[plane] = float(np.sum(0.5 * np.diff(times) * (ends[1:] + ends[:-1])))
        wound[plane] = on_grid(grid, times, np.array(history.wound)[:, number])
    values["cable_tension"] = by_plane
    values["slack_duration"] = loose
    values["wound_length"] = wound
    largest = tensions.max(axis=1)
    if math.isfinite(deployed):
        until = times <= deployed
        last = on_grid(np.array([deployed]), times, tensions).max()
        times, largest = np.append(times[until], deployed), np.append(largest[until], last)
    values["peak_tension"] = np.array(largest.max())
    values["peak_tension_time"] = np.array(times[np.argmax(largest)])


def on_grid(grid: Array, times: Array, series: Array, rates: Array | None = None) -> Array:
    """Interpolate along the first axis: cubic Hermite with rates, else shape-preserving cubic.

    NaN after the end of the run, and everywhere if the series is not known throughout.
    """
    found = np.full((len(grid), *series.shape[1:]), np.nan)
    inside = grid <= times[-1] * (1.0 + 1e-12)
    where = np.minimum(grid[inside], times[-1])
    if not np.isfinite(series).all():
        return found
    if len(times) == 1:
        found[inside] = series[0]
    elif rates is not None:
        found[inside] = CubicHermiteSpline(times, series, rates, axis=0)(where)
    else:
        found[inside] = PchipInterpolator(times, series, axis=0)(where)
    return found
