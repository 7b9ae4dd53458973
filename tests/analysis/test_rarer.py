"""What would make violations rarer, against probabilities in closed form and new campaigns."""

from __future__ import annotations

import json
import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binom, norm

from made import campaign
from ringsim.analysis.design import placement
from ringsim.analysis.requirements import Requirement
from ringsim.analysis.reweighting import read_distributions
from ringsim.analysis.sensitivity import rarer, ratio_of
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import LatinHypercube, RandomDesign, Sobol
from ringsim.variables import Fate, Status

PLACES = 6
NORMAL = {"kind": "normal", "mean": 3.0, "standard_deviation": 0.5}
SUM = {
    "force": NORMAL,
    "friction": {"kind": "normal", "mean": 0.2, "standard_deviation": 0.05, "each_section": True},
    "idle": {"kind": "normal", "mean": -1.0, "standard_deviation": 2.0},
}
SLOPES = {"force": 2.0, "friction": 8.0, "idle": 0.0}
"""Of a sum of normal inputs, that of ``friction`` in each of its places."""
PRODUCT = {
    "one": {"kind": "lognormal", "mean": 2.0, "standard_deviation": 0.8},
    "two": {"kind": "lognormal", "mean": 5.0, "standard_deviation": 1.0},
}


def points(design, seed, axes):
    if design.independent:  # the design's own points are a stream a sample, and take long
        return np.random.default_rng(seed).random((design.samples, axes))
    return design.points(dict.fromkeys(map(str, range(axes))), seed)


def made(design, seed, laws, output, **more):
    """A campaign of inputs with these distributions; ``output`` takes their values by name."""
    wide = {name: PLACES if law.get("each_section") else 1 for name, law in laws.items()}
    ends = [0, *np.cumsum([*wide.values()])]
    unit, x = points(design, seed, ends[-1]), {}
    for (name, law), (low, high) in zip(laws.items(), pairwise(ends), strict=True):
        values = read_distributions({name: law})[name].quantile(unit[:, low:high])
        x[name] = values if wide[name] > 1 else values[:, 0]
    found = campaign(output(x), design=json.loads(design.model_dump_json()), **more)
    for name, values in x.items():
        says = {"role": "input", "path": name, "distribution": json.dumps(laws[name])}
        values = values.astype(object) if values.dtype.kind == "U" else values
        found[name] = ("sample", "section")[: values.ndim], values, says
    return found


def of_sum(x):
    return SLOPES["force"] * x["force"] + SLOPES["friction"] * x["friction"].sum(axis=1)


def of_product(x):
    return x["one"] * x["two"]


def exact_sum(laws, limit):
    """Probability that the sum is beyond a limit."""
    count = {"force": 1, "friction": PLACES, "idle": 1}
    mean = sum(SLOPES[n] * count[n] * laws[n]["mean"] for n in laws)
    scatter = sum((SLOPES[n] * laws[n]["standard_deviation"]) ** 2 * count[n] for n in laws)
    return norm.sf(limit, mean, scatter**0.5)


def exact_product(laws, limit):
    squares = [np.log1p((v["standard_deviation"] / v["mean"]) ** 2) for v in laws.values()]
    means = [np.log(v["mean"]) - s / 2 for v, s in zip(laws.values(), squares, strict=True)]
    return norm.sf(np.log(limit), sum(means), sum(squares) ** 0.5)


CASES = {
    "sum": (SUM, of_sum, exact_sum, 17.8),
    "product": (PRODUCT, of_product, exact_product, 18.0),
}


def limited(limit):
    return {"asynchrony_max": Requirement(max=limit, probability=0.9, confidence=0.9)}


def exact_ratios(case, step):
    """By input, parameter and side the factor of the probability in closed form."""
    laws, _, exact, limit = CASES[case]
    found, drawn = {}, exact(laws, limit)
    for name, law in laws.items():
        far = step * law["standard_deviation"]
        for key, by in ("standard_deviation", -far), ("mean", -far), ("mean", far):
            other = laws | {name: law | {key: law[key] + by}}
            found[name, key, np.sign(by)] = exact(other, limit) / drawn
    return drawn, found


def analysed(case, design, seed, step=0.1):
    laws, output, _, limit = CASES[case]
    one = made(design, seed, laws, output)
    return one, rarer(one, limited(limit), placement(one), step)


@pytest.mark.quick
def test_the_slope_is_that_of_the_closed_form():
    """dP / d mean and dP / d standard deviation by a small step, without bias."""
    for case in CASES:
        (drawn, exact), small, rows = exact_ratios(case, 1e-4), 1e-4, []
        for seed in range(60):
            one, found = analysed(case, RandomDesign(samples=600), seed, small)
            share = float((one.asynchrony_max > CASES[case][3]).mean())
            rows.append(share * (found.change_ratio.values[0] - 1.0) / small)
        truth = drawn * (np.array([*exact.values()]) - 1.0) / small
        error = np.std(rows, axis=0, ddof=1) / len(rows) ** 0.5
        assert (np.abs(np.mean(rows, axis=0) - truth) < 4 * error).all()
        assert (error < 0.1 * np.abs(truth).max()).all()


DESIGNS = {
    "random": RandomDesign(samples=500), "few": RandomDesign(samples=300),
    "latin-hypercube": LatinHypercube(samples=504, replicates=8),
    "sobol": Sobol(samples=512, replicates=16),
}  # fmt: skip


@pytest.mark.parametrize("campaigns", [50, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("kind", DESIGNS)
def test_intervals_cover(kind, case, campaigns):
    """Means and standard deviations of inputs by themselves and of all sections of one at once."""
    truth = np.array([*exact_ratios(case, 0.1)[1].values()])
    hits, known = np.zeros(len(truth)), np.zeros(len(truth))
    for seed in range(campaigns):
        found = analysed(case, DESIGNS[kind], seed)[1]
        ends = found.change_ratio_interval.values[0]
        known += np.isfinite(ends).all(axis=1)
        hits += (ends[:, 0] <= truth) & (truth <= ends[:, 1])
    assert (known > 0.8 * campaigns).all()
    least, most = (0.92, 0.98) if campaigns >= 1000 else (0.91, 0.99)
    assert (binom.ppf(1e-4, known, least) <= hits).all(), hits / known
    if kind != "sobol":  # their error is no smaller than that of independent samples
        assert (hits <= binom.ppf(1 - 1e-4, known, most)).all(), hits / known


@pytest.mark.parametrize("campaigns", [40, pytest.param(600, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["random", "few", "latin-hypercube"])
def test_inputs_that_do_not_matter_are_listed_as_rarely_as_told(kind, campaigns):
    laws = {f"x{k}": law for k, law in enumerate([NORMAL, PRODUCT["one"]] * 6)}
    laws["word"] = {"kind": "discrete", "values": ["a", "b"], "probabilities": [0.2, 0.8]}
    laws["flat"] = {"kind": "uniform", "low": 0.0, "high": 1.0}
    laws["friction"], listed = SUM["friction"], 0
    for seed in range(campaigns):
        noise = np.random.default_rng([seed, 1]).random(DESIGNS[kind].samples)
        one = made(DESIGNS[kind], seed, laws, lambda _, y=noise: y)
        listed += bool(rarer(one, limited(0.9), placement(one)).change_listed.any())
    assert listed <= binom.ppf(1 - 1e-4, campaigns, 0.05)


def test_a_mean_between_two_limits_is_not_listed():
    """Violations on both sides: the scatter among them is larger than that of all samples."""
    laws, listed = {"x": NORMAL}, np.zeros(3)
    for seed in range(60):
        one = made(RandomDesign(samples=300), seed, laws, lambda x: np.abs(x["x"] - 3.0))
        listed += rarer(one, limited(0.8), placement(one)).change_listed.values[0]
    assert listed[0] == 60  # the standard deviation is, in every campaign
    assert (listed[1:] <= binom.ppf(1 - 1e-4, 60, 0.05)).all()


def test_another_campaign_with_the_other_distribution_says_the_same():
    """Bounded, truncated and discrete inputs, and a bent output, by drawing anew."""
    laws = {
        "x": {"kind": "truncated", "low": -1.0, "of": NORMAL | {"mean": 0.0}},
        "flat": {"kind": "uniform", "low": 0.0, "high": 1.0},
        "word": {"kind": "discrete", "values": ["a", "b", "c"], "probabilities": [0.2, 0.3, 0.5]},
    }

    def output(x):
        return np.exp(2 * x["x"]) + 4 * x["flat"] ** 2 * (1 + (x["word"] == "a"))

    many = RandomDesign(samples=200_000)
    one = made(many, 1, laws, output)
    found, share = rarer(one, limited(6.0), placement(one)), float((one.asynchrony_max > 6).mean())
    of = found.change_of.values.tolist()
    assert of[:2] == ["standard deviation before the bounds", "mean before the bounds"]
    assert of[3:] == ["range", *(f"probability of {word}" for word in "abc")]
    others = [
        laws | {"x": laws["x"] | {"of": NORMAL | {"mean": 0.0, "standard_deviation": 0.45}}},
        laws | {"x": laws["x"] | {"of": NORMAL | {"mean": -0.05}}},
        laws | {"x": laws["x"] | {"of": NORMAL | {"mean": 0.05}}},
        laws | {"flat": {"kind": "uniform", "low": 0.05, "high": 0.95}},
        *(
            laws | {"word": laws["word"] | {"probabilities": p}}
            for p in ([0.18, 0.3075, 0.5125], [0.73 / 3.5, 0.27, 1.825 / 3.5], [0.22, 0.33, 0.45])
        ),
    ]
    for other, ratio, ends in zip(
        others, found.change_ratio.values[0], found.change_ratio_interval.values[0], strict=True
    ):
        drawn = float((made(many, 1, other, output).asynchrony_max > 6).mean()) / share
        assert ratio == pytest.approx(drawn, abs=0.006)
        assert ends[0] <= ratio <= ends[1]


def test_the_table_tells_it_as_reweighting_does():
    one = made(RandomDesign(samples=500), 1, SUM, of_sum)
    found = analyse(one, limited(17.8), {"force": NORMAL | {"standard_deviation": 0.45}})
    event = found.reweighted_share.sel(event="asynchrony_max <= 17.8 deg").item()
    cells = [re.split(r" {2,}", line.strip()) for line in told(found)]
    rows = [each[-6:] for each in cells if len(each) > 5 and "-> " in each[-4]][1:]
    changed = {tuple(row[:2]): row[2:] for row in rows}
    before, after = float((one.asynchrony_max > 17.8).mean()), 1.0 - event
    values, chance, change, ends = changed["force", "standard deviation"]
    assert (values, chance) == ("0.5 -> 0.45", f"{before:.3g} -> {after:.3g}")
    assert change == f"{100 * (after / before - 1):+.2g} %"
    low, high = (float(end) for end in ends.removesuffix(" %").split(" .. "))
    assert low < 100 * (after / before - 1) < high < 0
    assert changed["force", "mean"][0] == "3 -> 2.95"
    assert changed["friction", f"mean at all {PLACES} sections"][0] == "0.2 -> 0.195"
    assert not any("idle" in each for each in changed)
    sizes = [abs(float(row[4].removesuffix(" %"))) for row in rows]
    assert sizes == sorted(sizes, reverse=True)


def test_what_is_not_told_and_why():
    laws = SUM | {
        "flat": {"kind": "uniform", "low": 0.0, "high": 1.0},
        "learnt": {"kind": "calibrated", "of": NORMAL, "shift": 0.1, "remaining_scatter": 0.5},
        "pair": NORMAL,
    }
    one = made(RandomDesign(samples=500), 1, laws, of_sum)
    one.attrs["campaign"] = '[[correlations]]\nbetween = ["idle", "pair"]\ncoefficient = 0.5\n'
    for name, path, law in (
        ("listed", "listed", "listed in a file"),
        ("solver_error_bars", "solver.error_bars", "one sample in 10"),
    ):
        one[name] = "sample", np.arange(500.0), {"role": "input", "path": path, "distribution": law}
    law = '{"kind": "function", "input": "force", "table": [[0, 0], [9, 1]]}'
    says = {"role": "input", "path": "torque", "input": "force", "distribution": law}
    one["torque"] = "sample", one["force"].values, says
    found = analyse(one, limited(17.8))
    assert set(found.change_input.values) == {"force", "friction", "flat"}
    note = next(line for line in told(found) if line.startswith("changes that were not"))
    assert note == (
        "changes that were not tried: idle, pair (correlated with another input); flat (means of "
        "uniform inputs: no samples beyond bounds); learnt (without a mean and a standard "
        "deviation of its own); listed (listed in a file)"
    )
    # All bounds, and a limit that hardly any sample violates.
    few = analyse(one, limited(np.sort(one.asynchrony_max)[-8] + 1e-9))
    assert np.isnan(few.change_ratio).all()
    assert any("asynchrony_max (7 of 500 violate it)" in line for line in told(few))
    quiet = made(RandomDesign(samples=500), 1, {"force": NORMAL}, lambda x: x["force"] * 0 + noise)
    assert any("of violating asynchrony_max" in line for line in told(analyse(quiet, limited(0.9))))


noise = np.random.default_rng(7).random(500)


def test_failed_runs_and_others_that_have_not_run_do_not_count():
    status = np.full(600, Status.OK)
    status[::7], status[500:] = Status.DIVERGED, -1
    fate = np.where(status == Status.OK, Fate.DEPLOYED, Fate.NONE)
    one = made(RandomDesign(samples=600), 1, SUM, of_sum, status=status, outcome=fate)
    rest = one.isel(sample=np.flatnonzero(status == Status.OK))
    found, same = (rarer(each, limited(17.8), placement(each)) for each in (one, rest))
    np.testing.assert_array_equal(found.change_ratio_interval, same.change_ratio_interval)
    assert np.isfinite(found.change_ratio).all()


def test_a_cut_that_removes_all_violations_is_the_first_to_be_told():
    """Of a uniform input only the ends are bad: 10 % less of its range leaves none of them."""
    laws = {"u": {"kind": "uniform", "low": 0.0, "high": 1.0}}
    one = made(RandomDesign(samples=1000), 3, laws, lambda x: np.abs(x["u"] - 0.5))
    found = analyse(one, limited(0.462))
    assert found.change_ratio.values.ravel() == pytest.approx([0.0])
    assert found.change_ratio_interval.values.ravel()[1] < 0.2
    assert found.change_listed.values.ravel().tolist() == [1]
    assert any("-100 %" in line for line in told(found))


def test_what_few_samples_would_decide_is_not_called_insignificant():
    """Narrower normal inputs at 400 places give nearly all weight to few samples."""
    laws = {"friction": NORMAL | {"each_section": True}}
    rng = np.random.default_rng(5)
    x = 3.0 + 0.5 * rng.standard_normal((300, 400))
    one = campaign(x.sum(axis=1), design=json.loads(RandomDesign(samples=300).model_dump_json()))
    says = {"role": "input", "path": "friction", "distribution": json.dumps(laws["friction"])}
    one["friction"] = ("sample", "section"), x, says
    most = float(np.quantile(x.sum(axis=1), 0.9))
    lines = told(analyse(one, limited(most)))
    assert any("few would have most of the weight: asynchrony_max" in one for one in lines)


def test_designs_that_cannot_tell():
    few = made(Sobol(samples=512, replicates=8), 1, SUM, of_sum)
    assert any("needs design.replicates = 16" in line for line in told(analyse(few, limited(17.8))))
    plain = made(LatinHypercube(samples=512), 1, SUM, of_sum)
    lines = told(analyse(plain, limited(17.8)))
    assert any("needs design.replicates = 8" in line for line in lines)
    assert not any("no significant change, by" in line for line in lines)
    morris = made(RandomDesign(samples=80), 1, SUM, of_sum)
    morris.attrs["design"] = Morris(samples=8).model_dump_json()
    assert "change_ratio" not in analyse(morris, limited(17.8))
    assert "change_ratio" not in analyse(few, {})


def test_blocks_tell_by_the_samples_that_stand_for_the_population():
    design, laws = Saltelli(samples=512, replicates=16), {"a": NORMAL, "b": NORMAL}
    factors = {name: read_distributions({name: law})[name] for name, law in laws.items()}
    unit = design.points(factors, 1)
    x = {name: norm.ppf(unit[:, k]) for k, name in enumerate(laws)}
    one = campaign(x["a"] + x["b"], design=json.loads(design.model_dump_json()))
    law = json.dumps(NORMAL | {"mean": 0.0, "standard_deviation": 1.0})
    for name, values in x.items():
        one[name] = "sample", values, {"role": "input", "path": name, "distribution": law}
    rows = np.array(design.rows(factors, 1))
    one["block_row"] = "sample", rows, {"role": "label"}
    found = analyse(one, limited(2.0))
    exact = norm.sf(2.0 / 1.81**0.5) / norm.sf(2.0 / 2**0.5)
    for low, high in found.change_ratio_interval.values[0][[0, 3]]:
        assert low < exact < high


def test_weights_of_two_values_and_replicates_without_the_event():
    """No violation in the part that is cut off is no proof that none is there."""
    inside, own = np.arange(400) % 10 > 0, np.arange(400) < 12
    own &= inside
    ratio, (ends, wide) = ratio_of(own, inside / 0.9, None, [0.05, 0.001])
    assert ratio == pytest.approx(1 / 0.9)
    assert wide[0] < ends[0] < 0.8
    assert wide[1] == ends[1] == pytest.approx(1 / 0.9)
    weights = np.random.default_rng(1).random(400)
    _, (ends,) = ratio_of(np.arange(400) % 8 == 0, weights, np.arange(400) % 8, [0.05])
    assert np.isnan(ends).all()


def test_the_interval_of_a_drawn_fault_holds_the_truth():
    """All violations have the fault: a tenth less of it makes a tenth less of them, and the share
    of samples that have it is uncertain itself.
    """
    rng, held = np.random.default_rng(1), 0
    weights = np.array([(1.0 - 0.9 * 0.3) / 0.7, 0.9])
    for _ in range(200):
        fault = rng.random(200) < 0.3
        own = fault & (rng.random(200) < 0.5)
        ratio, ((low, high),) = ratio_of(own, weights[fault.astype(int)], None, [0.05])
        assert low - 1e-9 <= ratio <= high + 1e-9
        held += low - 1e-9 <= 0.9 <= high + 1e-9
    assert held >= 190
