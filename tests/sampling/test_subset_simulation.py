"""Subset simulation finds probabilities that are known in closed form, and states its error."""

from __future__ import annotations

import numpy as np
import pytest
from loops import for_each
from scipy.special import ndtr, ndtri
from scipy.stats import norm

from ringsim.refusal import InputError
from ringsim.sampling.designs.levels import SubsetSimulation, variance_of_level

AXES = dict.fromkeys("abcdefgh")


def simulate(design, response, seed, axes=AXES):
    """All repetitions of a response of points in standard normal space, shape (n, axes)."""
    known = np.empty(0)
    for _ in range(500):
        points = design.knowing(known).points(axes, seed)
        if design.levels(known).ended:
            assert len(points) == len(known)
            return design.levels(known).repetitions, points
        new = response(ndtri(points[len(known) :]))
        known = np.append(known, design.responses(new, np.zeros(len(new), dtype=bool)))
    raise AssertionError("it does not end")


def linear(points):
    """Standard normal, whatever the number of inputs: the event above beta has Phi(-beta)."""
    return points.sum(axis=1) / points.shape[1] ** 0.5


def design(above, samples=500, replicates=16, **more):
    return SubsetSimulation(
        of="asynchrony_max", above=above, samples=samples, replicates=replicates, **more
    )


@pytest.mark.parametrize("exact", [1e-3, pytest.param(1e-5, marks=pytest.mark.slow)])
def test_a_linear_limit_is_found(exact):
    beta = -norm.ppf(exact)
    found, _ = simulate(design(beta), linear, seed=3)
    each = np.array([one.probability for one in found])
    error = each.std(ddof=1) / 4.0
    assert 0.02 < error / exact < 0.3
    # 16 replicates: 4 standard errors, and one in ten thousand is farther away.
    assert abs(each.mean() - exact) < 4.0 * error
    stated = np.sqrt(np.mean([one.variation**2 for one in found])) / 4.0
    # The correlation within chains alone: neither half nor twice the scatter.
    assert 0.5 < stated / (error / each.mean()) < 2.0


def test_a_limit_with_two_sides_and_one_below_are_found():
    """Twice the tail of a normal variable, from both sides at once; and a lower tail."""
    exact = 2.0 * ndtr(-3.5)
    found, _ = simulate(design(3.5, samples=1000), lambda u: np.abs(linear(u)), seed=1)
    each = np.array([one.probability for one in found])
    assert abs(each.mean() - exact) < 4.0 * each.std(ddof=1) / 4.0
    low = SubsetSimulation(of="asynchrony_max", below=-3.0, samples=200, replicates=8)
    found, _ = simulate(low, linear, seed=1)
    each = np.array([one.probability for one in found])
    assert abs(each.mean() - ndtr(-3.0)) < 4.0 * each.std(ddof=1) / 8**0.5


def test_brute_force_agrees_where_it_can():
    """A curved limit without a closed form, a share of 4e-3 of 400,000 samples."""

    def curved(points):
        return linear(points) + 0.3 * points[:, 0] * points[:, 1]

    brute = curved(np.random.default_rng(0).standard_normal((400_000, 8)))
    exact = np.mean(brute > 3.0)
    found, _ = simulate(design(3.0), curved, seed=2)
    each = np.array([one.probability for one in found])
    assert abs(each.mean() - exact) < 4.0 * np.hypot(each.std(ddof=1) / 4, (exact / 4e5) ** 0.5)


def test_openturns_agrees():
    ot = pytest.importorskip("openturns", reason="extra oracle")
    ot.RandomGenerator.SetSeed(0)
    limit = ot.SymbolicFunction(["a", "b"], ["(a + b) / sqrt(2) + 0.2 * a * b"])
    vector = ot.CompositeRandomVector(limit, ot.RandomVector(ot.Normal(2)))
    event = ot.ThresholdEvent(vector, ot.Greater(), 4.5)
    oracle = ot.SubsetSampling(event)
    oracle.setMaximumOuterSampling(4000)
    oracle.setBlockSize(1)
    oracle.run()
    result = oracle.getResult()

    def curved(points):
        return linear(points) + 0.2 * points[:, 0] * points[:, 1]

    found, _ = simulate(design(4.5), curved, seed=4, axes=dict.fromkeys("ab"))
    each = np.array([one.probability for one in found])
    theirs = result.getProbabilityEstimate()
    error = np.hypot(each.std(ddof=1) / 4.0, theirs * result.getCoefficientOfVariation())
    assert abs(each.mean() - theirs) < 4.0 * error


def test_points_do_not_depend_on_what_comes_after():
    """A sample's point is fixed once those before its batch have run."""
    wanted = design(3.0, samples=40, replicates=2)
    _, whole = simulate(wanted, linear, seed=5)
    part = wanted.knowing(linear(ndtri(whole[:80]))).points(AXES, 5)
    assert len(part) == 88
    np.testing.assert_array_equal(part, whole[:88])
    plain = wanted.points(AXES, 5)
    np.testing.assert_array_equal(plain, whole[:80])


def test_chains_that_stand_still_are_less_certain():
    """Equal states along a chain count once: all are worth no more than one a chain."""
    inside = np.repeat(np.arange(100) < 20, 1)
    alone = variance_of_level(inside, 100)
    assert alone == pytest.approx(0.8 / (0.2 * 100))
    still = variance_of_level(np.tile(inside, 10), 100)
    assert still == pytest.approx(alone)


def test_lost_runs_are_no_events_and_runs_without_a_value_are():
    values, lost = np.array([1.0, np.nan, np.nan]), np.array([False, True, False])
    assert design(2.0).responses(values, lost).tolist() == [1.0, -np.inf, np.inf]
    found, _ = simulate(design(2.0, samples=100), lambda u: np.full(len(u), np.nan), seed=0)
    assert [one.probability for one in found] == [1.0] * 16


def test_an_event_that_never_happens_ends_too():
    wanted = design(100.0, samples=20, replicates=2, most_levels=2)
    found, points = simulate(wanted, linear, seed=0)
    assert [one.probability for one in found] == [0.0, 0.0]
    assert len(points) == 2 * (20 + 2 * 18)


@for_each(
    ("more", "words"),
    [
        ({"of": "opening_angle"}, "opening_angle has a value for each plane and section and time"),
        ({"below": 1.0}, "either above or below"),
        ({"share": 0.3}, "one over a whole number"),
        ({"samples": 25}, "multiple of 1 / share = 10, for example 20"),
    ],
)
def test_what_does_not_fit_is_refused(more, words):
    with pytest.raises((ValueError, InputError), match=words):
        SubsetSimulation.model_validate({"of": "asynchrony_max", "above": 1.0} | more)
