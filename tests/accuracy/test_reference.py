"""Limits of three levels whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from ringsim.analysis.engines import limit, order, reference

pytestmark = pytest.mark.quick


def levels(*values: object) -> xr.DataArray:
    array = np.array(values, dtype=float)
    return xr.DataArray(array, dims=("rung", "time")[: array.ndim])


@pytest.mark.parametrize("ratio", [2.0, 3.0, 4.0])
def test_changes_that_shrink_are_followed_to_their_end(ratio: float) -> None:
    found = limit(levels(*(5.0 + ratio**-k for k in range(3))))
    assert float(found.value) == pytest.approx(5.0)
    assert found.uncertainty >= ratio**-2 * (1.0 - 1e-9)


def test_no_more_than_second_order_is_believed() -> None:
    found = limit(levels(1.0, 0.1, 0.09))
    assert float(found.value) == pytest.approx(0.09 - 0.01 / 3.0)
    assert found.uncertainty == pytest.approx(0.9 / 12.0)  # two levels may agree by chance


@pytest.mark.parametrize("values", [(1.0, 2.0, 3.0), (1.0, 2.0, 1.0), (0.0, 0.0, 1.0)])
def test_changes_that_do_not_shrink_extrapolate_nothing(values: tuple[float, ...]) -> None:
    found = limit(levels(*values))
    assert float(found.value) == values[2]
    assert found.uncertainty == 1.0


@pytest.mark.parametrize("values", [(1.0, -0.5, 0.25), (1.0, 0.0, 0.5), (1.0, -0.3, 0.09)])
def test_changes_that_go_back_and_forth_are_not_extrapolated(values: tuple[float, ...]) -> None:
    a, b, c = values
    aitken = c - (c - b) ** 2 / (c - 2.0 * b + a)
    found = limit(levels(*values))
    assert float(found.value) == c
    assert abs(aitken - c) <= found.uncertainty


def test_equal_levels_are_certain() -> None:
    assert limit(levels(2.0, 2.0, 2.0)) == (2.0, 0.0)


def test_series_are_extrapolated_point_by_point_at_one_ratio() -> None:
    shape = np.array([1.0, -2.0, 0.5])
    found = limit(levels(*(3.0 + shape * 0.25**k for k in range(3))))
    np.testing.assert_allclose(found.value, 3.0, rtol=1e-12)
    assert found.uncertainty == pytest.approx(2.0 / 16.0)


def test_steps_and_elements_add() -> None:
    """Levels in space carry the error of their steps, all the same one."""
    in_time = levels(*(7.0 + 0.25**k + 0.1 for k in range(3)))
    in_space = levels(*(7.0 + 0.25 + 0.1 * 0.25**k for k in range(3)))
    found = reference(in_time, in_space)
    assert float(found.value) == pytest.approx(7.0)
    assert found.uncertainty == pytest.approx(0.0625 + 0.1 / 16.0)


def test_orders_of_three_levels() -> None:
    values = levels(1.0, 0.25, 0.0625)
    assert order(values, noise=0.1) == pytest.approx(2.0)
    assert np.isnan(order(values, noise=0.2))
