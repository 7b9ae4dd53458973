"""The package's cubics against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ringsim.hermite import Array, cubic, first_zero, monotone_slopes

pytestmark = pytest.mark.quick

_RANDOM = np.random.default_rng(20)
_TIMES = np.sort(_RANDOM.random(40))
_VALUES = _RANDOM.normal(size=(40, 2, 3)).cumsum(axis=0)
_VALUES[5:9] = _VALUES[5]  # flat
_VALUES[20:22, 0] = 0.0
_WHERE = np.concatenate([_RANDOM.uniform(_TIMES[0], _TIMES[-1], 200), _TIMES])


def test_cubic_is_scipys() -> None:
    slopes = 30.0 * _RANDOM.normal(size=_VALUES.shape)
    found = cubic(_TIMES, _VALUES, slopes, _WHERE)
    wanted = CubicHermiteSpline(_TIMES, _VALUES, slopes)(_WHERE)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("points", [2, 3, 40])
def test_monotone_slopes_are_scipys(points: int) -> None:
    times, values = _TIMES[:points], _VALUES[:points]
    where = _WHERE[(times[0] <= _WHERE) & (times[-1] >= _WHERE)]
    found = cubic(times, values, monotone_slopes(times, values), where)
    wanted = PchipInterpolator(times, values)(where)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-13)


def test_first_zero_is_the_first_of_three() -> None:
    def value(t: Array) -> Array:
        return (t - 0.1) * (t - 0.3) * (t - 0.4)

    def slope(t: Array) -> Array:
        return (t - 0.3) * (t - 0.4) + (t - 0.1) * (t - 0.4) + (t - 0.1) * (t - 0.3)

    ends = np.array([0.0, 0.5])
    found = first_zero(0.5, value(ends), slope(ends))
    assert found == pytest.approx(0.1, abs=1e-12)


def test_first_zero_stays_within_the_step() -> None:
    assert first_zero(0.5, np.array([-1e-20, 0.0]), np.array([1.0, -1.0])) <= 0.5
    assert first_zero(0.5, np.array([-1.0, 0.0]), np.array([2.0, 2.0])) == pytest.approx(0.5)
    # A cubic that has no zero there, as of a value that round-off has left below.
    assert first_zero(0.5, np.array([-1.0, -1e-18]), np.array([2.0, 2.0])) == 0.5
