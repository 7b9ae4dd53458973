"""Positions over time: rods keep their lengths in them, and both engines tell the same."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

from ringsim.layout.layout import layout_of
from ringsim.layout.points import Points, points_of
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate

BOOMS = ("rigid", "flexible")


@cache
def scene_of(boom: str, **values: Any) -> Scene:
    """Five sections with net and boom, the same constant steps for either engine."""
    chosen = {
        "structure.sections": 5, "structure.opening_angle": 100.0, "loads.force": 0.08,
        "boom": {"kind": boom}, "record.positions": True, "record.stress": True,
        "record.interval": 0.037, "solver.step_control": "constant", "solver.step": 0.01,
        "solver.end_time": 0.8,
    }  # fmt: skip
    return load_scene("ring18").with_values(chosen | values)


@cache
def run_of(boom: str, fidelity: str) -> xr.Dataset:
    return simulate(scene_of(boom), fidelity)


def points(scene: Scene) -> Points:
    return points_of(layout_of(scene), scene.structure.planes)


def places(run: xr.Dataset) -> np.ndarray:
    found = run["position"].dropna("time", how="all").transpose("time", "point", "axis").to_numpy()
    assert np.isfinite(found).all()
    assert len(found) > 20
    return np.asarray(found)


def lengths(where: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    ends = where[..., pairs[:, 0], :], where[..., pairs[:, 1], :]
    return np.asarray(np.linalg.norm(ends[1] - ends[0], axis=-1))


@pytest.mark.parametrize(
    ("boom", "fidelity"),
    [
        # Of a rigid boom exudyn's nodes are fewer, and otherwise alike.
        pytest.param(
            boom, fidelity, marks=pytest.mark.slow if (boom, fidelity) == ("rigid", "full") else ()
        )
        for boom in BOOMS
        for fidelity in ("frame", "full")
    ],
)
def test_rods_keep_their_lengths_but_for_their_strain(boom: str, fidelity: str) -> None:
    """Also between steps: output times are no multiples of them.  A chord is shorter than a bent
    rod by less than its bending strain.
    """
    scene, run = scene_of(boom), run_of(boom, fidelity)
    found, start = places(run), points(scene).places(layout_of(scene))
    np.testing.assert_allclose(found[0], start, atol=1e-12)
    assert np.abs(found[-1] - found[0]).max() > 0.1  # it moves
    strain = float(run["peak_rod_stress"]) / 120e9
    assert 1e-7 < strain < 1e-3
    for group in ("diagonals", "bars"):
        pairs = points(scene).lines[group]
        assert np.abs(lengths(found, pairs) / lengths(start, pairs) - 1.0).max() < strain
    for group in ("hinge assemblies", "boom"):
        pairs = points(scene).lines[group]
        bends = 1e-3 if (group, boom) == ("boom", "flexible") else 1e-8
        np.testing.assert_allclose(lengths(found, pairs) - lengths(start, pairs), 0.0, atol=bends)


@pytest.mark.parametrize(("boom", "share"), [("rigid", 5e-5), ("flexible", 5e-4)])
def test_engines_agree(boom: str, share: float) -> None:
    """To a share of the way that the farthest point has gone; flexible booms are clamped in two
    ways, by a frame and by two points.
    """
    one, other = (run_of(boom, fidelity)["position"] for fidelity in ("frame", "full"))
    assert one["point"].to_numpy().tolist() == other["point"].to_numpy().tolist()
    way = float(np.abs(other - other.isel(time=0)).max())
    assert float(np.abs(one - other).max()) < share * way


def test_joints_stand_at_their_opening_angles() -> None:
    """The angle between the lines to the pins of its two bar halves; bars are almost straight."""
    scene, run = scene_of("rigid"), run_of("rigid", "full")
    where, known = points(scene), run["position"].transpose("time", "point", "axis").to_numpy()
    bars = where.lines["bars"]
    for (plane, section), joint in np.ndenumerate(where.openings):
        first, second = (
            known[:, pair[pair != joint][0]] - known[:, joint] for pair in bars if joint in pair
        )
        cosine = np.sum(first * second, axis=1) / lengths(known, bars)[:, 0] ** 2
        told = np.radians(run["opening_angle"].to_numpy()[plane, section])
        np.testing.assert_allclose(np.arccos(cosine), told, atol=2e-3)
        name = f"{('upper', 'lower')[plane]} V-joint {section + 1}"
        assert run["point"].to_numpy()[joint] == name


def test_names_are_told_apart_and_are_the_same_at_every_angle() -> None:
    scene = load_scene("ring18")
    found = [points_of(layout_of(scene, q), scene.structure.planes) for q in (0.1, 1.2)]
    assert found[0].names == found[1].names
    assert len(set(found[0].names)) == len(found[0].names) == 18 * 9 + 2
    assert {"hub", "boom tip", "pivot 18", "lower corner 1 pin 18"} - {*found[0].names} == {
        "boom tip"  # of a rigid boom it is a place on its hinge assembly
    }


@pytest.mark.parametrize("scene", ["planar-truss", "truss2"])
def test_other_structures_have_them(scene: str) -> None:
    ancf = {"rods.kind": "ancf"} if scene == "truss2" else {}
    chosen = load_scene(scene).with_values(
        {"record.positions": True, "record.interval": 0.02, "solver.end_time": 0.1, **ancf}
    )
    run = simulate(chosen)
    known = run["position"].transpose("time", "point", "axis").to_numpy()
    np.testing.assert_allclose(known[0], points(chosen).places(layout_of(chosen)), atol=1e-9)
    assert np.isfinite(known).all()


def test_nobody_asked() -> None:
    run = simulate(load_scene("truss2").with_values({"solver.end_time": 0.1}))
    assert "position" not in run
    assert not {"point", "axis"} & {*run.dims}
