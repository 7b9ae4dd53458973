"""Cables along a net's edge: closed forms on the rigid ring, the quadrature, and both engines."""

from __future__ import annotations

import functools
import math
from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr
from loops import for_each
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.optimize import brentq

from motor_rings import ring
from ringsim.layout.layout import layout_of
from ringsim.parts.laws import Corners, PairLaw, Reaction, one_sided
from ringsim.parts.margin import EcssMechanisms
from ringsim.parts.net import Net
from ringsim.refusal import InputError
from ringsim.rigid.margin import DriveMargin
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene, load_scene
from ringsim.shapes import shape_of
from ringsim.simulation import simulate
from ringsim.units import PerSection

STIFFNESS, STRAIN = 2000.0, 0.01
NET = {"kind": "boundary", "axial_stiffness": STIFFNESS, "strain": STRAIN}
SPRING = {"kind": "linear", "stiffness": 0.02, "preload": 0.2}
HALF_BAR, OFFSET = 0.2889, 0.006554
FARTHEST = 2.0 * (HALF_BAR + OFFSET)


def sprung(**values: object) -> Scene:
    """Three sections from 150 deg on that springs open, without cables of a drive."""
    plain = {
        "cables": "none", "structure.sections": 3, "structure.opening_angle": 150.0, "joints": {},
        "hinge_spring": SPRING, "net": NET, "solver.tolerance": 5e-5, "solver.end_time": 1.0,
        "solver.step": 0.02, "solver.newton_tolerance": 1e-6, "record.interval": 2e-3,
        "stop.latch": True,
    }  # fmt: skip
    return ring().with_values(plain | {k.replace("__", "."): v for k, v in values.items()})


@functools.cache
def opened(fidelity: str = "frame") -> xr.Dataset:
    return simulate(sprung(), fidelity)


def tension(angle: float, strain: float = STRAIN) -> float:
    """Of a cable between corners 2 (l sin(angle / 2) + a) apart."""
    distance = 2.0 * (HALF_BAR * math.sin(0.5 * angle) + OFFSET)
    return STIFFNESS * max(distance * (1.0 + strain) / FARTHEST - 1.0, 0.0)


def stored(angle: float) -> float:
    return 0.5 * tension(angle) ** 2 / STIFFNESS * FARTHEST / (1.0 + STRAIN)


def test_resistance_is_that_of_virtual_work() -> None:
    found = DriveMargin(sprung(), EcssMechanisms())
    for degrees in (120.0, 160.0, 172.0, 176.0, 179.5):
        angle = math.radians(degrees)
        by_angle = HALF_BAR * math.cos(0.5 * angle)
        resisting = found.at(angle).resisting["net"]
        assert resisting == pytest.approx(6 * tension(angle) * by_angle, rel=1e-9, abs=1e-12)


def test_cables_of_every_section_and_of_one_plane() -> None:
    strains = [0.02, -0.01, 0.0]
    scene = sprung(
        net__strain=strains, net__planes="upper", solver__end_time=0.05,
        rods__young_modulus=1.2e13,
    )  # fmt: skip
    (edge,) = layout_of(scene).pair_laws
    np.testing.assert_allclose(edge.natural, FARTHEST / (1.0 + np.array(strains)), rtol=1e-12)
    assert [plane for plane, _ in edge.places] == [0, 0, 0]
    run = simulate(scene, "frame")
    last = run.dropna("time", how="all", subset=["net_tension"]).isel(time=-1)
    angles = np.radians(last.opening_angle.sel(plane="upper").values)
    expected = [tension(*both) for both in zip(angles, strains, strict=True)]
    assert expected[0] > 0.0 == expected[1]
    # The corners of rods that hardly give are as far apart as each section's own angle says.
    np.testing.assert_allclose(last.net_tension.sel(plane="upper"), expected, rtol=1e-3)
    assert np.isnan(run.net_tension.sel(plane="lower")).all()
    assert int(run.peak_net_tension_section) == 1


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_the_ring_opens_in_the_time_of_the_quadrature(fidelity: str) -> None:
    """Springs give their energy, cables take theirs: T = integral of sqrt(I / (2 W)) dphi."""
    scene = sprung()
    free, start = OneCoordinate(scene.with_values({"net": "none"})), scene.structure.coordinate

    def slowness(u: float) -> float:
        phi = start * (1.0 - u * u)
        work = free.work(phi) - free.work(start) - 6 * stored(math.pi - 2.0 * phi)
        return 2.0 * u * start * math.sqrt(0.5 * free.motion(phi).inertia / work)

    taut = brentq(lambda phi: tension(math.pi - 2.0 * phi) - 1e-9, 0.01, start)
    kink = math.sqrt(1.0 - taut / start)
    time = quad(slowness, 0.0, kink)[0] + quad(slowness, kink, 1.0)[0]
    found = opened(fidelity)
    assert float(found.deployment_time) == pytest.approx(time, rel=2e-3)
    before = found.time.values < time - 2e-3
    angles = np.radians(found.opening_angle.values[..., before])
    expected = np.vectorize(tension)(angles)
    assert expected[..., -1].min() > 15.0
    # Bars give by 1 % of it.
    np.testing.assert_allclose(found.net_tension.values[..., before], expected, atol=0.2)
    assert float(found.energy_error) < 1e-3


def test_springs_that_are_too_weak_stop_where_the_cables_hold_them() -> None:
    scene = sprung(
        hinge_spring={"kind": "linear", "stiffness": 0.0, "preload": 0.2},
        joints={"vjoint": {"viscous": 0.1}}, solver__end_time=4.0,
        rods__young_modulus=1.2e13,
    )  # fmt: skip
    held = brentq(
        lambda angle: 0.2 - tension(angle) * HALF_BAR * math.cos(0.5 * angle),
        math.radians(160.0), math.radians(170.0),
    )  # fmt: skip
    found = simulate(scene, "frame")
    assert int(found.locked_joints) == 0
    # Usual rods give, so that it opens by 0.07 deg more: these are a hundred times as stiff.
    last = found.opening_angle.dropna("time").isel(time=-1)
    np.testing.assert_allclose(last, math.degrees(held), atol=2e-3)


def test_drawings_tell_taut_cables_from_slack_ones() -> None:
    run = opened()
    shape = shape_of(run, sprung())
    slack, taut = (shape.lines(shape.at(t)) for t in (0.0, float(run.deployment_time)))
    assert len(slack["net, slack"]) == 6
    assert "net, taut" not in slack
    assert len(taut["net, taut"]) >= 2


@for_each(
    ("values", "text"),
    [
        ({"net": {"kind": "boundary", "strain": 0.01}}, "net.axial_stiffness"),
        ({"net.strain": 0.2}, "net.strain = 0.2"),
        ({"net.strain": [0.1, 0.0]}, "needs 3"),
        ({"net.axial_stiffness": 0.0}, "net.axial_stiffness = 0.0"),
        ({"net.planes": "middle"}, "net.planes"),
        ({"net.stiffness": 1.0}, "net.stiffness"),
        ({"net.kind": "rim"}, "net"),
    ],
)
def test_nets_that_cannot_be_are_refused(values: dict[str, object], text: str) -> None:
    with pytest.raises((InputError, ValidationError), match=text):
        sprung().with_values(values)


def test_a_net_without_a_kind_has_a_hub() -> None:
    assert load_scene("ring18-cable").net.kind == "hub"


class DiagonalNet(Net):
    """A kind that this test brings: strings with dampers from upper corners to the next lower
    ones."""

    kind: Literal["diagonal"] = "diagonal"
    stiffness: PerSection[float]
    damping: float = 0.0

    def laws(self, corners: Corners) -> list[PairLaw]:
        every = np.arange(corners.sections)
        upper, lower = corners.row(0), corners.row(1)
        bodies = np.stack([upper[every], lower[(every + 1) % len(lower)]], axis=1)
        return [PairLaw("net", self, bodies, every, lambda: np.full(len(every), 0.5), "spring")]

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        return one_sided(stretch, rate, self.stiffness, self.damping, 1e-3, xp)


def test_a_net_of_ones_own_works_everywhere_unasked() -> None:
    """Virtual work of its strings in the margin; the quadrature; both engines; the balance."""
    each = [20.0, 10.0, 30.0]
    scene = sprung(net={"kind": "diagonal", "stiffness": each, "damping": 0.5})

    def energy(angle: float) -> float:
        layout = layout_of(scene, 0.5 * (math.pi - angle))
        places = np.array([body.pose.place for body in layout.bodies])
        (law,) = layout.pair_laws
        arms = np.diff(places[law.bodies], axis=1)[:, 0]
        stretch = np.maximum(np.linalg.norm(arms, axis=1) - 0.5, 0.0)
        return float(0.5 * np.array(each) @ stretch**2)

    found, step = DriveMargin(scene, EcssMechanisms()), 1e-5
    for degrees in (155.0, 165.0, 175.0):
        angle = math.radians(degrees)
        slope = (energy(angle + step) - energy(angle - step)) / (2.0 * step)
        assert abs(slope) > 1e-3
        resisting = found.at(angle)
        told = resisting.resisting["net"] - resisting.driving.get("net", 0.0)
        assert told == pytest.approx(slope, rel=1e-6)
    frame, full = (simulate(scene, fidelity) for fidelity in ("frame", "full"))
    assert float(frame.energy_error) < 1e-3
    assert float(full.energy_error) < 1e-3
    assert float(frame.deployment_time) == pytest.approx(float(full.deployment_time), rel=1e-4)
    before = frame.time.values < float(frame.deployment_time) - 2e-3
    gap = (frame.opening_angle - full.opening_angle).values[..., before]
    # Without a net both engines differ as much: 3e-6 s of 45 ms, at a quarter turn in that time.
    assert np.nanmax(np.abs(gap)) < 4e-3
