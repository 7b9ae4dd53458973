"""The laws of all parts: one source for numpy and exudyn, energies by quadrature, no gain."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from law_cases import records
from ringsim.choice import kinds_of
from ringsim.exudyn.assembly import SYMBOLIC, TORSION, Assembly
from ringsim.parts.faults import StuckVJoint
from ringsim.parts.joints import JointFriction, Latch, SpringDamperStop, Stop
from ringsim.parts.laws import PairRecord
from ringsim.parts.net import BoundaryNet, SpringNet
from ringsim.structures.planar_truss import DeployingSpring, Rest
from ringsim.units import Model, at_section

FRICTION = st.deferred(lambda: any_kind(JointFriction))
STOP = st.deferred(lambda: any_kind(Stop))
RATE = st.floats(-50.0, 50.0)
PLACE = st.floats(-2e-4, 2e-4) | st.floats(-0.3, 0.3) | st.floats(0.0, math.pi + 0.3)
"""Coordinates around the onset of dampers, around contact, and of a joint's whole range."""


def any_kind(family: type[Model]) -> st.SearchStrategy[Any]:
    """Records of all kinds that there are when the tests run, those of other tests too."""
    return st.sampled_from([*kinds_of(family).values()]).flatmap(records)


def stop_law(stop: Stop, latched: bool) -> Any:
    def law(place: Any, rate: Any, xp: Any = np) -> Any:
        # In the engine the setting is a symbol.
        return stop.reaction(place, rate, 0.0 * place + float(latched), xp)

    law.corners = (0.0, stop.most_folded)  # type: ignore[attr-defined]
    return law


def ramp_law(latch: Latch) -> Any:
    def law(place: Any, rate: Any, xp: Any = np) -> Any:
        return latch.reaction(place, 0.0, 0.0, xp)

    law.corners = (0.0, math.radians(latch.reach))  # type: ignore[attr-defined]
    return law


def stuck_law(fault: StuckVJoint) -> Any:
    return lambda place, rate, xp=np: fault.reaction(place, rate, 0.1, xp)


def pair_law(record: PairRecord) -> Any:
    return lambda stretch, rate, xp=np: record.reaction(stretch, rate, 1.3, xp)


LAWS = {
    "stop": st.builds(stop_law, STOP, st.just(False)),
    "latch": st.builds(stop_law, STOP, st.just(True)),
    "net": records(SpringNet).map(pair_law),
    "edge": records(BoundaryNet).map(pair_law),
    "ramp": records(Latch).map(ramp_law),
    "rest": records(Rest).map(lambda rest: rest.push),
    "strut": records(DeployingSpring).map(pair_law),
    "stuck": st.just(stuck_law(StuckVJoint(time=0.0, section=1))),
}
"""Reaction of every part as a function of coordinate, rate and xp."""


def by_exudyn(law: Any, place: float, rate: float) -> float:
    """The law as exudyn evaluates it in a run."""
    assembly = Assembly()
    setting = assembly.symbolic_law(TORSION, "law", lambda x, v, _: law(x, v, SYMBOLIC))
    function = setting["springTorqueUserFunction"]
    return float(function.Evaluate(assembly.system, 0.0, 0, place, rate, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("part", LAWS)
@given(data=st.data(), place=PLACE, rate=RATE)
def test_exudyn_evaluates_the_reaction_that_numpy_does(part, data, place, rate):
    law = data.draw(LAWS[part])
    reaction = law(place, rate)
    total = by_exudyn(lambda x, v, xp: 0.0 * x + law(x, v, xp).total, place, rate)
    assert total == float(reaction.total)
    assert float(reaction.total) == float(reaction.elastic + reaction.damping)


@given(st.floats(-3.0, 3.0))
def test_every_symbolic_function_is_the_one_of_its_name(value):
    for name in vars(SYMBOLIC):
        theirs = {
            "minimum": lambda x, xp: xp.minimum(x, 0.3),
            "maximum": lambda x, xp: xp.maximum(x, 0.3),
            "where": lambda x, xp: xp.where(x > 0.3, x, 2.0 * x),
            "sqrt": lambda x, xp: xp.sqrt(x * x + 1.0),
        }.get(name, lambda x, xp, name=name: getattr(xp, name)(x))
        found = by_exudyn(lambda x, v, xp, law=theirs: law(x, xp), value, 0.0)
        assert found == pytest.approx(float(theirs(value, np)), rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("part", LAWS)
@given(data=st.data(), place=PLACE, rate=RATE)
def test_what_is_stored_is_the_work_against_the_elastic_force(part, data, place, rate):
    law = data.draw(LAWS[part])
    ends = (law(0.5, 0.0).stored, law(place, rate).stored)
    corners = getattr(law, "corners", (0.0,))
    inside = [corner for corner in corners if min(0.5, place) < corner < max(0.5, place)]
    work, error = quad(lambda x: law(x, rate).elastic, 0.5, place, points=inside)
    scale = abs(ends[0]) + abs(ends[1])
    # Round-off of a difference of energies, and the quadrature's own estimate.
    assert float(ends[1] - ends[0]) == pytest.approx(work, abs=1e-14 * scale + 10.0 * error)


@pytest.mark.parametrize("part", LAWS)
@given(data=st.data(), place=PLACE, rate=RATE)
def test_damping_never_gives_energy(part, data, place, rate):
    law = data.draw(LAWS[part])
    assert float(law(place, rate).damping) * rate >= 0.0


@given(FRICTION, RATE)
def test_friction_never_gives_energy_and_knows_no_sense(law, rate):
    assert float(law.torque(rate)) * rate >= 0.0
    assert float(law.torque(-rate)) == -float(law.torque(rate))
    damping = law.linear_damping()
    if damping is not None:
        assert float(law.torque(rate)) == damping * rate


@given(FRICTION)
def test_friction_is_smooth_below_its_characteristic_rate(law):
    """Over a thousandth of it the torque is linear."""
    least = min(law.characteristic_rate(), 1e3)
    slope = [float(law.torque(1e-3 * share * least)) / share for share in (0.5, 1.0)]
    assert slope[0] == pytest.approx(slope[1], abs=1e-5 * float(law.torque(least)))


@given(STOP, PLACE, RATE)
def test_a_stop_only_pushes_into_the_range(stop, folded, rate):
    torque = float(stop.reaction(folded, rate, False).total)
    if folded < 0.0:
        assert torque <= 0.0  # opened too far: folds
    elif folded > stop.most_folded:
        assert torque >= 0.0  # folded too far: opens
    else:
        assert torque == 0.0


@given(records(Rest), records(SpringNet), PLACE, RATE)
def test_rest_and_one_sided_strings_never_turn_round(rest, net, stretch, rate):
    assert float(rest.push(stretch, rate).total) >= 0.0
    tension = float(net.reaction(stretch, rate, 1.0).total)
    assert net.two_sided or tension >= 0.0
    if net.two_sided:
        assert tension == pytest.approx(net.stiffness * stretch + net.damping * rate, rel=1e-12)


def test_values_of_each_section_reach_the_law():
    net = SpringNet(stiffness=(1.0, 2.0, 4.0))
    assert type(at_section(net, 2).stiffness) is float
    stretch = np.array([0.1, 0.2, 0.3])
    each = [at_section(net, k).reaction(stretch[k], 0.0, 1.0).total for k in range(3)]
    np.testing.assert_array_equal(
        at_section(net, np.arange(3)).reaction(stretch, 0.0, 1.0).total, each
    )
    assert each == [0.1, 0.4, 1.2]


def test_a_joint_bounces_off_its_stop_as_half_a_swing():
    """Without damper: depth w sqrt(J / k), gone after pi sqrt(J / k), as fast as it came."""
    stop, inertia, rate = SpringDamperStop(stiffness=150.0, damping=0.0), 2e-3, 3.0
    swing = math.sqrt(inertia / stop.stiffness)
    times, depths, rates = thrown(stop, inertia, rate, 1.1 * math.pi * swing, latched=False)
    assert depths.max() == pytest.approx(rate * swing, rel=1e-5)
    leaves = times[np.flatnonzero(depths > 0.0)[-1]]
    assert leaves == pytest.approx(math.pi * swing, rel=2e-3)  # a thousand times are looked at
    assert rates[-1] == pytest.approx(-rate, rel=1e-6)


def test_a_latched_joint_swings_out_as_a_damped_oscillator():
    stop, inertia, rate = SpringDamperStop(stiffness=150.0, damping=0.2), 2e-3, 3.0
    times, depths, _ = thrown(stop, inertia, rate, 0.2, latched=True)
    fade = 0.5 * stop.damping / inertia
    turn = math.sqrt(stop.stiffness / inertia - fade**2)
    exact = rate / turn * np.exp(-fade * times) * np.sin(turn * times)
    np.testing.assert_allclose(depths, exact, atol=1e-6 * rate / turn)


def thrown(stop, inertia, rate, end, *, latched):
    """Times, depths and rates of a joint that meets its open stop at a rate."""

    def change(time, state):
        return [state[1], -float(stop.reaction(state[0], state[1], latched).total) / inertia]

    # Folded angles fall as the joint opens.
    found = solve_ivp(
        change, (0.0, end), [0.0, -rate], rtol=1e-9, atol=1e-12, max_step=end / 500,
        t_eval=np.linspace(0.0, end, 1000),
    )  # fmt: skip
    return found.t, -found.y[0], -found.y[1]


def test_static_depth_on_a_stop_is_the_torque_over_its_stiffness():
    stop = SpringDamperStop(stiffness=150.0, stowed_angle=30.0)
    torque = 0.3
    folded = math.pi - math.radians(30.0) + torque / 150.0
    assert float(stop.reaction(folded, 0.0, False).total) == pytest.approx(torque, rel=1e-12)
    assert float(stop.reaction(-torque / 150.0, 0.0, False).total) == pytest.approx(-torque)
