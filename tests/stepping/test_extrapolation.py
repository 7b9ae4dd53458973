"""The first guess of a step is exact for polynomials."""

from itertools import pairwise

import numpy as np
import pytest

from ringsim.hermite import extrapolated

pytestmark = pytest.mark.quick


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_polynomial_goes_on(degree: int) -> None:
    times = np.array([0.0, 0.7, 1.0, 2.2][: degree + 1])
    step, curve = 0.45, np.polynomial.Polynomial([0.3, -1.0, 0.8, 2.0][: degree + 1])
    moves = [
        (after - before, np.array([curve(after) - curve(before)]) / (after - before))
        for before, after in pairwise(times)
    ]
    wanted = curve(times[-1] + step) - curve(times[-1])
    np.testing.assert_allclose(extrapolated(moves, step), [wanted], rtol=1e-13)
