"""Kinds of one's own, one record each, in both engines unasked: a bistable hinge, and an output
that reads bodies, which no other output does.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr

from ringsim.layout.layout import layout_of
from ringsim.outputs.family import OUTPUTS, VARIABLES, Array, Output, Reading, Variable
from ringsim.parts.joints import HingeSpring
from ringsim.parts.laws import Reaction
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.units import PerSection
from ringsim.variables import Status

APART = np.radians(60.0)


class BistableHinge(HingeSpring):
    """Rests deployed and folded by 60 deg: U = c x^2 (x - b)^2 / 2 at the folded angle x."""

    kind: Literal["bistable"] = "bistable"
    stiffness: PerSection[float]

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        hill = folded * (folded - APART)
        slope = self.stiffness * hill * (2.0 * folded - APART)
        return Reaction(slope, 0.0 * folded, 0.5 * self.stiffness * hill * hill)


def ring(opening: float) -> Scene:
    return load_scene("ring18").with_values(
        {
            "structure.sections": 3, "structure.opening_angle": opening, "loads": "none",
            "boom": "none", "net": "none", "joints.vjoint": {"viscous": 2e-3},
            "hinge_spring": {"kind": "bistable", "stiffness": [0.8, 1.0, 1.2]},
            "solver.end_time": 0.6, "solver.tolerance": 5e-4, "solver.newton_tolerance": 1e-6,
        }
    )  # fmt: skip


# Both engines turn the same joints in the test below.
@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_a_bistable_hinge_opens_or_stays(fidelity: str) -> None:
    """Just beyond the top of its hill (150 deg) it opens, just before it folds back to 120 deg."""
    opened, back = (simulate(ring(at), fidelity=fidelity) for at in (151.0, 149.0))
    for run, at in ((opened, 151.0), (back, 149.0)):
        assert int(run.status) in (Status.OK, Status.TIMEOUT), run.attrs["reason"]
        folded = np.radians(180.0 - at)
        hill = 0.5 * (folded * (folded - APART)) ** 2
        # Of all six joints, with 0.8 + 1.0 + 1.2 on either plane.
        assert float(run.elastic_energy[0]) == pytest.approx(6.0 * hill, rel=1e-9)
        assert float(run.energy_error) < 2e-3
    assert np.isfinite(float(opened.deployment_time))
    assert not np.isfinite(float(back.deployment_time))
    last = back.opening_angle.dropna("time").isel(time=-1)
    assert last.values == pytest.approx(120.0, abs=25.0)  # it swings from 149 to 108 deg, and less


@pytest.fixture
def corner_height() -> Iterator[None]:
    """An output that nothing knows any more after the test."""
    before, shipped = list(OUTPUTS), dict(VARIABLES)

    class CornerHeight(Output):
        """Height of the mean of all corners of a plane above that of all planes."""

        variables = (
            Variable("corner_height", ("plane", "time"), "m", "height of the corners of a plane"),
        )

        def read(self, now: Reading) -> Array:
            heights = now.meters.corners(now.meters.bodies().places)[..., 2]
            return np.asarray(heights.mean(axis=1) - heights.mean())

    yield
    OUTPUTS[:] = before
    VARIABLES.clear()
    VARIABLES.update(shipped)


@pytest.mark.usefixtures("corner_height")
def test_an_output_may_read_bodies_in_both_engines() -> None:
    scene = ring(151.0).with_values({"solver.end_time": 0.5})
    one, other = (simulate(scene, fidelity=fidelity) for fidelity in ("frame", "full"))
    layout = layout_of(scene)
    drawn = np.array([[layout.bodies[n].pose.place[2] for n in row] for row in layout.corners])
    expected = drawn.mean(axis=1) - drawn.mean()
    for run in (one, other):
        assert isinstance(run, xr.Dataset)
        assert run.corner_height.isel(time=0).values == pytest.approx(expected, abs=1e-12)
    assert float(np.ptp(one.corner_height.dropna("time").values)) > 1e-3
    assert float(np.abs(one.corner_height - other.corner_height).max()) < 1e-5
