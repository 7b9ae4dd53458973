"""Forces on the pulleys of a section: paper 000, eqs 28-31, with its errors of sign put right."""

from __future__ import annotations

import numpy as np
import pytest

from cable_cases import LAWS, still

pytestmark = pytest.mark.quick

HALF, OFFSET, SHORT = 0.2889, 0.105, 0.013
ROUND_OFF = 1e-12


def forces(fold, law):
    """Forces in the plane of two sections in a row, tensions, and the spans' fall gamma."""
    reach, drop = HALF * np.cos(fold), HALF * np.sin(fold) + OFFSET
    points, x = [[0.0, -0.3]], 0.0
    for _ in range(2):
        points += [[x, 0.0], [x + reach, -drop], [x + 2 * reach, 0.0]]
        x += 2 * reach + SHORT
    points = [[px, 0.0, pz] for px, pz in points]
    state = still(points, 0.002, (1.0, 0.0), friction=LAWS[law]).state()
    found = state.point_forces
    assert found[:, 1] == pytest.approx(0.0, abs=ROUND_OFF)
    return found[:, [0, 2]], state.tensions, np.arctan2(drop, reach)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("opening", [20.0, 90.0, 170.0])
def test_forces_on_all_pulleys(opening, law):
    found, tension, fall = forces(0.5 * (np.pi - np.radians(opening)), law)
    c, s, t = np.cos(fall), np.sin(fall), tension
    expected = [
        [t[1] * c, -t[0] - t[1] * s],  # eq. 28: the rope comes up from the winch
        [(t[2] - t[1]) * c, (t[1] + t[2]) * s],  # eq. 30: a sum out of the opening
        [t[3] - t[2] * c, -t[2] * s],  # eq. 31
        [t[4] * c - t[3], -t[4] * s],  # eq. 29, along the section
        [(t[5] - t[4]) * c, (t[4] + t[5]) * s],
    ]
    assert found[1:6] == pytest.approx(np.array(expected), abs=ROUND_OFF * t.max())


def test_a_rope_without_friction_pushes_the_v_pulley_with_twice_its_tension():
    """The difference that eq. 30 prints is zero there, and nothing would open the truss."""
    found, tension, fall = forces(0.7, "none")
    push = found[2, 1]
    assert push == pytest.approx(2.0 * tension[0] * np.sin(fall), rel=1e-12)
    assert push > 10.0
