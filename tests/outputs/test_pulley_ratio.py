"""``pulley_ratio`` is the law of friction at the angles of a run, and the ratio of its tensions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from ringsim.cable.friction import BearingFriction
from ringsim.cable.records import Cable, Winch
from ringsim.cable.winding import ConstantWinding
from ringsim.core.chain import Chain
from ringsim.layout.layout import layout_of
from ringsim.outputs.family import Series
from ringsim.outputs.meters import Meters, Reading
from ringsim.outputs.rods_and_cables import PulleyRatio
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.stepping.instant import Energies

HALF, OFFSET, RATIO, PLAN = 0.2889, 0.105, 0.04, np.radians(21.53959)
"""Of truss2: bar half and block offset (m), f / R, and the turn of the plan between sections."""
SCENE = load_scene("truss2").with_values({
    "structure.opening_angle": 100.0,
    "cables.upper.winch.winding": {"kind": "ramp", "speed": 0.02, "duration": 0.3},
    "cables.lower.winch.winding": {"kind": "ramp", "speed": 0.02, "duration": 0.3},
    "joints.vjoint.viscous": 0.5, "solver.end_time": 1.0, "record.interval": 0.05,
})  # fmt: skip


@pytest.fixture(scope="module")
def runs() -> dict[str, xr.Dataset]:
    return {fidelity: simulate(SCENE, fidelity) for fidelity in ("frame", "full")}


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_ratios_are_the_law_at_the_angles_of_the_run(runs, fidelity) -> None:
    """Eqs 19 and 20 of paper 000 while the rope runs; the plan's turn adds to the hinges'."""
    run = runs[fidelity].isel(time=slice(8, None)).sel(plane="upper")
    fold = 0.5 * (np.pi - np.radians(run["opening_angle"].values))
    gamma = np.arctan2(HALF * np.sin(fold) + OFFSET, HALF * np.cos(fold))
    beside = np.pi - np.arccos(np.cos(0.5 * PLAN) * np.cos(gamma))
    angles = [np.pi / 2 - gamma[0], np.pi - 2 * gamma[0], *beside, np.pi - 2 * gamma[1]]
    cosine = RATIO * np.cos(0.5 * np.array(angles))
    expected = (1.0 - cosine) / (1.0 + cosine)
    # Assemblies of an open arc lean by some mrad, as rigid rods let them: f / R times that.
    assert run["pulley_ratio"].values == pytest.approx(expected, rel=2e-4)
    assert np.ptp(expected) > 0.03


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_ratios_are_those_of_the_recorded_tensions(runs, fidelity) -> None:
    run = runs[fidelity]
    ratio, tension = run["pulley_ratio"].values, run["cable_tension"].values
    assert run["pulley_ratio"].dims == ("plane", "pulley", "time")
    assert ratio.shape == (2, 5, 21)
    # Single precision, and both interpolated between steps: the tension by 10 % a step.
    assert ratio[..., 8:] == pytest.approx(tension[:, 1:, 8:] / tension[:, :-1, 8:], rel=1e-5)


def test_both_engines_have_the_same_ratios(runs) -> None:
    frame, full = (runs[name]["pulley_ratio"].values[..., 8:] for name in ("frame", "full"))
    # Opening angles differ by 1e-5 rad, f / R = 0.04.
    assert frame == pytest.approx(full, rel=1e-6)


def reading(*, wound: float, jam: bool = False, speed: float = 1e-3) -> np.ndarray:
    """Of a rope over two pulleys that turn it by 90 deg, wound at a speed (m/s)."""
    law = BearingFriction(coefficient=4e-4)
    winch = Winch(winding=ConstantWinding(speed=0.001))
    chain = Chain([Cable(winch=winch, friction=law, slip_speed=1e-9)], [4])
    points = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]])
    ropes, rate = chain.start(points), np.array([[speed, 0.0]])
    state = chain.state(ropes, points, np.zeros((4, 3)), np.zeros((1, 2)), rate)
    if jam:
        ropes = ropes.jam(0, 1, state.stored, state.wound)
    state = chain.state(ropes, points, np.zeros((4, 3)), np.array([[wound, 0.0]]), rate)
    still = np.zeros((2, 1))
    now = Reading(
        0.0, still, still, Energies(0.0, 0.0, 0.0, 0.0), chain=state, planes=((1,),),
        meters=Meters(SCENE, layout_of(SCENE)),
    )  # fmt: skip
    found = PulleyRatio().read(now)
    assert found is not None
    return found


def ratios(**values: Any) -> np.ndarray:
    found = reading(**values)
    series = Series(np.array([0.0, 1.0]), np.array([found, found]), np.array([0.5]))
    none: Any = None
    return PulleyRatio().reduce(none, series)["pulley_ratio"][..., 0]


def test_a_plane_without_a_cable_has_none() -> None:
    assert np.isnan(ratios(wound=1e-3)[0]).all()
    assert ratios(wound=1e-3)[1] == pytest.approx([0.944987, 0.944987], rel=1e-6)


@pytest.mark.parametrize(("speed", "ratio"), [(0.0, 1.0), (-1e-3, 1.0 / 0.944987)])
def test_a_rope_at_rest_loses_nothing_and_one_that_runs_out_loses_to_the_winch(speed, ratio):
    assert ratios(wound=1e-3, speed=speed)[1] == pytest.approx([ratio, ratio], rel=1e-6)


def test_a_slack_rope_has_no_ratio() -> None:
    assert np.isnan(ratios(wound=-1e-3)).all()


def test_at_a_jammed_pulley_it_is_that_of_both_ropes() -> None:
    """Only the span behind the jam is not pulled by the winch: 0.69 of the slack width is in it."""
    first, second = ratios(wound=1e-3, jam=True)[1]
    assert first == pytest.approx(0.944987, rel=1e-6)
    # 1 mm of 2 m, less what the first pulley takes: T_1 = EA (S / M) (S - M) / (1 + eta) m.
    behind = 1e5 * (2.0 / 1.999) * 1e-3 / (1.0 + 0.944987) * 0.944987
    assert second == pytest.approx(0.05 * np.log(2.0) / behind, rel=1e-6)
