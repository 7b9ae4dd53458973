"""Results do not depend on units: lengths, times and masses times a number change nothing else.

Forces, stiffnesses and speeds follow from the three, so that all numbers without a unit stay, and
so do the results.  The slip speed of ropes is given, as its default has a bound of its own.
"""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from similar import Scale, scaled

from ringsim.outputs import VARIABLES
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run_frame
from ringsim.variables import Outcome

SLIP = {f"cables.{plane}.slip_speed": 2e-4 for plane in ("upper", "lower")}
NAMES = ("ring18", "ring18-cable", "ring18-motor")
COMPARED = ("deployment_time", "lock_time", "asynchrony_max", "peak_tension", "peak_rod_stress")


def ring(name: str) -> Scene:
    small = {"structure.sections": 4, "boom": "none", "record.stress": True}
    scene = load_scene(name).with_values(small)
    return scene if scene.cables is None else scene.with_values(SLIP)


@functools.cache
def unscaled(name: str) -> Outcome:
    """Its run, with which those of all scales are compared."""
    return run_frame(ring(name))


LONGER, ALL = Scale(length=4.0), Scale(length=2.0, time=4.0, mass=16.0)


@pytest.mark.parametrize(
    ("scale", "name"),
    [
        *(pytest.param(ALL, name, id=f"all-{name}") for name in NAMES),
        *(pytest.param(LONGER, name, id=f"longer-{name}") for name in NAMES[:2]),
        pytest.param(LONGER, NAMES[2], id=f"longer-{NAMES[2]}", marks=pytest.mark.slow),
    ],
)
def test_a_similar_ring_has_similar_results(name: str, scale: Scale) -> None:
    """To what Newton leaves: a norm of newtons and newton metres moved the peaks by 1e-3 to 0.1."""
    one, other = unscaled(name), run_frame(scaled(ring(name), scale))
    # Lengths of steps and times are other ones; which numbers they leave uncertain is not.
    reasons = [re.sub(r"steps of .*? are too long for .*?, so", "", r.reason) for r in (one, other)]
    assert reasons[0] == reasons[1]
    for key in set(COMPARED) & set(one.values):
        factor = scale.of(VARIABLES[key].units)
        np.testing.assert_allclose(
            other.values[key] / factor, one.values[key], rtol=2e-5, atol=1e-7, err_msg=key
        )
    # Nor is Newton asked for more in one unit than in another: steps and iterations are alike.
    for key, rel in (("steps", 0.02), ("newton_iterations", 0.05)):
        assert int(other.values[key]) == pytest.approx(int(one.values[key]), rel=rel), key
