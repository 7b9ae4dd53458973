"""Rings by both engines, each converged by itself."""

from typing import Any

import numpy as np
import pytest

from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.scene import Scene, load_scene
from ringsim.variables import Outcome


def deviations(outcome: Outcome) -> Any:
    """Of every opening angle from the mean one, deg."""
    angles = outcome.values["opening_angle"]
    return angles - angles.mean(axis=(0, 1))


def six(step: float, end: float) -> Scene:
    """An ellipse of six, whose deviations grow as it opens; both engines take the same steps."""
    return load_scene("ring18").with_values(
        {
            "structure.sections": 6,
            "net": "none",
            "loads.force": [0.05, 0.055, 0.05, 0.06, 0.05, 0.05],
            "solver.step_control": "constant",
            "solver.step": step,
            "solver.end_time": end,
            "solver.newton_tolerance": 1e-7,
        }
    )


@pytest.mark.slow  # test_frame_laws.py compares the angles of such a ring
@pytest.mark.parametrize(
    ("step", "end"),
    [(0.01, 2.0), (1e-3, 3.25)],
)
def test_joints_of_a_ring_of_six_deviate_alike(step: float, end: float) -> None:
    """To 1e-3 of the largest deviation at every time: with the same steps, and the same rods, only
    Newton's residual is left, 1e-7 of the drive, over a stiffness that carries 1e-3 of it.  Up to
    the stops: 40 ms behind twelve impacts within 4 ms they differ by 0.12 deg of 1.0 in steps of
    1 ms, and by 0.005 deg in steps of 0.25 ms.
    """
    scene = six(step, end)
    here, there = (deviations(solve(scene)) for solve in (by_frames, by_exudyn))
    both = np.isfinite(here) & np.isfinite(there)
    assert np.array_equal(np.isfinite(here), np.isfinite(there))
    largest = np.abs(there).max(axis=(0, 1), keepdims=True)
    bound = np.broadcast_to(1e-3 * largest + 1e-6, there.shape)  # round-off at the start, deg
    assert np.all(np.abs(here - there)[both] <= bound[both])
    assert np.nanmax(largest) > 1e-3


def cable_ring(**values: Any) -> Scene:
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    recorded = {"record.stress": True, "record.reactions": True}
    return load_scene("ring18-cable").with_values(chosen | recorded)


def compare(
    scene: Scene, asynchrony: float, tension: float, stress: float, lock: float, base: float
) -> None:
    """Bounds in deg, relative, relative, s, and relative to the largest turn of the base."""
    here, there = (solve(scene).values for solve in (by_frames, by_exudyn))
    shared = min(here["asynchrony"].shape[0], there["asynchrony"].shape[0])
    apart = np.abs(here["asynchrony"][:shared] - there["asynchrony"][:shared])
    assert np.nanmax(apart) < asynchrony
    assert float(here["peak_tension"]) == pytest.approx(float(there["peak_tension"]), rel=tension)
    assert float(here["peak_rod_stress"]) == pytest.approx(
        float(there["peak_rod_stress"]), rel=stress
    )
    assert np.abs(here["lock_time"] - there["lock_time"]).max() < lock
    turns = [values["base_rotation"][:, :shared] for values in (here, there)]
    assert np.nanmax(np.abs(turns[0] - turns[1])) < base * np.nanmax(np.abs(turns[1]))


@pytest.mark.slow
def test_the_cable_ring_of_eighteen() -> None:
    """At a fifteenth of its tolerance; bounds are a tenth of what the scene's own tolerance leaves.
    Deviations are not followed: that would take ten times the steps.
    """
    scene = cable_ring(solver__tolerance=2e-4, solver__deviation_tolerance=1e6)
    compare(scene, asynchrony=0.01, tension=1e-3, stress=5e-3, lock=3e-3, base=1e-2)


@pytest.mark.slow  # test_frame_laws.py compares rings on cables, with equal steps
def test_a_cable_ring_of_four() -> None:
    """The same, from 150 deg on, at a coarse tolerance: the steps of both are alike, too."""
    scene = cable_ring(
        structure__sections=4, structure__opening_angle=150.0, solver__tolerance=1e-3,
        solver__deviation_tolerance=1e6, solver__settling_time=0.0,
    )  # fmt: skip
    compare(scene, asynchrony=0.02, tension=5e-3, stress=2e-2, lock=1e-2, base=1e-3)
