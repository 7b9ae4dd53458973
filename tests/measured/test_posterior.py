"""What data tell of unknowns: closed forms of linear models, strays, contrasts, sensors."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr

from ringsim.analysis.posterior import (
    FALSE_ALARM,
    UNEXPLAINED,
    WIDER,
    Learnt,
    contrasts,
    explained,
    learn,
    posterior_of,
)
from ringsim.analysis.residuals import rank, sensors_table
from ringsim.measured import Told

pytestmark = pytest.mark.quick

UNKNOWNS, READINGS = 5, 40


def slopes(seed=1, unknowns=UNKNOWNS, readings=READINGS):
    return np.random.default_rng(seed).standard_normal((readings, unknowns)) * np.linspace(
        0.02, 1.5, unknowns
    )


def closed_form(slope, data, noise):
    """Mean and covariance for y = A u + e, u ~ N(0, 1), e ~ N(0, noise)."""
    weighed = np.linalg.solve(noise, slope)
    covariance = np.linalg.inv(np.eye(slope.shape[1]) + slope.T @ weighed)
    return covariance @ weighed.T @ data, covariance


def staged(model, told_by, unknowns, members, stages=4, seed=2):
    """The result of stages on a model (points to outputs)."""
    stream = np.random.default_rng(seed)
    points = stream.standard_normal((members, unknowns))
    found = learn(points, told_by(model(points)))
    for _ in range(stages - 1):
        points = found.posterior.draw(members, stream, WIDER)
        found = learn(points, told_by(model(points)))
    return found


def sensors(outputs, data, count=4, deviation=1.0, bias=0.0):
    return [
        Told(f"s{k}", o, d, deviation, bias)
        for k, (o, d) in enumerate(zip(np.split(outputs, count, axis=1), np.split(data, count),
                                       strict=True))
    ]  # fmt: skip


def test_linear_model_gives_the_closed_form():
    slope, stream = slopes(), np.random.default_rng(3)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(READINGS)
    found = staged(lambda u: u @ slope.T, lambda y: sensors(y, data), UNKNOWNS, 4096)
    mean, covariance = closed_form(slope, data, np.eye(READINGS))
    scatter = np.sqrt(np.diag(covariance))
    assert np.abs(found.posterior.mean - mean).max() < 0.02 * scatter.min()
    np.testing.assert_allclose(found.posterior.covariance, covariance, rtol=0.02, atol=1e-9)


def test_noise_that_the_map_cannot_see_is_what_runs_off_it_have():
    """Runs that scatter by sqrt(3) off the map are worth a reading of four times the variance."""
    slope, stream = slopes(), np.random.default_rng(4)
    data = slope @ stream.standard_normal(UNKNOWNS)
    points = stream.standard_normal((4096, UNKNOWNS))
    outputs = points @ slope.T + np.sqrt(3.0) * stream.standard_normal((4096, READINGS))
    found = posterior_of(points, outputs, data)
    _, covariance = closed_form(slope, data, 4.0 * np.eye(READINGS))
    scatter = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), scatter, rtol=0.04)
    np.testing.assert_allclose(found.off, np.sqrt(3.0), rtol=0.1)


def test_unknown_bias_is_a_scatter_that_all_readings_of_a_sensor_share():
    slope, stream = slopes(), np.random.default_rng(5)
    data, bias, deviation = 30.0 * stream.standard_normal(READINGS), 1.7, 0.6
    block = deviation**2 * np.eye(10) + bias**2 * np.ones((10, 10))
    noise = np.kron(np.eye(4), block)
    points = stream.standard_normal((500, UNKNOWNS))
    told = sensors(points @ slope.T, data, 4, deviation, bias)
    found = posterior_of(
        points, np.concatenate([t.scaled(t.computed) for t in told], axis=1),
        np.concatenate([t.scaled(t.measured) for t in told]),
    )  # fmt: skip
    mean, covariance = closed_form(slope, data, noise)
    np.testing.assert_allclose(found.mean, mean, rtol=1e-6)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-6, atol=1e-12)


def made(strays=(), shift=0.0, seed=6):
    """A test of four sensors: readings with strays, and a shift of the last sensor."""
    slope, stream = slopes(), np.random.default_rng(seed)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(READINGS)
    data[-10:] += shift
    for place, size in strays:
        data[place] += size
    return slope, data


def run(slope, data, count=4):
    return staged(lambda u: u @ slope.T, lambda y: sensors(y, data, count), UNKNOWNS, 200)


def test_strays_are_set_aside_and_what_is_left_is_what_is_without_them():
    slope, clean = made()
    _, data = made([(2, 60.0), (15, -25.0), (33, 12.0)])
    found = run(slope, data, 2)
    assert [fit.strays for fit in found.fits] == [[2, 15], [13]]
    kept = np.setdiff1d(np.arange(READINGS), [2, 15, 33])
    mean, covariance = closed_form(slope[kept], clean[kept], np.eye(len(kept)))
    sizes = [size for fit in found.fits for size in fit.stray_sizes]
    np.testing.assert_allclose(sizes, (data - slope @ mean)[[2, 15, 33]], atol=1e-8)
    np.testing.assert_allclose(found.posterior.mean, mean, atol=1e-8)
    np.testing.assert_allclose(found.posterior.covariance, covariance, atol=1e-8)
    assert not told_wrong(found)


def told_wrong(found: Learnt) -> bool:
    return not explained([fit.chance for fit in found.fits], [*found.chances.values()])


def test_sensor_that_is_off_as_a_whole_has_no_strays_and_is_not_explained():
    slope, data = made(shift=12.0)
    found = run(slope, data)
    assert not any(fit.strays for fit in found.fits)
    assert told_wrong(found)
    assert min(found.fits, key=lambda fit: fit.chance).sensor == "s3"


def test_tests_without_faults_are_explained_and_keep_their_readings():
    told = [run(*made(seed=seed)) for seed in range(100, 200)]
    assert sum(map(told_wrong, told)) <= 2  # at 1e-3 each of two kinds
    assert sum(len(fit.strays) for found in told for fit in found.fits) <= 5  # expected: 1


def test_two_strays_of_a_short_sensor_are_set_aside_and_three_in_a_row_are_not():
    """Ten readings a sensor; three in a row are what a model lacks, and it is blamed."""
    apart = run(*made([(3, 40.0), (7, -9.0)]))
    assert [fit.strays for fit in apart.fits] == [[3, 7], [], [], []]
    assert not told_wrong(apart)
    third = run(*made([(3, 40.0), (5, 30.0), (7, -30.0)]), 4)  # more than a quarter
    row = run(*made([(23, 30.0), (24, 30.0), (25, 30.0)]), 2)  # 3 of 20
    for wrong, sensor in ((third, 0), (row, 1)):
        assert not wrong.fits[sensor].strays
        assert told_wrong(wrong)
    every = run(*made([(k, 30.0) for k in (1, 12, 23, 34, 38)]), 4)  # an eighth of all readings
    assert not any(fit.strays for fit in every.fits)
    assert told_wrong(every)


@pytest.mark.parametrize("count", [1, 2, 50])
def test_readings_that_are_all_far_off_are_kept_and_not_explained(count):
    """Nothing that moves the unknown gives any of them: each is off by 100 sigma and more."""
    stream = np.random.default_rng(3)
    points = stream.standard_normal((100, 1))
    data = 100.0 * (-1.0) ** np.arange(count) * (1.0 + stream.random(count))
    slope = 1e-3 * np.ones((count, 1))
    found = learn(points, [Told("s", points @ slope.T, data, 1.0)])
    [fit] = found.fits
    assert (fit.readings, fit.strays) == (count, [])
    assert fit.rms == pytest.approx(np.sqrt(np.mean(data**2)), rel=1e-3)
    assert found.held == ["more than a tenth of all readings"]
    assert told_wrong(found)


def leverage_of_the_first(seed, size=0.0):
    """Two sensors; the first reading of the second one alone tells the last unknown."""
    slope, stream = slopes(seed), np.random.default_rng([seed, 31])
    slope[:, -1] *= 0.05
    slope[20, -1] = 1.5
    truth = stream.standard_normal(UNKNOWNS)
    data = slope @ truth + stream.standard_normal(READINGS)
    data[20] += size
    return slope, data, truth


def test_a_stray_that_the_posterior_follows_is_found_by_what_is_left_of_its_scatter():
    held, found = [], 0
    for seed in range(60):
        slope, data, truth = leverage_of_the_first(seed, 15.0 * (-1) ** seed)
        one = run(slope, data, 2)
        found += [fit.strays for fit in one.fits] == [[], [0]]
        assert not told_wrong(one)
        scatter = np.sqrt(np.diag(one.posterior.covariance))
        held += (np.abs(truth - one.posterior.mean) < 1.645 * scatter).tolist()
    assert found >= 55
    assert 0.85 < np.mean(held) < 0.95
    sound = [run(*leverage_of_the_first(seed)[:2], 2) for seed in range(60)]
    assert sum(len(fit.strays) for one in sound for fit in one.fits) <= 4  # expected: 0.6


def test_readings_that_were_only_far_off_beside_a_stray_are_put_back():
    """In 200 tests with three strays each none of the others stays aside but by chance."""
    others = 0
    for seed in range(200):
        stream = np.random.default_rng([seed, 41])
        slope, data = made(seed=seed)
        wrong = stream.choice(READINGS, 3, replace=False)
        data[wrong] += stream.choice([-1, 1], 3) * stream.uniform(10, 60, 3)
        aside = [k + 20 * n for n, fit in enumerate(run(slope, data, 2).fits) for k in fit.strays]
        others += len({*aside} - {*wrong.tolist()})
    assert others <= 8  # expected: 2


def test_sensors_that_are_off_at_one_time_are_no_strays_and_told():
    """Six of eight sensors; at times of their own the same readings are strays."""
    slope, stream = slopes(readings=160), np.random.default_rng(9)
    clean = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(160)
    times = np.arange(20) * 0.5
    for moments, event in (([7] * 6, True), ([1, 4, 7, 10, 13, 16], False)):
        data = clean.copy()
        for sensor, moment in enumerate(moments):
            data[20 * sensor + moment] += 9.0
        told = lambda y, d=data: [  # noqa: E731
            each._replace(times=times) for each in sensors(y, d, 8)
        ]
        found = staged(lambda u: u @ slope.T, told, UNKNOWNS, 200)
        assert told_wrong(found) == event
        assert found.held == (["6 sensors together at 3.5 by the clock"] if event else [])
        assert sum(len(fit.strays) for fit in found.fits) == (0 if event else 6)


def test_a_glitch_of_all_sensors_hides_no_stray_and_is_told_once():
    slope, stream = slopes(readings=160), np.random.default_rng(9)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(160)
    data[7::20] += 12.0
    data[63] += 500.0  # of the fourth sensor
    told = lambda y: [  # noqa: E731
        each._replace(times=np.arange(20) * 0.5) for each in sensors(y, data, 8)
    ]
    found = staged(lambda u: u @ slope.T, told, UNKNOWNS, 200)
    assert [fit.strays for fit in found.fits] == [[], [], [], [3], [], [], [], []]
    assert found.held == ["8 sensors together at 3.5 by the clock"]
    assert told_wrong(found)


@pytest.mark.parametrize("others", [10, 300])
def test_the_only_reading_of_a_sensor_may_be_a_stray(others):
    """As a lock time beside encoders."""
    stream = np.random.default_rng(14)
    slope = slopes(readings=13 * others + 1)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(len(slope))
    data[-1] += 60.0

    def told(y):
        return [*sensors(y[:, :-1], data[:-1], 13), Told("lock", y[:, -1:], data[-1:], 1.0)]

    found = staged(lambda u: u @ slope.T, told, UNKNOWNS, 200)
    assert [fit.strays for fit in found.fits] == [[]] * 13 + [[0]]


def test_a_dead_sensor_is_named_and_voids_no_stray_of_others():
    slope, stream = slopes(readings=700), np.random.default_rng(15)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(700)
    data[:50] += 200.0
    data[120] += 300.0  # of the third sensor
    found = staged(lambda u: u @ slope.T, lambda y: sensors(y, data, 14), UNKNOWNS, 200)
    assert found.fits[2].strays == [20]
    assert told_wrong(found)
    (why,) = found.held
    assert re.fullmatch(r"\d+ readings of s0, far more than of others", why)


def test_a_single_reading_with_a_wide_bias_is_judged_by_it():
    """15 off where its bias has 10: one and a half times what scatters there."""
    slope, stream = slopes(), np.random.default_rng(16)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(READINGS)
    points = stream.standard_normal((200, UNKNOWNS))
    outputs = points @ slope.T
    alone = Told("one", outputs[:, -1:], data[-1:] + 15.0, 1.0, 10.0)
    found = learn(points, [*sensors(outputs[:, :-10], data[:-10], 3), alone])
    assert not found.fits[-1].strays


def test_rows_that_chance_makes_in_long_sensors_are_strays():
    """3 % of 4,000 readings: three in a row somewhere are to be expected."""
    stream = np.random.default_rng(12)
    slope = slopes(readings=4000)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(4000)
    wrong = stream.random(4000) < 0.03
    wrong[1000:1003] = True
    data[wrong] += stream.choice([-1, 1], wrong.sum()) * stream.uniform(10, 60, wrong.sum())
    found = run(slope, data, 4)
    assert not told_wrong(found)
    assert sum(len(fit.strays) for fit in found.fits) == pytest.approx(wrong.sum(), abs=3)


def test_strays_of_a_sensor_with_a_bias_are_so_far_off_as_they_are_beside_it():
    slope, data = made()
    data[20:] += 6.0  # the bias of the second sensor
    data[[25, 33]] += 40.0, -40.0
    told = lambda y: sensors(y, data, 2, 1.0, 8.0)  # noqa: E731
    found = staged(lambda u: u @ slope.T, told, UNKNOWNS, 200)
    (second,) = found.fits[1:]
    assert second.strays == [5, 13]
    np.testing.assert_allclose(second.stray_sizes, [40.0, -40.0], atol=4.0)


@pytest.mark.parametrize("share", [0.01, 0.03])
def test_intervals_hold_although_readings_are_grossly_wrong(share):
    held, told, set_aside, gross = [], 0, 0, 0
    for seed in range(60):
        stream = np.random.default_rng([seed, 21])
        slope, truth = slopes(seed, readings=240), stream.standard_normal(UNKNOWNS)
        data = slope @ truth + stream.standard_normal(240)
        wrong = stream.random(240) < share
        data[wrong] += stream.choice([-1, 1], wrong.sum()) * stream.uniform(8, 60, wrong.sum())
        found = run(slope, data, 12)
        scatter = np.sqrt(np.diag(found.posterior.covariance))
        held += (np.abs(truth - found.posterior.mean) < 1.645 * scatter).tolist()
        told += told_wrong(found)
        set_aside += sum(len(fit.strays) for fit in found.fits)
        gross += wrong.sum()
    assert 0.85 <= np.mean(held) <= 0.95  # 300 of them: 0.9 with a standard error of 0.017
    assert told <= 2
    assert 0.97 * gross <= set_aside <= gross + 3


def test_misfit_below_the_scatter_shows_by_its_pattern():
    """A slow wave of 0.6 sigma rms in 400 readings: no sensor's rms is unusual, neighbours are."""
    slope = slopes(readings=400)
    stream = np.random.default_rng(8)
    data = slope @ stream.standard_normal(UNKNOWNS) + stream.standard_normal(400)
    wave = 0.8 * np.sin(np.linspace(0.0, 40.0, 400))
    wrong = staged(lambda u: u @ slope.T, lambda y: sensors(y, data + wave), UNKNOWNS, 200)
    sound = staged(lambda u: u @ slope.T, lambda y: sensors(y, data), UNKNOWNS, 200)
    assert told_wrong(wrong)
    assert not told_wrong(sound)
    assert wrong.chances["pattern"] < 1e-4 < sound.chances["pattern"]
    assert 4 * min(fit.chance for fit in wrong.fits) > UNEXPLAINED


def places(seed, bad=0.0, common=0.0, count=12, readings=60, prior=None):
    """A test of ``count`` places of one input, of which the fourth is off, or all are."""
    stream = np.random.default_rng(seed)
    slope = stream.standard_normal((readings, count))
    prior = np.eye(count) if prior is None else prior
    lower = np.linalg.cholesky(prior)
    truth = lower @ stream.standard_normal(count) + common
    truth[3] = bad or truth[3]
    data = slope @ truth + stream.standard_normal(readings)
    points = stream.standard_normal((100, count))
    found = posterior_of(points, points @ lower.T @ slope.T, data)
    return contrasts(lower @ found.mean, lower @ found.covariance @ lower.T, prior)


def test_contrast_is_normal_if_all_is_as_the_priors_say():
    half = 0.5 * np.eye(12) + 0.5
    for prior in (None, half):
        every = [places(seed, prior=prior) for seed in range(300)]
        assert np.std([each.sigma for each in every]) == pytest.approx(1.0, abs=0.04)
        assert sum(any(each.group) for each in every) <= 9  # 3 expected at most; 10: 0.001
        assert sum((each.chance < 10 * FALSE_ALARM).any() for each in every) >= 12  # of 30


def test_bad_place_stands_out_alone_also_if_all_places_have_moved():
    for common in (0.0, 4.0):
        found = [places(seed, bad=common + 8.0, common=common) for seed in range(30)]
        assert sum(each.group == [0, 0, 0, 1, *[0] * 8] for each in found) >= 28
    moved = [places(seed, common=4.0) for seed in range(100)]
    assert sum(any(each.group) for each in moved) <= 5


def test_places_that_the_data_cannot_tell_apart_are_named_together():
    """Two readings tell two directions of twelve places: the bad one is among those named."""
    found = [places(seed, bad=9.0, readings=2) for seed in range(60)]
    told = [each.group for each in found if any(each.group)]
    assert len(told) > 20
    assert sum(group[3] > 0 for group in told) >= 0.8 * len(told)
    assert np.mean([sum(g > 0 for g in group) for group in told]) > 1.5


def test_second_bad_place_is_a_fault_of_its_own():
    stream = np.random.default_rng(5)
    slope, truth = stream.standard_normal((60, 12)), stream.standard_normal(12)
    truth[[2, 7]] = 9.0, -9.0
    points = stream.standard_normal((100, 12))
    data = slope @ truth + stream.standard_normal(60)
    found = posterior_of(points, points @ slope.T, data)
    group = contrasts(found.mean, found.covariance, np.eye(12)).group
    assert sorted((group[2], group[7])) == [1, 2]
    assert sum(g > 0 for g in group) == 2


@pytest.mark.parametrize(("unknowns", "runs"), [(6, 14), (22, 46), (34, 80)])
def test_fewest_runs_learn_what_many_do(unknowns, runs):
    """A linear model: no direction that the sensors tell is left out."""
    slope, stream = 3.0 * slopes(11, unknowns, 200), np.random.default_rng(12)
    data = slope @ stream.standard_normal(unknowns) + stream.standard_normal(200)
    points = stream.standard_normal((runs, unknowns))
    found = posterior_of(points, points @ slope.T, data)
    mean, covariance = closed_form(slope, data, np.eye(200))
    np.testing.assert_allclose(found.mean, mean, atol=1e-8)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-8)


def test_pattern_has_its_false_alarms_with_few_readings_too():
    stream = np.random.default_rng(13)
    for count in (5, 10, 30, 300):
        slope = stream.standard_normal((count, 1)) * 1e-6
        points = stream.standard_normal((10, 1))
        alarms = 0
        for _ in range(2000):
            data = stream.standard_normal(count)
            found = learn(points, [Told("s", points @ slope.T, data, 1.0)])
            alarms += found.chances["pattern"] < 0.01
        assert alarms <= 35  # 20 expected at most; 36: 0.0006


def test_sensors_come_in_the_order_of_what_they_leave():
    """Against every pair and every single one by the closed form."""
    slope, count = 4.0 * slopes(9, unknowns=3, readings=60), 6
    points = 0.01 * np.random.default_rng(10).standard_normal((400, 3)) + 0.5  # a late stage
    found = rank(points, sensors(points @ slope.T, np.zeros(60), count), np.eye(3))

    def left(chosen):
        own = np.concatenate([np.arange(10 * k, 10 * k + 10) for k in chosen])
        return np.sqrt(np.diag(closed_form(slope[own], np.zeros(len(own)), np.eye(len(own)))[1]))

    alone = np.array([left([k]) for k in range(count)])
    np.testing.assert_allclose(found.alone, alone, rtol=1e-6)
    assert found.order[0] == np.log(alone).sum(axis=1).argmin()
    second = {k: np.log(left([found.order[0], k])).sum() for k in found.order[1:]}
    assert found.order[1] == min(second, key=second.get)
    for k in range(count):
        np.testing.assert_allclose(found.after[k], left(found.order[: k + 1]), rtol=1e-6)


def test_sensors_of_correlated_unknowns_leave_what_the_closed_form_says():
    """In terms of u with the prior R: (R^-1 + A' A)^-1, of each sensor and of all."""
    slope, count = 3.0 * slopes(9, unknowns=3, readings=60), 6
    prior = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.3], [0.0, 0.3, 1.0]])
    lower = np.linalg.cholesky(prior)
    points = np.random.default_rng(10).standard_normal((400, 3))
    found = rank(points, sensors(points @ lower.T @ slope.T, np.zeros(60), count), lower)

    def left(chosen):
        own = np.concatenate([np.arange(10 * k, 10 * k + 10) for k in chosen])
        return np.sqrt(np.diag(np.linalg.inv(np.linalg.inv(prior) + slope[own].T @ slope[own])))

    alone = np.array([left([k]) for k in range(count)])
    np.testing.assert_allclose(found.alone, alone, rtol=1e-6)
    assert found.order[0] == np.log(alone).sum(axis=1).argmin()
    np.testing.assert_allclose(found.after[-1], left(range(count)), rtol=1e-6)


def test_sensors_that_seem_to_take_knowledge_away_are_named():
    left = np.array([[0.5, 0.4], [0.3, 0.4], [0.4, 0.4]])
    plan = xr.Dataset(
        {"learnt": (("sensor", "unknown"), left), "alone": (("sensor", "unknown"), left)},
        {"sensor": ["a", "b", "c"], "unknown": ["p", "q"]},
    )
    (told,) = (note for note in sensors_table(plan).notes if "too few runs" in note)
    assert told.endswith("as no sensor can: c: raise runs")
    assert not any("too few" in note for note in sensors_table(plan.isel(sensor=[0, 1])).notes)
