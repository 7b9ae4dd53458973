"""Energy of the built-in scenes in both engines, and the rule by which they count losses."""

from typing import Any

import numpy as np
import pytest

from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.frame.model import FrameModel
from ringsim.frame.readings import EnergyMeter
from ringsim.scene import load_scene
from ringsim.stepping.instant import Passing, lost_between


@pytest.mark.parametrize(
    ("name", "values", "solve", "most"),
    [
        pytest.param(
            name, values, solve, most, id=f"{word}-{engine}",
            marks=() if engine == "frame" and values else pytest.mark.slow,
        )
        for word, name, values, frames, exudyn in (
            ("ring6", "ring18", {"structure.sections": 6}, 1.4e-3, 1.65e-3),
            ("truss2-short", "truss2", {"solver.end_time": 5.0}, 4.4e-5, 6.2e-5),
            ("ring18", "ring18", {}, 2.0e-3, 1.83e-3),
            ("truss2", "truss2", {}, 6.6e-5, 5.6e-5),
            ("ring18-cable", "ring18-cable", {}, 5.4e-5, 4.5e-5),
        )
        for engine, solve, most in (("frame", by_frames, frames), ("full", by_exudyn, exudyn))
    ],
)  # fmt: skip
def test_energy_is_kept(name: str, values: dict[str, Any], solve: Any, most: float) -> None:
    """To a tenth more than docs/evidence/frame.md tells: both choose their steps by what goes
    missing, and which of them is repeated is luck.
    """
    scene = load_scene(name).with_values(values)
    assert float(solve(scene).values["energy_error"]) < most


@pytest.mark.quick
@pytest.mark.parametrize("told", [True, False], ids=["displacements", "rates"])
def test_viscous_losses_of_even_acceleration_are_exact(told: bool) -> None:
    """The integral of c v^2 over v = v0 + a t, in one step; mean force times displacement misses
    c h (v2 - v1)^2 / 12 of it.
    """
    friction, begin, speeds, gains = 0.7, 2.0, np.array([0.0, -0.3]), np.array([1.5, 0.8])

    def at(time: float) -> Passing:
        rates, passed = speeds + gains * (time - begin), time - begin
        places = speeds * passed + 0.5 * gains * passed**2
        return Passing(time, friction * rates, rates, places if told else None)

    ends = at(begin).rates, at(2.6).rates
    exact = float(np.sum(friction * (ends[1] ** 3 - ends[0] ** 3) / (3.0 * gains)))
    assert lost_between(at(begin), at(2.6)) == pytest.approx(exact, rel=1e-12)
    halves = lost_between(at(begin), at(2.3)) + lost_between(at(2.3), at(2.6))
    assert halves == pytest.approx(exact, rel=1e-12)


@pytest.mark.quick
def test_the_core_takes_losses_and_energies_as_the_formulas_say() -> None:
    """Of a ring with damped rods and viscous hinges, in two states at random."""
    values = {
        "structure.sections": 3, "rods.damping": 1e-3, "net": "none", "boom": "none",
        "joints.hinge.viscous": 0.02, "joints.pivot.viscous": 0.01,
    }  # fmt: skip
    model = FrameModel(load_scene("ring18").with_values(values))
    mesh, random, meter = model.mesh, np.random.default_rng(3), EnergyMeter(model)
    told, passings = [], []
    for time in (0.0, 0.02):
        state = model.start.copy()
        state.pose.angle[:] += 1e-3 * random.normal(size=state.pose.angle.shape)
        state.followed.rate[:] = random.normal(size=state.followed.rate.shape)
        strain, before, lead = state.strains
        strain[:] = 1e-5 * random.normal(size=strain.shape)
        before[:] = 1e-3 * random.normal(size=strain.shape)
        lead[0] = 50.0
        told.append(meter.read(time, state)[0])
        meter.keep()
        straining = 50.0 * strain + before
        forces = model.laws.damping * state.rate.angles, 1e-3 * mesh.stiffness * straining
        places, rates = (state.pose.angle, strain), (state.rate.angles, straining)
        rows = (np.concatenate([a.ravel(), b.ravel()]) for a, b in (forces, rates, places))
        passings.append(Passing(time, *rows))
        elastic = 0.5 * np.sum(mesh.stiffness * strain**2)
        assert told[-1].elastic == pytest.approx(elastic, rel=1e-12)
    assert model.laws.damping.max() > 0.0
    assert told[0].lost == 0.0
    assert told[1].lost == pytest.approx(lost_between(*passings), rel=1e-10)
