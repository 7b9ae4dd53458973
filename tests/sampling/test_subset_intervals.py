"""Small subset simulations: their mean is exact, and their intervals hold the truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom, norm

from ringsim.analysis.intervals import share_interval
from ringsim.analysis.tails import DISAGREE, agreement, bound_of_first_levels, replicated_interval
from ringsim.cable.friction import BearingFriction
from ringsim.rigid.drive import Drive
from ringsim.rigid.mechanism import Mechanism
from ringsim.sampling.designs.levels import Answer, Repetition, simulation_of
from ringsim.scene import load_scene

AXES = 18


def simulated(response, rng, *, target, samples, share=0.1, axes=AXES, most=12):
    """One simulation of a response of points in standard normal space, shape (n, axes)."""
    found, points = Repetition(), np.empty((0, axes))
    simulation = simulation_of(found, samples, share, target, most)
    batch = next(simulation)
    while True:
        new = batch.anew * rng.standard_normal((len(batch.parents), axes))
        if batch.parents[0] >= 0:
            new += np.sqrt(1.0 - batch.anew**2) * points[batch.parents]
        numbers, points = np.arange(len(points), len(points) + len(new)), np.vstack([points, new])
        try:
            batch = simulation.send(Answer(numbers, response(new)))
        except StopIteration:
            return found


def linear(points):
    return points.sum(axis=1) / points.shape[1] ** 0.5


@pytest.mark.parametrize(
    ("exact", "samples", "replicates", "campaigns"),
    [
        (1e-3, 100, 8, 100),
        pytest.param(1e-3, 500, 4, 300, marks=pytest.mark.slow),
        pytest.param(1e-5, 100, 4, 300, marks=pytest.mark.slow),
        pytest.param(1e-5, 100, 16, 300, marks=pytest.mark.slow),
        pytest.param(1e-5, 500, 8, 300, marks=pytest.mark.slow),
    ],
)
def test_the_mean_is_exact_and_intervals_hold_the_truth(exact, samples, replicates, campaigns):
    """Thresholds at the lowest response inside the share would add 24 % (1e-3) and 67 % (1e-5) to
    the mean of levels of 100, and 16 replicates would hold the truth in 67 of 100 campaigns.
    """
    rng, target = np.random.default_rng(0), -norm.ppf(exact)
    found = [
        [simulated(linear, rng, target=target, samples=samples) for _ in range(replicates)]
        for _ in range(campaigns)
    ]
    each = np.array([[one.probability for one in many] for many in found])
    chains = np.array([[one.variation for one in many] for many in found])
    # What is left, by the correlation within chains, is some 5 % at 1e-5.
    assert abs(each.mean() / exact - 1.0) < 0.05 + 4.0 * each.std() / exact / each.size**0.5
    ends = np.array([replicated_interval(*both)[0] for both in zip(each, chains, strict=True)])
    held = int(((ends[:, 0] <= exact) & (exact <= ends[:, 1])).sum())
    # Of intervals that hold it in 92 % or more, fewer do once in a thousand times.
    assert held >= binom.ppf(1e-3, campaigns, 0.92), held


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "campaigns", "median"), [(50, 200, 0.61), (200, 100, 0.91)])
def test_small_levels_tell_too_little_of_two_sides_as_a_rule_and_the_mean_is_exact(
    samples, campaigns, median
):
    """Either of two sums of eight normal numbers, with 1.2e-5 in all."""
    exact = 1.2e-5
    target, rng = -norm.ppf(1.0 - (1.0 - exact) ** 0.5), np.random.default_rng(0)

    def farther(points):
        return np.maximum(points[:, :8].sum(axis=1), points[:, 8:].sum(axis=1)) / 8**0.5

    found = [
        [simulated(farther, rng, target=target, samples=samples, axes=16) for _ in range(4)]
        for _ in range(campaigns)
    ]
    each = np.array([[one.probability for one in many] for many in found])
    chains = np.array([[one.variation for one in many] for many in found])
    assert abs(each.mean() / exact - 1.0) < 4.0 * each.std() / exact / each.size**0.5
    assert np.median(each.mean(axis=1)) / exact == pytest.approx(median, abs=0.02)
    ends = np.array([replicated_interval(*both)[0] for both in zip(each, chains, strict=True)])
    assert ((ends[:, 0] <= exact) & (exact <= ends[:, 1])).mean() >= 0.92


def test_the_mean_is_exact_where_most_responses_are_equal():
    """As longest slacks are, of rings that are never slack: what goes on below equal ones until
    something lies beyond them has five times the probability.
    """
    rng, truth = np.random.default_rng(7), norm.sf(3.2)
    for samples, many in ((100, 300), (500, 80)):
        found = [
            simulated(
                lambda points: np.maximum(points[:, 0] - 3.0, 0.0), rng,
                target=0.2, samples=samples, axes=1,
            )
            for _ in range(many)
        ]  # fmt: skip
        each = np.array([one.probability for one in found])
        assert abs(each.mean() - truth) < 3.0 * each.std() / many**0.5
        assert (each == 0.0).any()


def test_responses_of_few_values_have_an_exact_mean_too():
    """3 with probability 1e-3, 2 with 0.02, 1 with 0.2."""
    limits = norm.isf([0.2, 0.02, 1e-3])
    rng = np.random.default_rng(1)
    found = [
        simulated(
            lambda points: np.searchsorted(limits, points[:, 0]).astype(float), rng,
            target=2.5, samples=200, axes=2,
        )
        for _ in range(40)
    ]  # fmt: skip
    each = np.array([one.probability for one in found])
    assert abs(each.mean() - 1e-3) < 4.0 * each.std() / 40**0.5
    for one in found:
        assert one.beyond(2.5) == (one.probability, one.variation)
        assert one.beyond(-np.inf) == (1.0, 0.0)
        assert (np.diff(one.thresholds) >= 0.0).all()


def test_no_interval_unless_every_replicate_came_to_the_event():
    ends, _ = replicated_interval(np.array([1e-3, 0.0]), np.array([0.5, np.inf]))
    assert np.isnan(ends).all()
    ends, variation = replicated_interval(np.array([1e-3]), np.array([0.5]))
    assert ends[0] < 1e-3 < ends[1]
    assert np.isnan(variation)
    # Student's t of two replicates is wide: no probability is above 1.
    ends, _ = replicated_interval(np.array([0.01, 0.09]), np.array([1.0, 1.0]))
    assert 0.0 < ends[0] < 0.05 < ends[1] == 1.0


def test_the_nearest_value_that_all_replicates_reached_bounds_an_event_that_none_did():
    """Its own exact probability lies in its interval, and that of the event below the upper end."""
    rng, held, campaigns = np.random.default_rng(2), 0, 200
    for _ in range(campaigns):
        found = [simulated(linear, rng, target=7.0, samples=100, most=2) for _ in range(4)]
        assert [one.probability for one in found] == [0.0] * 4
        reached = min(one.reached for one in found)
        assert all(one.thresholds[-1] < one.reached < one.states[-1].max() for one in found)
        each, chains = np.array([one.beyond(reached) for one in found]).T
        low, high = replicated_interval(each, chains)[0]
        held += bool(low <= norm.sf(reached) <= high)
        assert high > norm.sf(7.0)
    assert held >= binom.ppf(1e-3, campaigns, 0.92), held


def test_replicates_that_agree_by_chance_are_no_surer_than_their_chains():
    ends, variation = replicated_interval(np.full(4, 1e-3), np.full(4, 0.4))
    assert variation < 1e-12
    half = norm.ppf(0.975) * 0.4 / 2.0
    np.testing.assert_allclose(ends, 1e-3 * np.exp(0.4**2 / 2 + np.array([-half, half])))
    # With many of them the mean may lie outside what their logarithms say.
    ends, _ = replicated_interval(np.full(100, 1e-3), np.full(100, 0.9))
    assert ends[0] == pytest.approx(1e-3)


def two_ways(points):
    """Led by x1 up to 5, which has a probability of 3e-7; x2 takes over beyond 3 and has 1.4e-4."""
    return np.maximum(points[:, 0], 8.0 * (points[:, 1] - 3.0))


@pytest.mark.parametrize(
    ("replicates", "least"), [(8, 0.75), pytest.param(16, 0.95, marks=pytest.mark.slow)]
)
def test_replicates_that_found_different_parts_of_the_event_disagree(replicates, least):
    """By their logarithms intervals held the truth in 0.32 of campaigns of 8 and 0.42 of 16."""
    exact = 1.0 - (1.0 - norm.sf(5.0)) * (1.0 - norm.sf(3.0 + 5.0 / 8.0))
    rng, held, signs, campaigns = np.random.default_rng(0), 0, 0, 60
    for _ in range(campaigns):
        found = [
            simulated(two_ways, rng, target=5.0, samples=200, axes=2) for _ in range(replicates)
        ]
        each = np.array([one.probability for one in found])
        chains = np.array([one.variation for one in found])
        unled = bound_of_first_levels(found, 5.0)
        # 1 - 0.025 ** (1 / samples): none of so many was in it.
        assert unled >= (1.0 - 0.025 ** (1.0 / (200 * replicates))) * (1.0 - 1e-12)  # round-off
        signs += agreement(each, chains) < DISAGREE
        (low, high), _ = replicated_interval(each, chains, unled)
        held += bool(low <= exact <= high)
    assert held >= least * campaigns, held
    assert signs >= least * campaigns, signs


def test_replicates_that_found_the_same_seldom_disagree():
    rng, campaigns = np.random.default_rng(3), 60
    signs = 0
    for _ in range(campaigns):
        found = [simulated(linear, rng, target=3.1, samples=100) for _ in range(8)]
        each = np.array([one.probability for one in found])
        signs += agreement(each, np.array([one.variation for one in found])) < DISAGREE
    assert signs <= 8, signs
    assert np.isnan(agreement(np.array([1e-3]), np.array([0.3])))
    assert np.isnan(agreement(np.array([1e-3, 0.0]), np.array([0.3, np.inf])))


def test_brute_force_agrees_on_the_drive_of_a_ring_whose_pulleys_differ():
    """Statics of a cable of ``ring18-motor``: what scatter of 53 bearings leaves of its drive."""
    scene = load_scene("ring18-motor")
    mechanism, cable = Mechanism(scene), scene.cables.upper
    reeved, _ = Drive(scene, mechanism).reeved(mechanism.at(scene.structure.coordinate))

    def lost(points):
        """Share of the drive that pulleys take, each sample with a friction of its own each."""
        coefficients = 4e-4 * np.exp(0.6 * points)
        laws = [BearingFriction(coefficient=tuple(each)) for each in coefficients.tolist()]
        decays = [law.log_decay(reeved.angles, cable.pulley_radius) for law in laws]
        left = np.exp(np.cumsum(np.pad(decays, ((0, 0), (1, 0))), axis=1))
        return 1.0 - left @ reeved.shortening / reeved.shortening.sum()

    pulleys, limit = len(reeved.angles), 0.81
    brute = lost(np.random.default_rng(5).standard_normal((4000, pulleys)))
    low, high = share_interval(int((brute > limit).sum()), len(brute))
    assert 0.03 < (brute > limit).mean() < 0.08
    rng = np.random.default_rng(6)
    found = [
        simulated(lost, rng, target=limit, samples=80, share=0.25, axes=pulleys) for _ in range(8)
    ]
    each = np.array([one.probability for one in found])
    ends, _ = replicated_interval(each, np.array([one.variation for one in found]))
    assert max(low, ends[0]) < min(high, ends[1])
    assert abs(each.mean() - (brute > limit).mean()) < 4.0 * np.hypot(
        each.std(ddof=1) / 8**0.5, (0.05 / 4000) ** 0.5
    )
