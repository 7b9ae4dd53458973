"""Work over finite steps: it closes the energy balance with second order, and runs back."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from cable_cases import LAWS, random_case
from ringsim.core.chain import work_between


def states(steps, law):
    """A chain between smooth motions of its pulleys; the second rope is wound at both ends."""
    case = random_case(
        4, friction=LAWS[law], axial_stiffness=1e3, slack_width=0.5, damping_time=0.05
    )
    rng = np.random.default_rng(1)
    sway = 0.02 * rng.normal(size=case.points.shape)
    ends = np.array([[0.03, 0.0], [0.02, 0.01]])
    times = np.linspace(0.0, 1.0, steps + 1)
    # A motor that runs and returns: the rope slips over its pulleys in both directions.
    points = [case.points + np.sin(2.0 * t) * sway for t in times]
    rates = [2.0 * np.cos(2.0 * t) * sway for t in times]
    wound = [np.sin(2.5 * t) * ends for t in times]
    found = []
    for place, rate, rope, t in zip(points, rates, wound, times, strict=True):
        case.wound_rate = 2.5 * np.cos(2.5 * t) * ends
        found.append(case.state(place, rate, wound=rope))
    return found, points


def missing(steps, law):
    """Energy in J that the balance lacks after so many steps, and what the winches put in."""
    found, points = states(steps, law)
    works = np.array([work_between(a, b) for a, b in pairwise(found)])
    pulls = sum(
        0.5 * np.sum((a.point_forces + b.point_forces) * (there - here))
        for (a, b), (here, there) in zip(pairwise(found), pairwise(points), strict=True)
    )
    stored = found[-1].elastic_energy.sum() - found[0].elastic_energy.sum()
    driven, lost = works.sum(axis=0)
    return driven - lost - stored - pulls, np.abs(works[:, 0]).sum()


@pytest.mark.parametrize("law", LAWS)
def test_the_balance_of_finite_steps_closes_with_second_order(law):
    errors = [abs(missing(steps, law)[0]) for steps in (200, 400, 800)]
    exchanged = missing(800, law)[1]
    assert exchanged > 0.1
    assert errors[2] < 1e-4 * exchanged
    # Friction turns round within the motion: a step across that is of lower order.
    assert errors[0] / errors[2] == pytest.approx(16.0, rel=0.3)


def test_a_step_back_gives_the_work_back():
    found, _ = states(5, "bearing")
    there, back = work_between(found[1], found[2]), work_between(found[2], found[1])
    assert back == pytest.approx([-energy for energy in there], rel=1e-12)


def test_nothing_moves_while_a_fault_strikes():
    found, _ = states(5, "bearing")
    before = found[2]
    ropes = before.ropes.jam(0, 2, before.stored, before.wound)
    case = random_case(4, friction=LAWS["bearing"])
    after = case.state(ropes=ropes)
    assert work_between(before, after) == (0.0, 0.0)
