"""Every distribution maps probabilities to the values that its definition asks for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from pydantic import TypeAdapter, ValidationError
from scipy import stats

from ringsim.choice import kinds_of
from ringsim.sampling.distributions import Distribution, Lognormal
from ringsim.sampling.table import AnyDistribution

pytestmark = pytest.mark.quick

READ = TypeAdapter(AnyDistribution)

EXAMPLES = {
    "normal": {"mean": 3.0, "standard_deviation": 0.5},
    "lognormal": {"mean": 3.0, "standard_deviation": 1.5},
    "uniform": {"low": -1.0, "high": 4.0},
    "truncated": {
        "of": {"kind": "normal", "mean": 3.0, "standard_deviation": 2.0},
        "low": 1.0,
        "high": 4.0,
    },
    "calibrated": {
        "of": {"kind": "normal", "mean": 3.0, "standard_deviation": 2.0},
        "shift": 0.5,
        "remaining_scatter": 0.25,
    },
    "discrete": {"values": [1.0, 2.0, 5.0], "probabilities": [0.5, 0.2, 0.3]},
}


def example(kind):
    return READ.validate_python({"kind": kind, **EXAMPLES[kind]})


def reference(kind):
    match kind:
        case "normal":
            return stats.norm(3.0, 0.5)
        case "lognormal":
            spread = np.sqrt(np.log(1.25))
            return stats.lognorm(s=spread, scale=3.0 / np.sqrt(1.25))
        case "uniform":
            return stats.uniform(-1.0, 5.0)
        case "truncated":
            return stats.truncnorm(-1.0, 0.5, loc=3.0, scale=2.0)
        case "calibrated":
            return stats.norm(4.0, 0.5)


def test_every_kind_has_an_example():
    """But those that are not drawn: tests/sampling/test_functions.py."""
    assert set(kinds_of(Distribution)) - {"function"} == set(EXAMPLES)


@pytest.mark.parametrize("kind", EXAMPLES)
@given(st.lists(st.floats(1e-9, 1.0 - 1e-9), min_size=2, max_size=20))
def test_quantiles_grow_and_are_finite(kind, probabilities):
    values = example(kind).quantile(np.sort(probabilities))
    assert np.isfinite(values).all()
    assert (np.diff(values) >= 0.0).all()


@pytest.mark.parametrize("kind", ["normal", "lognormal", "uniform", "truncated"])
def test_quantiles_agree_with_scipy(kind):
    probabilities = np.linspace(0.001, 0.999, 199)
    expected = reference(kind).ppf(probabilities)
    np.testing.assert_allclose(example(kind).quantile(probabilities), expected, rtol=1e-12)


@pytest.mark.parametrize("kind", ["normal", "lognormal", "uniform"])
def test_probability_inverts_the_quantile(kind):
    distribution = example(kind)
    for probability in (0.01, 0.4, 0.97):
        value = float(distribution.quantile(np.array([probability]))[0])
        assert distribution.probability(value) == pytest.approx(probability, rel=1e-12)


@pytest.mark.parametrize("kind", ["normal", "lognormal"])
def test_mean_and_deviation_are_those_asked_for(kind):
    """Moments by Gauss-Hermite quadrature of the quantiles over a standard normal variable.

    Twelve points reach to 5.5 deviations and integrate both integrands to 1e-10; quantiles at
    probabilities so near to 1 have lost half of their digits, at weights below 1e-7.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(12)
    values = example(kind).quantile(stats.norm.cdf(nodes))
    weights = weights / weights.sum()
    mean = weights @ values
    assert mean == pytest.approx(EXAMPLES[kind]["mean"], rel=1e-9)
    deviation = np.sqrt(weights @ (values - mean) ** 2)
    assert deviation == pytest.approx(EXAMPLES[kind]["standard_deviation"], rel=1e-9)


def test_a_lognormal_of_any_width_is_drawn():
    """exp(ln(m) - ln(1 + (s / m)^2) / 2) is the median, m^2 / s where s is far larger than m."""
    for mean, deviation in ((1e5, 1e13), (1e5, 1e14), (1e5, 1e308), (1e-300, 1e300)):
        law = Lognormal(mean=mean, standard_deviation=deviation)
        asked = 2.0 * math.log(mean) - math.log(deviation)
        assert law._logarithm.mean == pytest.approx(asked, rel=1e-12)
        assert law.quantile(np.array([0.5])) == pytest.approx([math.exp(asked)], rel=1e-9)


def test_discrete_values_occur_as_often_as_asked():
    values = example("discrete").quantile((np.arange(1000) + 0.5) / 1000)
    assert [int((values == v).sum()) for v in (1.0, 2.0, 5.0)] == [500, 200, 300]


def test_discrete_keeps_whole_numbers_words_and_switches():
    cases = (([1, 2], "i"), ([1, 2.5], "f"), ([True, False], "b"), (["a", "bc"], "U"),
             ([5.0, "none"], "O"), ([{"kind": "a"}, []], "O"), ([[1], [2]], "O"))  # fmt: skip
    for values, kind in cases:
        read = READ.validate_python({"kind": "discrete", "values": values})
        assert read.quantile(np.array([0.1, 0.9])).tolist() == values
        assert read.quantile(np.array([0.1])).dtype.kind == kind


def test_uniform_reaches_its_ends_exactly():
    ends = READ.validate_python({"kind": "uniform", "low": 0.1, "high": 0.7})
    assert ends.quantile(np.array([0.0, 1.0])).tolist() == [0.1, 0.7]


@for_each(
    ("table", "words"),
    [
        ({"kind": "uniform", "low": 1.0, "high": 1.0}, "must be below"),
        ({"kind": "discrete", "values": []}, "at least one"),
        ({"kind": "discrete", "values": [1, 1]}, "differ"),
        ({"kind": "discrete", "values": [{"kind": "a"}, {"kind": "a"}]}, "differ"),
        (
            {"kind": "discrete", "values": ["a", float("nan")]},
            r"values.2. = nan must be",
        ),
        (
            {
                "kind": "truncated",
                "low": 1.0,
                "of": {"kind": "normal", **EXAMPLES["normal"], "shared": ["a.b"]},
            },
            "of.shared must be given beside kind",
        ),
        ({"kind": "discrete", "values": [1, 2], "probabilities": [1.0]}, "one for each"),
        ({"kind": "discrete", "values": [1, 2], "probabilities": [0.5, 0.6]}, "add up to 1"),
        ({"kind": "truncated", "of": EXAMPLES["normal"] | {"kind": "normal"}}, "low, high or both"),
        (
            {"kind": "truncated", "low": 99.0, "of": EXAMPLES["normal"] | {"kind": "normal"}},
            "widen the bounds",
        ),
        ({"kind": "normal", "mean": 1.0, "standard_deviation": 0.0}, "greater than 0"),
    ],
)
def test_senseless_parameters_are_refused(table, words):
    with pytest.raises(ValidationError, match=words):
        READ.validate_python(table)
