"""Stress of a latched ring at rest under its forces, from statics alone.

All V-joints of a closed, symmetric ring are held at 180 deg while +F pulls each upper one up and -F
each lower one down.  What remains when all is at rest is statically determinate but for the ring's
symmetry, which leaves no net push between sections:

- each bar half is a lever from its pin to the V-joint: it carries the shear F / 2, so that the
  moment grows from 0 at the pin to F l / 2 at the V-joint;
- a pin takes F / 2 from the bar, which the diagonal must hold as the vertical part of a tension
  N = F / (2 sin a), a its slope; its horizontal part compresses the bar by F / (2 tan a).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
import xarray as xr

import ringsim

FORCE, SECTIONS = 2.0, 4
BAR, HALF_BAR = (0.012, 0.01115), 0.2889
DIAGONAL, HALF_DIAGONAL = (0.010, 0.00915), 0.4275
SLOPE = math.acos(HALF_BAR / HALF_DIAGONAL)
CLOSE = 5e-3
"""The stops give by 1e-3 rad, which turns the bars out of line, and rods stretch by 1e-6."""


def area(tube: tuple[float, float]) -> float:
    outer, inner = tube
    return math.pi * (outer**2 - inner**2) / 4.0


def bending_stress(moment: float, tube: tuple[float, float]) -> float:
    """At the outer fibre of a tube: M D / 2 over pi (D^4 - d^4) / 64."""
    outer, inner = tube
    return moment * 32.0 * outer / (math.pi * (outer**4 - inner**4))


EXACT, SLOPES = "geometrically-exact", "ancf"
RODS = pytest.mark.parametrize(
    ("kind", "elements"),
    [(EXACT, 1), (EXACT, 2), (SLOPES, 1), pytest.param(SLOPES, 2, marks=pytest.mark.slow)],
)


@lru_cache
def at_rest(kind: str, elements: int) -> xr.Dataset:
    """Heavy damping brings it to rest; what is at rest does not know of it.

    exudyn does not tell what damping carries in rods with slope vectors; joints damp there.
    """
    heavy = {"rods.damping": 0.01} if kind == EXACT else {
        "rods.damping": 0.0, "joints": {"vjoint": {"viscous": 0.5}, "hinge": {"viscous": 0.5}},
    }  # fmt: skip
    scene = ringsim.load_scene("ring18").with_values(
        {
            "structure.sections": SECTIONS,
            "structure.aspect_ratio": 1.0,
            "structure.opening_angle": 179.0,
            "rods.kind": kind,
            "rods.elements": elements,
            "boom": "none",
            "net": "none",
            "loads.force": FORCE,
            "stop": {"stiffness": 2000.0, "damping": 20.0, "latch": True},
            "record.stress": True,
            "record.interval": 0.02,
            "solver.settling_time": 1.0,
            "solver.end_time": 2.0,
            "solver.tolerance": 1e-3,
        }
        | heavy
    )
    run = ringsim.simulate(scene)
    assert int(run["status"]) == 0
    return run


def stresses(rods: str, kind: str, elements: int) -> np.ndarray:
    """Stress of the rod halves whose names begin so, at the end of the run, Pa."""
    final = at_rest(kind, elements)["rod_stress"].dropna("time").isel(time=-1)
    return final.sel(rod=[str(n) for n in final["rod"].values if str(n).startswith(rods)]).values


@RODS
def test_bars_carry_the_force_as_levers(kind: str, elements: int) -> None:
    pushed = FORCE / (2.0 * math.tan(SLOPE)) / area(BAR)
    bent = bending_stress(0.5 * FORCE * HALF_BAR, BAR)
    np.testing.assert_allclose(stresses("bar", kind, elements), pushed + bent, rtol=CLOSE)


@RODS
def test_diagonals_carry_a_pure_tension(kind: str, elements: int) -> None:
    pulled = FORCE / (2.0 * math.sin(SLOPE)) / area(DIAGONAL)
    np.testing.assert_allclose(stresses("diagonal", kind, elements), pulled, rtol=2.0 * CLOSE)


@pytest.mark.parametrize("kind", [EXACT, SLOPES])
def test_it_is_at_rest(kind: str) -> None:
    late = at_rest(kind, 1)["rod_stress"].dropna("time").isel(time=slice(-10, None))
    assert float((late.max("time") / late.min("time") - 1.0).max()) < CLOSE
