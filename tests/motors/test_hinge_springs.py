"""Springs in the V-joints: their laws, virtual work, the quadrature, and both engines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from loops import for_each
from pydantic import ValidationError
from rigid_motion import RigidRing
from scipy.integrate import quad

from motor_rings import ring
from ringsim.layout.layout import layout_of
from ringsim.parts.joints import HingeSpring, LinearSpring, TableSpring, TapeSpring
from ringsim.parts.margin import EcssMechanisms
from ringsim.refusal import InputError
from ringsim.rigid.margin import DriveMargin
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.variables import Status

LINEAR = {"kind": "linear", "stiffness": 0.004, "preload": 0.01}
LAWS = {
    "linear": LinearSpring(stiffness=0.004, preload=0.01),
    "tape": TapeSpring(force=2.0, radius=0.01),
    "table": TableSpring(angles=(30.0, 90.0, 150.0), torques=(0.05, 0.01, 0.03)),
}


def sprung(**values: object) -> Scene:
    """Three sections without cables, from 60 deg on."""
    plain = {
        "cables": "none", "structure.sections": 3, "hinge_spring": LINEAR, "solver.end_time": 1.5,
        "joints": {}, "solver.tolerance": 1e-5, "solver.newton_tolerance": 1e-6,
    }  # fmt: skip
    return ring().with_values(plain | {k.replace("__", "."): v for k, v in values.items()})


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_energy_is_the_integral_of_the_torque(law: HingeSpring) -> None:
    for begin, end in ((0.0, 0.3), (0.4, 2.0), (-0.1, 3.1)):
        work, _ = quad(lambda x: law.torque(x).elastic, begin, end, points=[0.524, 1.571, 2.618])
        gained = law.torque(end).stored - law.torque(begin).stored
        assert gained == pytest.approx(work, rel=1e-7)


def test_a_table_gives_its_torques() -> None:
    law = LAWS["table"]
    opened = np.array([10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 175.0])
    torques = law.torque(np.radians(180.0 - opened)).elastic
    np.testing.assert_allclose(torques, [0.05, 0.05, 0.03, 0.01, 0.02, 0.03, 0.03], rtol=1e-12)
    assert law.torque(0.5 * math.pi).elastic == pytest.approx(0.01)


def test_stiff_rods_open_in_the_time_of_the_quadrature() -> None:
    scene = sprung(solver__end_time=10.0, rods__young_modulus=1.2e13)
    found = simulate(scene, "frame")
    truth = opening_time(OneCoordinate(scene), scene.structure.coordinate)
    assert float(found.lock_time.mean()) == pytest.approx(truth.time, rel=1e-4)


def test_virtual_work() -> None:
    """Six V-joints turn by twice the coordinate; the margin counts 0.8 of what drives."""
    scene = sprung(joints__vjoint__coulomb=0.001)
    for phi in (0.2, 0.7, 1.0):
        torque = 0.01 + 0.004 * 2.0 * phi
        assert OneCoordinate(scene).work_rate(phi) == pytest.approx(-6 * 2.0 * torque, rel=1e-12)
        now = DriveMargin(scene, EcssMechanisms()).at(math.pi - 2.0 * phi)
        assert now.driving["springs"] == pytest.approx(6 * torque)
        assert now.resisting["springs"] == 0.0
        assert now.available == pytest.approx(6 * torque)
        assert now.margin == pytest.approx(0.8 * torque / (2.0 * 3.0 * 0.001) - 1.0, rel=1e-9)


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_a_ring_goes_on_without_a_spring_that_fails(fidelity: str) -> None:
    """One of each section, the middle one of which gives no torque from 0.2 s on."""
    fault = {"kind": "failed-spring", "plane": "lower", "section": 2, "time": 0.2}
    scene = sprung(
        hinge_spring={"kind": "linear", "stiffness": [0.004, 0.005, 0.003], "preload": 0.01},
        faults=[fault], solver__end_time=0.4, solver__tolerance=1e-4,
    )  # fmt: skip
    found = simulate(scene, fidelity)

    def gone(time: float, q: float, _: float) -> float:
        return 2.0 * (0.01 + 0.005 * 2.0 * q) * (time > 0.2)

    rigid = RigidRing(scene, gone).course(found.time.values)
    assert rigid.angle[-1] > 75.0
    opened = found.opening_angle.mean(("plane", "section"))
    np.testing.assert_allclose(opened, rigid.angle, atol=0.02)
    # 0.01 N m of preload and what the stiffness has left at that time.
    folded = math.radians(180.0 - np.interp(0.2, rigid.times, rigid.angle))
    lost = 0.01 * folded + 0.5 * 0.005 * folded**2
    assert float(found.dissipation[-1]) == pytest.approx(lost, rel=2e-3)
    assert float(found.energy_error) < 1e-3


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_what_a_fault_takes_at_the_start_is_booked_once(fidelity: str) -> None:
    """A spring, and an upper rope of 2 mm less than its path whose winch waits."""
    folded = math.radians(120.0)
    short = {"initial_slack": -0.002, "friction": {"kind": "none"}, "axial_stiffness": 1e4,
             "winch.start_time": 5.0}  # fmt: skip
    scene = sprung(
        cables={"upper": {"winch": {"winding": {"kind": "constant", "speed": 0.01}}}},
        solver__end_time=0.1, solver__tolerance=1e-3,
        faults=[
            {"kind": "failed-spring", "plane": "lower", "section": 2, "time": 0.0},
            {"kind": "cut-cable", "cable": 1, "span": 3, "time": 0.0},
        ],
    ).with_values({f"cables.upper.{name}": value for name, value in short.items()})  # fmt: skip
    spring = 0.01 * folded + 0.5 * 0.004 * folded**2
    layout = layout_of(scene)
    places = [layout.sheave(each)[0] for each in layout.paths[0]]
    path = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    rope = 0.5 * 1e4 * 0.002**2 / (path - 0.002)
    found = simulate(scene, fidelity)
    assert float(found.dissipation[0]) == pytest.approx(spring + rope, rel=1e-3)
    assert int(found.status) == Status.OK
    assert float(found.energy_error) < 1e-3


@for_each(
    ("values", "text"),
    [
        ({"hinge_spring": {"kind": "table", "angles": [10.0, 20.0], "torques": [0.1]}},
         "give one torque for each angle"),
        ({"hinge_spring": {"kind": "table", "angles": [20.0, 10.0], "torques": [0.1, 0.2]}},
         "must be above the angle before it"),
        ({"hinge_spring": {"kind": "linear", "stiffness": [0.1, 0.2]}}, "needs 3"),
        ({"hinge_spring": "none", "loads.force": 0.1,
          "faults": [{"kind": "failed-spring", "section": 1, "time": 0.1}]},
         "fault of a spring, but the scene has none"),
    ],
)  # fmt: skip
def test_springs_that_cannot_be_are_refused(values: dict[str, object], text: str) -> None:
    with pytest.raises((InputError, ValidationError), match=text):
        sprung().with_values(values)


def test_scenes_have_no_springs_of_themselves() -> None:
    assert load_scene("ring18").hinge_spring is None
