"""The slip speed follows the winding: full friction at the slow end of the rope."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from cable_cases import RADIUS, cable
from ringsim.cable import friction
from ringsim.cable.friction import BearingFriction
from ringsim.cable.records import AnyWinding, Winch
from ringsim.cable.winding import ConstantWinding, PrescribedWinding, Winding
from ringsim.choice import kinds_of
from ringsim.core.chain import Chain

pytestmark = pytest.mark.quick

HALF, BLOCK, SHORT, DISTANCE = 0.29, 0.105, 0.013, 0.3
FULL = 0.05
"""Slip speed over winding speed per span at which every moving pulley has all its friction."""


def path(fold, sections, winches=1):
    """Points of a rope over sections in a row, all with bars at an angle ``fold`` (rad)."""
    points, x = [[0.0, -DISTANCE]], 0.0
    for _ in range(sections):
        run = HALF * np.cos(fold)
        points += [[x, 0.0], [x + run, -HALF * np.sin(fold) - BLOCK], [x + 2 * run, 0.0]]
        x += 2 * run + SHORT
    points += [[x - SHORT, -DISTANCE]] * (winches - 1)
    return np.array([[px, 0.0, pz] for px, pz in points])


def pulled(sections, ratio, slip, winding, winches=1):
    """The chain of an evenly opening row that takes up what is wound; ``ratio`` is f / R."""
    fold, nudge = 0.7, 1e-6
    points = path(fold, sections, winches)
    after, before = (path(fold + d, sections, winches) for d in (nudge, -nudge))

    def length(p):
        return np.linalg.norm(np.diff(p, axis=0), axis=1).sum()

    rate = -winches * winding / ((length(after) - length(before)) / (2 * nudge))
    law = Winch(winding=ConstantWinding(speed=winding))
    own = cable(
        winch=law,
        end="both" if winches == 2 else "first",
        friction=BearingFriction(coefficient=ratio * RADIUS),
        slip_speed=slip,
    )
    chain = Chain([own], [len(points)])
    ends = np.array([[winding, winding if winches == 2 else 0.0]])
    return chain.state(
        chain.start(points), points, rate * (after - before) / (2 * nudge), 0.0 * ends, ends
    )


def too_high(sections, ratio, slip, winding, winches=1):
    """Relative excess of the lowest tension over that with full friction at every pulley."""
    full = FULL * winches * winding / (3 * sections - 1 + winches)
    lowest = [
        (state.tensions / state.tensions[0]).min()
        for state in (pulled(sections, ratio, s, winding, winches) for s in (slip, full))
    ]
    return lowest[0] / lowest[1] - 1.0


@pytest.mark.parametrize("winches", [1, 2])
@pytest.mark.parametrize("sections", [2, 6, 18])
@pytest.mark.parametrize(("ratio", "most"), [(0.04, 4e-4), (0.9, 1e-2)])
@pytest.mark.parametrize("winding", [0.12, 0.002, 1e-5])
def test_the_far_end_keeps_its_friction_at_any_winding_speed(
    sections, ratio, most, winding, winches
):
    # Between two winches some pulleys rest: round-off of either sign.
    assert abs(too_high(sections, ratio, None, winding, winches)) < most


def test_a_slip_speed_that_does_not_follow_fails_that():
    assert too_high(18, 0.04, 2e-4, 0.002) > 0.1
    assert too_high(18, 0.04, 2e-4, 0.12) < 1e-12


@pytest.mark.parametrize("share", [0.5, 0.75, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("sections", [3, 18])
def test_the_stated_excess_is_that_of_the_chain(sections, share):
    """With the decay of the V pulleys for all; hinge pulleys turn the rope half as much."""
    winding, pulleys = 0.002, 3 * sections - 1
    slip = share * winding / (pulleys + 1)
    decay = -pulled(sections, 0.04, slip, winding).log_decays[-1]
    stated = friction.excess(slip, winding, pulleys, decay)
    measured = too_high(sections, 0.04, slip, winding)
    # Above, because the decay is the largest, by no more than that of the hinge pulleys.
    assert measured <= stated * 1.0001
    assert stated < 2.5 * measured


def test_a_scene_that_says_it_is_obeyed_and_a_rope_at_rest_has_the_largest():
    assert cable(slip_speed=3e-3).slip_speed_over(17) == 3e-3
    still = Winch(winding=ConstantWinding(speed=0.0))
    assert cable(winch=still).slip_speed_over(17) == friction.LARGEST_SLIP_SPEED
    slow, back = (Winch(winding=ConstantWinding(speed=v)) for v in (2e-3, -2e-3))
    both = cable(winch=slow, end="both").slip_speed_over(54)
    # Twice the rope over one span more.
    assert both == pytest.approx(cable(winch=slow).slip_speed_over(53) * 2 * 54 / 55, rel=1e-14)
    assert cable(winch=back).slip_speed_over(53) == cable(winch=slow).slip_speed_over(53)


LAWS = {
    "constant": ({"speed": -0.03}, 0.03),
    "ramp": ({"speed": 0.03, "duration": 0.5}, 0.03),
    # 2 s at 0.05, 5 s at rest, 7 s at 0.01 and 1 s at 0.2 m/s.
    "table": ({"times": [0, 2, 7, 14, 15], "lengths": [0.0, 0.1, 0.1, 0.17, 0.37]}, 0.01),
    "stall": ({"speed": 0.03, "max_tension": 1.0}, 0.03),
    # Half of 600 rad/s at half load, on a drum of 1 cm behind a gear of 100.
    "motor": (
        {"no_load_speed": 600.0, "stall_torque": 0.01, "gear_ratio": 100.0, "drum_radius": 0.01},
        0.03,
    ),
    "commanded": ({"max_speed": 0.1, "speed": 0.03}, 0.03),
    "tension-feedback": ({"target": 0.5, "gain": 0.02, "max_speed": 0.3}, 0.01),
}


def test_every_winding_law_says_its_speed():
    assert set(LAWS) == set(kinds_of(Winding))


@pytest.mark.parametrize("kind", LAWS)
def test_usual_speed_of_a_law(kind):
    fields, speed = LAWS[kind]
    if "times" in fields:
        fields = fields | {"times": [float(t) for t in fields["times"]]}
    law = TypeAdapter(AnyWinding).validate_python({"kind": kind} | fields)
    assert law.usual_speed() == pytest.approx(speed, rel=1e-12)
    if isinstance(law, PrescribedWinding):
        times = np.linspace(0.0, 15.0, 1501)
        wound = np.array([law.wound(t) for t in times])
        # What a run is judged by afterwards; cubics between the table's points wind unevenly.
        found = friction.usual_winding(times, wound)
        assert found == pytest.approx(speed, rel=0.5 if kind == "table" else 1e-9)


def test_the_speed_of_a_record_leaves_out_rest_and_what_was_not_reached():
    times = np.arange(8.0)
    wound = np.array([0.0, 0.0, 0.0, 0.1, 0.2, 0.3, np.nan, np.nan])
    assert friction.usual_winding(times, wound) == pytest.approx(0.1, rel=1e-14)
    assert friction.usual_winding(times, np.zeros(8)) == 0.0
    assert friction.usual_winding(times, np.full(8, np.nan)) == 0.0
