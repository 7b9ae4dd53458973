"""What matters: known correlations and separations are found, with intervals that cover them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign
from scipy.special import expit, logit
from scipy.stats import norm, spearmanr

from made import campaign, points
from ringsim.analysis import indices
from ringsim.analysis.design import drawn, inputs
from ringsim.analysis.influence_text import influence_tables
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.variables import Fate, Status

CAMPAIGNS = 1000


def with_inputs(made, **columns):
    for path, values in columns.items():
        says = {"role": "input", "path": path.replace("__", ".")}
        made[path] = (("sample", "pulley")[: np.ndim(values)], values, says)
    return made


def covered(ends, true):
    low, high = np.array(ends)
    return np.mean((low <= true) & (true <= high))


def test_rank_correlations_are_those_of_scipy():
    random = np.random.default_rng(0)
    columns = random.integers(0, 5, (50, 3)).astype(float)
    output = columns @ [1.0, -0.5, 0.0] + random.normal(size=50)
    expected = [spearmanr(column, output).statistic for column in columns.T]
    found = indices.correlations(indices.centred_ranks(columns), output)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_one_input_that_decides_the_ranks_is_told_as_the_cause():
    random = np.random.default_rng(5)
    made = with_inputs(made_campaign(60), a=random.random(60), b=random.random(60))
    made["peak_tension"][:] = 10.0 + made["a"].to_numpy() ** 3
    notes = [note for table in influence_tables(analyse(made)) for note in table.notes]
    (note,) = (each for each in notes if "no partial correlation" in each)
    assert "peak_tension (60 samples used: one input determines the ranks)" in note


def test_a_column_that_is_the_same_in_all_samples_leaves_the_others_their_correlations():
    random = np.random.default_rng(4)
    columns = random.random((40, 3))
    output = columns[:, 0] + 0.5 * columns[:, 1] + random.normal(size=40)
    ranks = indices.centred_ranks(np.insert(columns, 1, 8.0, axis=1))
    found = indices.partial_correlations(ranks, output)
    assert np.isnan(found[1])
    alone = indices.partial_correlations(indices.centred_ranks(columns), output)
    np.testing.assert_allclose(np.delete(found, 1), alone, rtol=1e-12)
    with_odd = np.vstack([[0.9, 0.9, 0.9], columns])  # one sample more, without a value
    odd = np.where(np.arange(41) == 0, 99.0, 8.0)
    values = {"x1": with_odd[:, 0], "x2": odd, "x3": with_odd[:, 1], "x4": with_odd[:, 2]}
    lines = told(analyse(with_inputs(campaign([np.nan, *output]), **values)), full=True)
    (row,) = (line for line in lines if line.startswith("asynchrony_max with x1"))
    assert f"  {found[0]:.2g}  " in row
    assert "x2 is the same in all samples used for asynchrony_max: no correlation with it" in lines


def test_partial_correlations_are_those_of_residuals():
    random = np.random.default_rng(1)
    columns = random.normal(size=(60, 3))
    columns[:, 1] += columns[:, 0]
    output = columns[:, 0] + random.normal(size=60)
    from scipy.stats import rankdata

    x, y = rankdata(columns, axis=0), rankdata(output)
    for k, found in enumerate(indices.partial_correlations(indices.centred_ranks(columns), output)):
        others = np.column_stack([np.ones(60), np.delete(x, k, axis=1)])
        fits = [np.linalg.lstsq(others, each, rcond=None)[0] for each in (x[:, k], y)]
        left = [each - others @ fit for each, fit in zip((x[:, k], y), fits, strict=True)]
        assert found == pytest.approx(np.corrcoef(*left)[0, 1], abs=1e-12)


def test_intervals_of_correlations_cover_normal_pairs():
    """Of a normal pair with correlation r the rank correlation is 6 / pi arcsin(r / 2)."""
    random = np.random.default_rng(2)
    true = 6 / np.pi * np.arcsin(0.6 / 2)
    ends = []
    for _ in range(CAMPAIGNS):
        x, y = random.normal(size=(2, 60))
        found = indices.correlations(indices.centred_ranks(x[:, None]), 0.6 * x + 0.8 * y)
        ends.append(np.ravel(indices.correlation_interval(found, 60)))
    assert 0.92 <= covered(np.transpose(ends), true) <= 0.98


def test_intervals_of_areas_cover_normal_groups():
    random, true = np.random.default_rng(3), norm.cdf(1 / np.sqrt(2))
    inside = np.arange(80) < 15
    columns = random.normal(size=(80, CAMPAIGNS)) + inside[:, None]
    ends = indices.area_interval(indices.areas(columns, inside), 15, 65)
    assert 0.92 <= covered(ends, true) <= 0.98


@pytest.mark.parametrize("kind", ["sobol", pytest.param("latin-hypercube", marks=pytest.mark.slow)])
def test_intervals_from_replicates_cover(kind):
    """Truth from 400,000 independent samples, whose own error is a hundredth of the intervals."""

    def output(drawn):
        return drawn[..., 0] + 0.5 * drawn[..., 1] ** 2 + 0.3 * drawn[..., 2] * drawn[..., 0]

    many = np.random.default_rng(5).random((400_000, 3))
    first = many[:, :1]
    high = output(many) > 1.2
    true = (
        indices.correlations(indices.centred_ranks(first), output(many)),
        indices.areas(first, high),
    )
    which = np.arange(128) % 8
    ends = [[], []]
    for seed in range(300):
        x = points(kind, 128, 8, seed)
        y = output(x)
        of = indices.Columns(x[:, :1])
        correlate = lambda rows: indices.correlations(of.ranks(rows), y[rows])  # noqa: B023, E731
        area = lambda rows: indices.areas(x[rows, :1], y[rows] > 1.2)  # noqa: B023, E731
        ends[0].append(np.ravel(indices.replicate_interval(correlate, which, np.arctanh, np.tanh)))
        ends[1].append(np.ravel(indices.replicate_interval(area, which, logit, expit)))
    for each, value in zip(ends, true, strict=True):
        # 300 campaigns leave a standard error of 1.3 % of the share.
        assert 0.91 <= covered(np.transpose(each), value) <= 0.99


def test_a_perfect_correlation_of_a_few_samples_has_no_interval():
    x = np.arange(10.0)
    found = analyse(with_inputs(campaign(x**3), force=x))
    assert found.asynchrony_max_rank_correlation.item() == pytest.approx(1.0)
    assert np.isnan(found.asynchrony_max_rank_correlation_interval).all()


def test_a_perfect_separation_has_an_interval_below_one():
    found = indices.areas(np.arange(20.0)[:, None], np.arange(20) >= 15)
    assert found.tolist() == [1.0]
    low, high = indices.area_interval(found, 5, 15)
    assert 0.7 < low.item() < 0.95
    assert high.item() == pytest.approx(1.0)


def test_pulleys_matter_by_mean_and_by_place():
    random = np.random.default_rng(6)
    friction, force = random.random((400, 5)), random.random(400)
    made = campaign(friction @ [1, 1, 4, 1, 1] - force + 0.1 * random.normal(size=400))
    made = with_inputs(made, cables__friction=friction, loads__force=force, same=force)
    made = made.assign_coords(pulley_name=("pulley", [f"section {k} V" for k in range(1, 6)]))
    found = analyse(made)
    both = "loads.force and same"  # nothing tells them apart: one column of both names
    assert not {"same", "loads.force"} & set(found.input.values)
    plain, partial = (
        found[f"asynchrony_max_{each}rank_correlation"].to_series() for each in ("", "partial_")
    )
    assert plain.idxmax() == "section 3 V of cables.friction"
    assert plain["mean of cables.friction"] > 0.6
    assert plain[both] < -0.1
    assert (partial.drop([both, "mean of cables.friction"]) > 0.7).all()
    ends = found.asynchrony_max_rank_correlation_interval.sel(input=both).values
    assert ends[0] < plain[both] < ends[1] < 0
    assert any("section 3 V of cables.friction" in line for line in told(found, full=True))


def test_what_is_left_out_is_counted_and_round_off_has_no_inputs():
    """Five forces matter alike: three are listed, two counted.  An output of 1e-17 has none."""
    random = np.random.default_rng(8)
    forces = random.random((300, 5))
    whole = forces.sum(axis=1) + 0.05 * random.normal(size=300)
    made = campaign(whole, prestress_energy=1e-17 * whole)
    made = with_inputs(made, **{f"loads__force{k}": forces[:, k] for k in range(5)})
    lines = told(analyse(made))
    further = [line for line in lines if line.startswith("further significant inputs")]
    assert further == ["further significant inputs, listed with --full: asynchrony_max 2"]
    assert not any(line.split()[:1] == ["prestress_energy"] and "loads" in line for line in lines)


def test_what_separates_failures_stalls_and_violations_is_found():
    random = np.random.default_rng(7)
    force, other = random.random((2, 200))
    status = np.where(force > 0.9, Status.DIVERGED, Status.OK)
    outcome = np.where(status, Fate.NONE, np.where(force < 0.2, Fate.STALLED, Fate.DEPLOYED))
    values = np.where(status == Status.OK, other, np.nan)
    stop = np.where(force < 0.2, "3.0", "none").astype(object)
    made = with_inputs(
        campaign(values, status=status, outcome=outcome), force=force, other=other, stop=stop
    )
    wanted = {"asynchrony_max": {"max": 0.8, "probability": 0.9, "confidence": 0.9}}
    found = analyse(made, wanted)
    areas = found.separation.to_series()
    assert areas["failed runs", "force"] == 1.0
    assert areas["stalled", "force"] == 0.0
    assert areas["stalled", "stop = 3.0"] == 1.0
    assert areas["violates asynchrony_max <= 0.8 deg", "other"] == 1.0
    low, high = found.separation_interval.sel(group="stalled", input="other").values
    assert low < 0.5 < high
    (line,) = (line for line in told(found, full=True) if line.startswith("stalled: force"))
    assert line.split()[2:4] == ["*", "smaller"]  # lost runs go with the force
    assert line.split()[-1] == str((force < 0.2).sum())


def test_designs_without_intervals_tell_correlations_alone():
    x = points("latin-hypercube", 64, 1, 0)[:, 0]
    found = analyse(with_inputs(campaign(x**2, design={"kind": "latin-hypercube"}), force=x))
    assert found.asynchrony_max_rank_correlation.item() == pytest.approx(1.0)
    assert np.isnan(found.asynchrony_max_rank_correlation_interval).all()


def test_inputs_that_were_not_drawn_are_left_out():
    made = with_inputs(campaign(np.arange(20.0)), fixed=np.ones(20))
    made["solver_error_bars"] = (
        "sample", np.arange(20) % 8 == 0, {"role": "input", "path": "solver.error_bars"}
    )  # fmt: skip
    assert "solver_error_bars" not in inputs(made)
    assert not drawn(made).names
    assert "input" not in analyse(made).dims
    assert isinstance(analyse(made), xr.Dataset)


def test_what_the_same_samples_are_is_told_once_and_verdicts_come_last() -> None:
    x = np.random.default_rng(3).random(20)
    stalled = x > 0.6
    outcome = np.where(stalled, Fate.STALLED, Fate.DEPLOYED)
    made = campaign(np.where(stalled, np.nan, 1.0), outcome=outcome)
    made = with_inputs(made, x1=x)
    share = {"probability": 0.5, "confidence": 0.9}
    wanted = {"outcome": {"is": "deployed"} | share, "asynchrony_max": {"max": 2.0} | share}
    found = analyse(made, wanted)
    assert found["group"].values.tolist() == [
        "stalled; violates outcome is deployed; violates asynchrony_max <= 2 deg"
    ]
    assert told(found)[-1].startswith("asynchrony_max: violations without a value")
