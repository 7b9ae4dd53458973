"""Friction of pulleys that depends on the rope's speed and on its tension: closed forms."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from stribeck import SealDrag, StribeckFriction

from cable_cases import RADIUS, still
from ringsim.cable.friction import PulleyFriction, Pulleys

PATH = [[0, 0, 0], [1, 0, 0], [1.4, 0.9, 0], [2.4, 0.9, 0.3]]
"""Two pulleys."""
STIFFNESS, WOUND, SLIP = 1e4, 0.02, 1e-5


def test_each_of_two_pulleys_takes_the_drag_of_its_seal() -> None:
    """T_1 = T_0 - F and T_2 = T_0 - 2 F, and their mean by length is the rope's own tension."""
    drag = 7.0
    case = still(
        PATH, WOUND, friction=SealDrag(drag=drag), axial_stiffness=STIFFNESS, slip_speed=SLIP,
        slack_width=1e-3,
    )  # fmt: skip
    lengths = np.linalg.norm(np.diff(np.array(PATH), axis=0), axis=1)
    path = lengths.sum()
    mean = STIFFNESS * WOUND / (path - WOUND)
    expected = mean + drag * (lengths[1:].sum() + lengths[2]) / path - drag * np.arange(3)
    assert case.state().tensions == pytest.approx(expected, rel=1e-12)


def test_each_of_two_pulleys_has_the_friction_of_its_own_speed() -> None:
    """The far end is fixed: over a pulley runs the share of the rope that lies beyond it."""
    law = StribeckFriction(coefficient=0.4 * RADIUS, kinetic=0.3, speed=0.4)
    case = still(
        PATH, WOUND, friction=law, axial_stiffness=STIFFNESS, slip_speed=SLIP, slack_width=1e-3
    )
    state = case.state()
    points = np.array(PATH, dtype=float)
    along = np.diff(points, axis=0)
    lengths = np.linalg.norm(along, axis=1)
    speeds = np.array([lengths[1:].sum(), lengths[2]]) / lengths.sum()  # wound at 1 m/s
    units = along / lengths[:, None]
    half = 0.5 * np.arccos(-np.sum(units[:-1] * units[1:], axis=1))
    lever = 0.4 * (0.3 + 0.7 * np.exp(-((speeds / 0.4) ** 2))) * np.cos(half)
    eta = (1.0 - lever) / (1.0 + lever)
    assert state.tensions[1:] / state.tensions[:-1] == pytest.approx(eta, rel=1e-12)
    assert eta[0] > eta[1] + 0.05  # the slow one rubs more


class Jump(PulleyFriction):
    """Friction that is there above a tension and gone below: between them lies no answer."""

    kind: Literal["jump"] = "jump"
    loads: ClassVar[bool] = True

    def decay(self, pulleys: Pulleys, radius: float) -> Any:
        return np.where(pulleys.tension > 30.0, -5.0, 0.0)


def test_friction_that_no_tension_goes_with_has_no_answer() -> None:
    # With friction the mean of both sides is two thirds of 33 N, without it 33 N.
    path = [[0, 0, 0], [3, 0, 0], [3, 1, 0]]
    case = still(path, 0.0132, friction=Jump(), axial_stiffness=STIFFNESS, slip_speed=SLIP)
    with pytest.raises(ValueError, match="no equilibrium of rope tension and pulley friction"):
        case.state()
