"""The ideal ring in motion against closed forms, the energy quadrature and its own balance."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ideal_cases import pulled, six
from ringsim.outputs import VARIABLES
from ringsim.simulation import run_ideal
from ringsim.theory.one_coordinate import OneCoordinate, opening_time
from ringsim.variables import Fate, Status

BALANCE = 1e-7
"""Local errors of 1e-7 of the rate, of which a few hundred partly cancel."""


def value(outcome, name: str) -> float:
    return float(outcome.values[name])


@pytest.mark.parametrize("sections", [6, 18])
@pytest.mark.parametrize("base", ["free", "fixed"])
@pytest.mark.parametrize("net", [True, False])
def test_without_cables_it_takes_the_time_of_the_energy_quadrature(sections, base, net):
    """A ring that floats has no boom here: with one it pitches, and its loads stay vertical."""
    extra = {"net__neutral_length": 0.7116 * sections / 18} if net else {"net": "none"}
    scene = pulled(
        sections, boom={"kind": "rigid", "base": base} if base == "fixed" else "none", **extra
    )
    outcome = run_ideal(scene)
    truth = opening_time(OneCoordinate(scene), scene.structure.coordinate, panels=96)
    assert outcome.status == Status.OK
    assert value(outcome, "deployment_time") == pytest.approx(
        truth.time, rel=1e-7, abs=2.0 * truth.uncertainty
    )
    assert value(outcome, "energy_error") < BALANCE


def test_loads_that_stay_vertical_open_a_pitching_ring_later():
    """The quadrature lets the loads turn with the ring; the energy balance knows better.

    A boom of 1.7 kg on a ring of 0.45 kg makes it pitch by 0.017 rad; 1 - cos of that is 1.5e-4.
    """
    scene = pulled(3, net="none", structure__aspect_ratio=1.0, boom__density=1e4)
    outcome = run_ideal(scene)
    turning = opening_time(OneCoordinate(scene), scene.structure.coordinate).time
    assert 1e-6 < value(outcome, "deployment_time") / turning - 1.0 < 1e-3
    assert value(outcome, "energy_error") < BALANCE


def test_an_odd_net_takes_the_time_of_the_energy_quadrature():
    net = {"stiffness": 0.05, "neutral_length": 0.15}
    scene = pulled(5, structure__aspect_ratio=0.8, net=net, boom="none", loads__force=0.05)
    truth = opening_time(OneCoordinate(scene), scene.structure.coordinate, panels=96)
    found = value(run_ideal(scene), "deployment_time")
    assert found == pytest.approx(truth.time, rel=1e-7, abs=2.0 * truth.uncertainty)


def test_angle_between_the_steps_is_that_of_the_quadrature():
    scene = pulled(net="none", boom="none", record__interval=0.37)
    outcome = run_ideal(scene)
    ring, start = OneCoordinate(scene), scene.structure.coordinate
    times = outcome.coordinates["time"]
    for k in (10, 25, 40):
        phi = 0.5 * (math.pi - math.radians(outcome.values["opening_angle"][0, 0, k]))
        reached = opening_time(ring, start, phi, panels=64).time
        assert reached == pytest.approx(times[k], rel=1e-6)


def test_one_section_follows_its_rope():
    """Frictionless and nearly inextensible: the path shortens by what is wound.

    Without an offset of the pins the end assemblies stay where they are.

    With 2 L(phi) = 2 L(phi_0) - v t the angle is known; the tension is what the joints ask for:
    T d(2 L)/dphi = 4 c phi' / 2 for either of the two cables.
    """
    speed, viscous = 0.005, 5.0
    scene = six(
        structure__sections=1, structure__closed=False, structure__hinge_offset=0.0,
        net="none", boom="none",
        joints={"vjoint": {"viscous": viscous}}, structure__opening_angle=60.0,
        cable__winch={"winding": {"kind": "constant", "speed": speed}},
        cable__friction={"kind": "none"}, cable__axial_stiffness=1e8,
        solver__end_time=15.1,
    )  # fmt: skip
    outcome = run_ideal(scene)
    bar, offset = scene.structure.half_bar, scene.cables.upper.block_offset

    def length(phi: float) -> float:
        return math.sqrt(bar**2 + offset**2 + 2.0 * bar * offset * math.sin(phi))

    start = length(scene.structure.coordinate)
    for k in (50, 100, 150):
        time = outcome.coordinates["time"][k]
        now = start - 0.5 * speed * time
        phi = math.asin((now**2 - bar**2 - offset**2) / (2.0 * bar * offset))
        opening = outcome.values["opening_angle"][0, 0, k]
        # The rope stretches by T S / EA = 3e-7 m, the softplus by less: 1e-4 deg at least arm.
        assert opening == pytest.approx(180.0 - 2.0 * math.degrees(phi), abs=1e-3)
        slope = bar * offset * math.cos(phi) / now
        rate = -0.5 * speed / slope
        inertia = OneCoordinate(scene).motion(phi).inertia
        tension = -4.0 * viscous * 2.0 * rate / (4.0 * slope)
        # Inertia is left out: I phi'^2 over the tension's work, about 1e-4 here.
        assert inertia * rate**2 < 1e-3 * tension * slope
        assert outcome.values["cable_tension"][0, 1, k] == pytest.approx(tension, rel=2e-3)


def test_after_both_cables_are_cut_it_coasts_against_its_joints():
    """sqrt(I) phi' falls by c * integral dphi / sqrt(I): I phi'' + I' phi'^2 / 2 = -c phi'."""
    cuts = [{"kind": "cut-cable", "time": 2.0, "cable": k, "span": 4} for k in (1, 2)]
    viscous = 0.02
    scene = six(
        net="none", faults=cuts, solver__end_time=4.1, record__interval=0.5,
        joints={"vjoint": {"viscous": viscous}},
    )  # fmt: skip
    outcome = run_ideal(scene)
    phi = 0.5 * (math.pi - np.radians(outcome.values["opening_angle"][0, 0]))
    kinetic = outcome.values["kinetic_energy"]
    ring = OneCoordinate(scene)
    momentum = -np.sqrt(2.0 * kinetic)
    resistance = 4.0 * 6 * viscous * 2.0
    for early, late in ((5, 7), (6, 8)):
        lost = quad(lambda x: ring.motion(x).inertia ** -0.5, phi[early], phi[late])[0]
        expected = momentum[early] - resistance * lost
        assert momentum[late] == pytest.approx(expected, rel=1e-6)
    assert not outcome.values["cable_tension"][..., 5:].any()


@pytest.mark.parametrize(
    "values",
    [
        {
            "cable__end": "both", "cable__damping_time": 0.002,
            "joints": {"vjoint": {"viscous": 0.05, "coulomb": 0.01}, "hinge": {"viscous": 0.01}},
        },
        {
            "cable__end": "last", "cable__friction": {"kind": "capstan", "coefficient": 0.2},
            "cables__upper__initial_slack": 0.01, "stop__latch": False, "cables__lower": "none",
        },
        {"faults": [{"kind": "jammed-pulley", "time": 5.0, "cable": 1, "pulley": 8}],
         "solver__end_time": 20.0},
    ],
    ids=["both-ends-coulomb", "capstan-one-cable", "jam"],
)  # fmt: skip
def test_energy_balance_closes(values):
    outcome = run_ideal(six(**values))
    assert not outcome.status.failed
    assert value(outcome, "energy_error") < BALANCE
    lost = outcome.values["dissipation"]
    assert np.nanmin(np.diff(lost)) > -1e-9
    assert np.nanmax(outcome.values["work"]) > 0.05


@settings(max_examples=5)
@given(
    stiffness=st.floats(3.0, 7.0),
    friction=st.floats(0.0, 0.95),
    speed=st.floats(-3.0, -0.3),
    viscous=st.floats(-2.0, 0.0),
)
def test_any_driven_ring_ends_with_a_status_and_its_energy(stiffness, friction, speed, viscous):
    scene = six(
        cable__axial_stiffness=10.0**stiffness,
        cable__friction__coefficient=0.01 * friction,
        cable__winch__winding__speed=10.0**speed,
        joints__vjoint__viscous=10.0**viscous,
        solver__end_time=2.0,
    )
    outcome = run_ideal(scene)
    assert not outcome.status.failed, outcome.reason
    assert value(outcome, "energy_error") < 1e-4


def test_tension_feedback_settles_at_its_target():
    law = {"kind": "tension-feedback", "target": 2.0, "max_speed": 0.2}
    scene = six(
        cable__winch={"winding": law}, cable__friction={"kind": "none"}, solver__end_time=3.0
    )
    outcome = run_ideal(scene)
    tension = outcome.values["cable_tension"][0, 0, 10:]
    # From 1 s on: the loop's own time is 4 m / (1e5 N * 0.02 m/s/N) = 2 ms.
    np.testing.assert_allclose(tension, 2.0, rtol=2e-3)


def test_late_winch_starts_late():
    winch = {"winding": {"kind": "constant", "speed": 0.02}, "start_time": 1.23}
    outcome = run_ideal(six(cable__winch=winch, solver__end_time=3.0))
    wound = outcome.values["wound_length"][0]
    times = outcome.coordinates["time"]
    np.testing.assert_allclose(wound, 0.02 * np.maximum(times - 1.23, 0.0), atol=1e-6)


def test_outcome_has_the_shapes_of_the_full_model():
    outcome = run_ideal(six(solver__end_time=1.0))
    sizes = {name: len(values) for name, values in outcome.coordinates.items()}
    assert sizes == {"plane": 2, "section": 6, "time": 11, "span": 18}
    for name, values in outcome.values.items():
        assert values.shape == tuple(sizes[dim] for dim in VARIABLES[name].dims), name
    assert outcome.fate is Fate.CUT_OFF
    assert value(outcome, "fidelity") == 1
    assert not {"asynchrony", "asynchrony_max"} & outcome.values.keys()


def test_rope_that_is_used_up_overloads():
    winch = {"winding": {"kind": "constant", "speed": 50.0}}
    scene = six(cable__winch=winch, cable__axial_stiffness=10.0, structure__opening_angle=120.0)
    outcome = run_ideal(scene)
    assert (outcome.status, outcome.fate) == (Status.OK, Fate.OVERLOADED)
    assert "more than limits.rope_strain = 0.25, with 0 of 12 V-joints locked" in outcome.reason


@pytest.mark.parametrize(
    ("values", "fate"),
    [
        # Loads have just set the ring in motion, with steps as long as the window that is watched.
        (
            {"solver__end_time": 0.02, "solver__step": 0.02, "record__interval": 0.01},
            Fate.CUT_OFF,
        ),
        ({"solver__end_time": 4.0, "cables": "none", "loads": "none", "net": "none"}, Fate.STALLED),
    ],
)
def test_a_ring_that_its_loads_set_in_motion_is_not_at_rest(values, fate):
    outcome = run_ideal(six(**values))
    assert outcome.fate is fate, outcome.reason
    assert (", at rest" in outcome.reason) is (fate is Fate.STALLED)
