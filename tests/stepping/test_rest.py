"""Whether a structure rests for good, on motions with closed forms."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ringsim.stepping.ending import MOVED, WINDOW, Rest
from ringsim.stepping.instant import Energies, Instant

pytestmark = pytest.mark.quick

END, BEGIN = 10.0, 1.0
"""End time of the run, s, and the angle from which the joints start, rad."""


def rests_at(
    law: Callable[[float], tuple[float, float]], *, driven_until: float = 0.0, stop: float = math.pi
) -> float:
    """When six joints that move by a law (angle, rate) towards a stop (rad) are found at rest, s;
    NaN if never.
    """

    def at(time: float) -> Instant:
        angle, rate = law(time)
        energies = Energies(0.5 * rate**2, 0.0, 0.0, 0.0)
        angles, rates = np.full((2, 3), angle), np.full((2, 3), rate)
        return Instant(time, angles, rates, energies, driven=time < driven_until)

    rest = Rest(at(0.0), END, 1.0)
    for time in np.arange(1, 501) * END / 500:
        if rest.reached(at(float(time)), lambda angles, moved: stop - angles):
            return float(time)
    return math.nan


def test_what_stands_still_rests_after_a_window() -> None:
    assert rests_at(lambda t: (BEGIN, 0.0)) == pytest.approx(WINDOW * END)


def test_a_winch_that_will_turn_or_a_fault_to_come_is_waited_for() -> None:
    found = rests_at(lambda t: (BEGIN, 0.0), driven_until=4.0)
    assert found == pytest.approx(4.0 + WINDOW * END, abs=END / 500)


def test_what_comes_to_rest_exponentially_rests_once_the_rest_of_its_way_is_short() -> None:
    found = rests_at(lambda t: (BEGIN - math.exp(-2.0 * t), 2.0 * math.exp(-2.0 * t)))
    # From then on it moves by exp(-2 t) < MOVED.
    begun = -0.5 * math.log(MOVED)
    assert begun < found < begun + 2.0 * WINDOW * END


def test_what_begins_to_move_slowly_is_not_at_rest() -> None:
    """It has moved by 7e-3 rad within the first window, and by 7 rad at the end."""
    assert math.isnan(rests_at(lambda t: (BEGIN + 0.02 * t**3 / 3.0, 0.02 * t**2)))


def test_a_vibration_that_does_not_fade_is_no_rest_unless_it_is_slight() -> None:
    def swing(size: float) -> float:
        return rests_at(
            lambda t: (BEGIN + size * math.sin(3.0 * t), 3.0 * size * math.cos(3.0 * t))
        )

    assert math.isnan(swing(10.0 * MOVED))
    assert swing(0.1 * MOVED) < END


def test_what_creeps_by_less_than_it_may_until_the_end_rests() -> None:
    slow, fast = 0.5 * MOVED / (WINDOW * END), 2.0 * MOVED / (WINDOW * END)
    assert rests_at(lambda t: (BEGIN + slow * t, slow)) == pytest.approx(WINDOW * END)
    assert math.isnan(rests_at(lambda t: (BEGIN + fast * t, fast)))


def test_creep_that_gains_a_few_per_cent_rests() -> None:
    """Through what dry friction is at low rates, towards angles at which there is more drive."""
    slow = 0.2 * MOVED / (WINDOW * END)
    assert rests_at(lambda t: (BEGIN + slow * t * (1.0 + 0.01 * t), slow * (1.0 + 0.02 * t))) < 2.0


def test_what_creeps_to_a_stop_that_it_will_reach_is_no_rest() -> None:
    """Half of what a joint at rest may move by, a little way in front of its stop."""
    slow = 0.5 * MOVED / (WINDOW * END)
    near, far = BEGIN + 0.8 * slow * END, BEGIN + 3.0 * slow * END
    assert math.isnan(rests_at(lambda t: (BEGIN + slow * t, slow), stop=near))
    assert rests_at(lambda t: (BEGIN + slow * t, slow), stop=far) < END
