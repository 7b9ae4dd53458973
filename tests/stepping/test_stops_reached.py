"""Which stop all V-joints have reached: the last one, and none that they have left."""

import math

import numpy as np
import pytest

from ringsim.stepping.locks import Locks
from ringsim.variables import Fate

pytestmark = pytest.mark.quick

STOWED = 0.8


def after(*angles: float | tuple[float, float], start: float = 2.0) -> Fate:
    """The stop after these opening angles (rad), of one joint a plane or of both alike."""
    locks = Locks(np.full((2, 1), start), STOWED)
    for angle in angles:
        locks.note(np.broadcast_to(np.reshape(angle, (-1, 1)), (2, 1)))
    return locks.reached


@pytest.mark.parametrize(
    ("angles", "fate"),
    [
        ((STOWED,), Fate.FOLDED),
        ((STOWED, 0.85), Fate.FOLDED),  # it bounces
        ((STOWED, 0.95), Fate.NONE),  # it has left its stop
        ((STOWED, (0.95, 0.85)), Fate.FOLDED),  # one of two has
        ((STOWED, 2.0, math.pi), Fate.DEPLOYED),
        ((math.pi,), Fate.DEPLOYED),
        ((math.pi, 2.0), Fate.DEPLOYED),  # no latch holds it, but it has been there
        ((math.pi, 2.0, STOWED), Fate.FOLDED),
        ((math.pi, STOWED, 2.0), Fate.NONE),
        ((math.pi, STOWED, 2.0, math.pi), Fate.DEPLOYED),
        (((STOWED, 2.0), (2.0, STOWED)), Fate.FOLDED),  # one after the other
    ],
)
def test_the_last_stop_counts(angles, fate) -> None:
    assert after(*angles) is fate


def test_who_starts_on_the_stop_has_not_come_to_it() -> None:
    assert after(STOWED, start=STOWED) is Fate.NONE
    assert after(2.0, STOWED, start=STOWED) is Fate.FOLDED


def test_joints_that_folded_again_come_to_180_deg_anew() -> None:
    """Steps have to meet it as they did the first time."""
    locks = Locks(np.full((2, 1), 2.0), STOWED)
    for angle in (math.pi, STOWED):
        locks.note(np.full((2, 1), angle))
    assert not locks.deployed.any()
    assert "0 of 2 V-joints locked" in locks.missing()
