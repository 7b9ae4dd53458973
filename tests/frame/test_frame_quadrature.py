"""Frames against the energy quadrature, which knows neither rods nor steps."""

import functools
import math
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from ringsim.frame.integrate import solve
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import load_scene

AGREEMENT = 2e-5
"""What the steps leave: at 1e-6 of tolerance 7e-7 to 6e-6 for free rings, and at 5e-7 about 1e-5
for fixed ones."""


@functools.cache
def lateness(sections: int, tolerance: float, **values: Any) -> float:
    """Relative error of the time at which the mean opening angle comes to 175 deg."""
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    scene = load_scene("ring18").with_values(
        {
            "structure.sections": sections,
            "net.neutral_length": 0.04 * sections,
            "rods.damping": 0.0,
            "record.interval": 0.01,
            "solver.tolerance": tolerance,
            "solver.newton_tolerance": 1e-7,
            "solver.settling_time": 0.0,
        }
        | chosen
    )
    outcome = solve(scene)
    mean = outcome.values["opening_angle"].mean(axis=(0, 1))
    there = np.isfinite(mean)
    course = CubicSpline(outcome.coordinates["time"][there], mean[there])
    found = course.solve(175.0, extrapolate=False)[0]
    end = 0.5 * (math.pi - math.radians(175.0))
    expected = opening_time(OneCoordinate(scene), scene.structure.coordinate, end).time
    return float(found / expected - 1.0)


@pytest.mark.parametrize("sections", [6, pytest.param(18, marks=pytest.mark.slow),
                                      pytest.param(30, marks=pytest.mark.slow)])  # fmt: skip
def test_free_rings_open_on_time(sections: int) -> None:
    assert abs(lateness(sections, 1e-6, boom="none")) < AGREEMENT


@pytest.mark.parametrize("sections", [pytest.param(6, marks=pytest.mark.quick),
                                      pytest.param(18, marks=pytest.mark.slow),
                                      pytest.param(30, marks=pytest.mark.slow)])  # fmt: skip
def test_fixed_rings_open_on_time(sections: int) -> None:
    """A ring held at one corner bends: 6 sections of the built-in rods open 9e-5 late for that, at
    any tolerance.  Rods a hundred times as stiff, and a thousand times with more sections, which
    bend with the cube of their span, leave the steps' own error; it is larger here than of free
    rings, and as large in exudyn, since the steps damp how stiff rods swing into their load.
    """
    stiffer, tolerance = (100.0, 5e-7) if sections == 6 else (1000.0, 2e-7)
    young = 120e9 * stiffer
    late = lateness(sections, tolerance, boom__base="fixed", rods__young_modulus=young)
    assert abs(late) < AGREEMENT


def test_lateness_falls_with_the_tolerance() -> None:
    """Errors of second order fall with the tolerance, and some terms of first order (first step,
    last output time) less: 1.8e-5 at 1e-4 and 7e-7 at a hundredth of it.
    """
    coarse, fine = (abs(lateness(6, tolerance, boom="none")) for tolerance in (1e-4, 1e-6))
    assert fine < 0.1 * coarse
