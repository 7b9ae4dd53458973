"""Radau IIA: order, stability, and the equations of one batch being apart."""

import numpy as np
import pytest

from ringsim.theory import radau


def integrate(law, steps: int, duration: float, x: float, v: float) -> tuple[float, float]:
    """Equal steps of x'' = law(x, v)."""
    at, rate = np.array([x]), np.array([v])
    h = np.array([duration / steps])
    tight = np.full(1, 1e-10), np.full(1, 1e-10)
    nudge = np.full(1, 1e-7), np.full(1, 1e-7)
    guess = np.zeros((1, 3))
    for _ in range(steps):
        pull, good, _ = radau.solve_stages(law, (at, rate, h), guess, nudge, tight)
        assert good.all()
        xs, vs = radau.stage_states(at, rate, h, pull)
        at, rate = xs[:, 2], vs[:, 2]
        guess = radau.extrapolated(pull, np.ones(1))
    return float(at[0]), float(rate[0])


def pendulum(x, v):
    return -np.sin(x) - 0.1 * v


def test_order_is_five():
    fine = integrate(pendulum, 400, 4.0, 1.0, 0.0)[0]
    errors = [abs(integrate(pendulum, steps, 4.0, 1.0, 0.0)[0] - fine) for steps in (6, 12, 24)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    # Asymptotic order 5; the coarsest step is 0.67 of the unit time scale.
    assert orders.min() > 4.6


def test_stiff_part_dies_in_one_step():
    def stiff(x, v):
        return -1e10 * (x - 0.3)

    x, v = integrate(stiff, 8, 1.0, 0.3 + 1e-4, 0.0)
    # |R(z)| ~ 3 / |z| for large z = h omega = 1e4: after 8 steps nothing is left.
    assert x == pytest.approx(0.3, abs=1e-9)
    assert abs(v) < 1e-9


def test_quadrature_weights_are_exact_to_degree_four():
    for degree in range(5):
        assert radau.WEIGHTS @ radau.NODES**degree == pytest.approx(1.0 / (degree + 1), rel=1e-14)


def test_equations_of_a_batch_do_not_see_each_other():
    x, v, h = np.array([1.0, 0.2, 2.0]), np.array([0.0, 1.0, -1.0]), np.array([0.1, 0.02, 0.3])
    tight = np.full(3, 1e-9), np.full(3, 1e-9)
    nudge = np.full(3, 1e-7), np.full(3, 1e-7)
    together, good, _ = radau.solve_stages(pendulum, (x, v, h), np.zeros((3, 3)), nudge, tight)
    assert good.all()
    for k in range(3):
        one = slice(k, k + 1)
        alone, _, _ = radau.solve_stages(
            pendulum,
            (x[one], v[one], h[one]),
            np.zeros((1, 3)),
            (nudge[0][one], nudge[1][one]),
            (tight[0][one], tight[1][one]),
        )
        # Newton stops at a thousandth of 1e-9 in the angle, over h^2.
        np.testing.assert_allclose(alone[0], together[k], atol=1e-12 / h[k] ** 2)


def test_what_is_not_a_number_fails_alone():
    def wall(x, v):
        return np.where(x > 5.0, np.nan, -x)

    x, v, h = np.array([1.0, 10.0]), np.zeros(2), np.full(2, 0.1)
    tight = np.full(2, 1e-9), np.full(2, 1e-9)
    _, good, _ = radau.solve_stages(wall, (x, v, h), np.zeros((2, 3)), tight, tight)
    assert good.tolist() == [True, False]
