"""Jammed pulleys and cut cables: what stays, what goes, and what never jumps."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pytest
from loops import for_each
from pydantic import TypeAdapter, ValidationError

from cable_cases import LAWS, friction_loss, random_case, still, winch_power
from ringsim.cable.ropes import CableFault, CutCable, JammedPulley, OffSheave
from ringsim.choice import OneOf

pytestmark = pytest.mark.quick


def held(state):
    """Natural length in each span, and rope wound, at the instant of a fault."""
    return state.stored, state.wound


PATH = [[0, 0, 0], [1, 0, 0], [1.5, 0.6, 0], [2, 0, 0.4], [3, 0, 0], [3, 1, 0]]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("wound", [0.002, -0.01])
def test_a_jam_changes_no_rope_and_no_tension(law, wound):
    case = still(PATH, wound, friction=law, slip_speed=1e-3, slack_width=0.01, axial_stiffness=1e4)
    before = case.state()
    ropes = JammedPulley(pulley=2, time=1.0).change(case.ropes, *held(before))
    after = case.state(ropes=ropes)
    assert after.natural.sum() == pytest.approx(before.natural.sum(), rel=1e-15)
    assert len(after.natural) == 2
    # Tension per rope is continuous to first order of strain, 4e-4; within each of the ropes
    # friction starts anew from the motion that is left, so compare the mean tensions.
    mean = np.add.reduceat(before.tensions * before.lengths, ropes.starts) / after.paths
    assert after.mean_tensions == pytest.approx(mean, rel=2e-3, abs=1e-12)


def test_rope_no_longer_crosses_a_jammed_pulley():
    case = still(PATH, 0.002, friction=LAWS["bearing"], axial_stiffness=1e4)
    before = case.state()
    ropes = JammedPulley(pulley=2, time=1.0).change(case.ropes, *held(before))
    assert JammedPulley(pulley=2, time=2.0).change(ropes, *held(case.state(ropes=ropes))) is ropes
    further = case.state(ropes=ropes, wound=case.wound + np.array([[0.01, 0.0]]))
    now = case.state(ropes=ropes)
    # All the rope wound comes from the winch's side.
    assert further.natural[0] == pytest.approx(now.natural[0] - 0.01, rel=1e-14)
    assert further.natural[1] == now.natural[1]
    assert np.array_equal(further.tensions[2:], now.tensions[2:])
    assert further.tensions[0] > now.tensions[0]
    assert now.speeds[1] == 0.0
    assert friction_loss(now)[1] == 0.0
    # The far rope has both ends fixed and rests.
    assert now.speeds[2:] == pytest.approx(0.0, abs=1e-15)


def test_jams_between_two_winches_leave_each_its_own_rope():
    case = still(PATH, 0.001, (0.1, 0.1), axial_stiffness=1e4)
    case.wound = np.array([[0.001, 0.0005]])
    ropes, whole = case.ropes, case.state().natural.sum()
    for pulley in (3, 1):
        ropes = JammedPulley(pulley=pulley, time=1.0).change(ropes, *held(case.state(ropes=ropes)))
        assert case.state(ropes=ropes).natural.sum() == pytest.approx(whole, rel=1e-15)
    assert list(ropes.starts) == [0, 1, 3]
    now, then = (case.state(ropes=ropes, wound=case.wound + w) for w in (0.0, [[0.01, 0.002]]))
    assert now.natural - then.natural == pytest.approx([0.01, 0.0, 0.002], abs=1e-14)
    assert list(now.wound_rates) == [0.1, 0.0, 0.1]


def test_a_pulley_that_is_free_again_makes_one_rope():
    case = still(PATH, 0.001, (0.1, 0.1), axial_stiffness=1e4)
    case.wound = np.array([[0.001, 0.0005]])
    ropes = case.ropes
    for pulley in (3, 1):
        ropes = JammedPulley(pulley=pulley, time=1.0).change(ropes, *held(case.state(ropes=ropes)))
    one = ropes.unjam(0, 0)
    assert list(one.starts) == [0, 3]
    assert one.unjam(0, 0) is one
    free = one.unjam(0, 2)
    assert list(free.starts) == [0]
    assert free.content == pytest.approx(case.ropes.content, rel=1e-15)
    cut = CutCable(cable=1, span=1, time=1.0).change(ropes, *held(case.state(ropes=ropes)))
    assert list(cut.unjam(0, 0).alive) == [False, True]


def test_the_energy_identity_holds_for_split_ropes():
    case = random_case(
        9, wound=0.01, winding=0.2, far_winding=0.1, friction=LAWS["bearing"], damping_time=0.01
    )
    ropes = JammedPulley(cable=1, pulley=3, time=0.0).change(case.ropes, *held(case.state()))
    state = case.state(ropes=ropes)
    stored = state.natural * state.mean_tensions * state.strain_rates
    spent = np.sum(state.point_forces * case.velocities) + friction_loss(state).sum() + stored.sum()
    assert winch_power(state).sum() == pytest.approx(spent, rel=1e-12)


def test_a_cut_takes_the_tension_from_both_sides_up_to_the_next_jam():
    case = random_case(7, counts=(7, 4), wound=0.01, winding=0.1, friction=LAWS["capstan"])
    whole = CutCable(cable=1, span=4, time=1.0).change(case.ropes, *held(case.state()))
    state = case.state(ropes=whole)
    assert np.all(state.tensions[:6] == 0.0)
    assert np.all(state.point_forces[:7] == 0.0)
    assert np.array_equal(state.tensions[6:], case.state().tensions[6:])
    assert list(state.is_slack) == [True, False]
    assert np.all(state.elastic_energy[:1] == 0.0)
    jammed = JammedPulley(cable=1, pulley=3, time=0.5).change(case.ropes, *held(case.state()))
    after = CutCable(cable=1, span=5, time=1.0).change(jammed, *held(case.state(ropes=jammed)))
    state = case.state(ropes=after)
    assert np.all(state.tensions[:3] > 0.0)
    assert np.all(state.tensions[3:6] == 0.0)


def test_a_jam_in_a_cut_cable_brings_no_tension_back():
    case = random_case(7, wound=0.01)
    ropes = CutCable(cable=2, span=1, time=0.0).change(case.ropes, *held(case.state()))
    ropes = JammedPulley(cable=2, pulley=1, time=1.0).change(ropes, *held(case.state(ropes=ropes)))
    assert np.all(case.state(ropes=ropes).tensions[6:] == 0.0)


def test_a_rope_that_was_wedged_before_is_free_on_both_sides() -> None:
    case = random_case(7, wound=0.01)
    jammed = JammedPulley(cable=1, pulley=3, time=0.5).change(case.ropes, *held(case.state()))
    assert np.all(case.state(ropes=jammed).tensions[:4] > 0.0)
    free = OffSheave(cable=1, pulley=3, time=1.0, rope="free")
    after = free.change(jammed, *held(case.state(ropes=jammed)))
    assert np.all(case.state(ropes=after).tensions[:4] == 0.0)
    with pytest.raises(ValueError, match="cannot be undone"):
        free.whole(after)
    wedged = OffSheave(cable=1, pulley=3, time=0.5)
    assert wedged.whole(jammed).starts.tolist() == case.ropes.starts.tolist()


@for_each(
    ("fault", "text"),
    [
        (JammedPulley(cable=3, pulley=1, time=0.0), r"there is no cable 3 \(there are 1 to 2\)"),
        (
            JammedPulley(cable=2, pulley=3, time=0.0),
            r"cable 2 has no pulley 3 \(there are 1 to 2\)",
        ),
        (CutCable(cable=1, span=7, time=0.0), r"cable 1 has no span 7 \(there are 1 to 6\)"),
    ],
)
def test_a_place_that_is_not_there_is_refused(fault, text):
    case = random_case(1)
    with pytest.raises(ValueError, match=text):
        fault.change(case.ropes, *held(case.state()))


def test_faults_are_picked_by_kind():
    read = TypeAdapter(Annotated[CableFault, OneOf()]).validate_python
    assert read({"kind": "cut-cable", "span": 2, "time": 3.0}) == CutCable(span=2, time=3.0)
    with pytest.raises(ValidationError, match="jammed-pulley"):
        read({"kind": "rusty-pulley", "pulley": 2, "time": 3.0})
