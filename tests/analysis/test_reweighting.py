"""Other distributions of inputs without new runs, against exact answers."""

from __future__ import annotations

import json
import re
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner
from loops import for_each
from scipy.stats import norm, truncnorm

from made import UNIT, campaign, drawn_campaign, points
from ringsim.analysis import intervals, reweighting
from ringsim.analysis.reweighting import Cap, Pair, parse_reweighted, read_distributions, weights_of
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.analysis.verdicts import Verdict, verdict_of
from ringsim.cli.results import analyse_command
from ringsim.refusal import InputError
from ringsim.sampling.columns import partners
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import RandomDesign
from ringsim.scene import load_scene
from ringsim.variables import Fate, Status

FEW, MANY = (100, 0.88, 1.0), (1000, 0.92, 0.98)
SOME = [pytest.param(FEW, id="few"), pytest.param(MANY, id="many", marks=pytest.mark.slow)]
NARROW = {"kind": "normal", "mean": 0.5, "standard_deviation": 0.12}
TRUE = norm(0.5, 0.12)


def linear(x):
    return 10.0 * x[..., 0]


def test_a_reweighted_campaign_tells_the_exact_mean_quantiles_and_probabilities():
    made = drawn_campaign(RandomDesign(samples=4000), linear, 2, 1)
    wanted = {"asynchrony_max": {"max": 6.0, "probability": 0.5, "confidence": 0.9}}
    found = analyse(made, wanted, {"x1": NARROW})
    # Of a density ratio f / 1: the effective share is 1 / integral of f^2 = 2 sqrt(pi) s.
    assert found.effective_samples.item() == pytest.approx(4000 * 2 * np.pi**0.5 * 0.12, rel=0.05)
    values, ends = found.asynchrony_max_reweighted, found.asynchrony_max_reweighted_interval
    exact = [5.0, *(10 * TRUE.ppf([0.05, 0.5, 0.95]))]
    np.testing.assert_allclose(values, exact, atol=0.15)
    for (low, high), true in zip(ends.values, exact, strict=True):
        assert low < true < high
    share = found.reweighted_share.sel(event="asynchrony_max <= 6 deg").item()
    assert share == pytest.approx(TRUE.cdf(0.6), abs=0.03)
    assert found.reweighted_share.sel(event="deployed").item() == pytest.approx(1.0)


def test_verdicts_are_those_of_the_other_distribution():
    """As drawn it is 0.6, reweighted 0.7977."""
    made = drawn_campaign(RandomDesign(samples=4000), linear, 2, 1)
    exact = TRUE.cdf(0.6)
    for probability, drawn, other in (
        (0.7, Verdict.NOT_MET, Verdict.MET),
        (0.8, Verdict.NOT_MET, Verdict.NOT_YET_SHOWN),
        (0.9, Verdict.NOT_MET, Verdict.NOT_MET),
    ):
        wanted = {"asynchrony_max": {"max": 6.0, "probability": probability, "confidence": 0.95}}
        found = analyse(made, wanted, {"x1": NARROW})
        assert (found.verdict.item(), found.reweighted_verdict.item()) == (drawn, other)
        low, high = found.reweighted_bounds.values[0]
        assert low < exact < high
        text = "\n".join(told(found))
        assert text.index("requirement, as drawn ") < text.index("requirement, reweighted ")
        words = other.word.replace("_", " ")
        assert re.search(rf"  {words} +{probability:g} +0.95  ", text.splitlines()[-1])
    assert "as drawn " not in "\n".join(told(analyse(made, wanted)))


def test_a_requirement_that_all_samples_break_is_bounded_as_one_that_none_breaks():
    """Exactly, and within the interval of the share, whose confidence is the larger one."""
    made = drawn_campaign(RandomDesign(samples=300), linear, 2, 1)
    ends = {}
    for most in (-1.0, 11.0):
        wanted = {"asynchrony_max": {"max": most, "probability": 0.9, "confidence": 0.9}}
        found = analyse(made, wanted, {"x1": NARROW})
        ends[most] = found.reweighted_bounds.values[0]
        share = found.sel(event=f"asynchrony_max <= {most:g} deg")
        low, high = share.reweighted_share_interval.values
        assert low <= ends[most][0] or most < 0.0
        assert ends[most][1] <= high or most > 0.0
    np.testing.assert_allclose(ends[-1.0], 1.0 - ends[11.0][::-1], rtol=1e-9, atol=1e-12)
    assert ends[-1.0][0] == 0.0


STANDARD = read_distributions({"x": {"kind": "normal", "mean": 0.0, "standard_deviation": 1.0}})[
    "x"
]


def shifted(mean):
    """A standard normal input, reweighted to another mean."""
    return {"x": Pair(STANDARD, STANDARD.model_copy(update={"mean": mean}), 1)}


@pytest.mark.parametrize(
    ("shift", "samples", "true", "required", "met", "not_met"),
    [
        # Violations where hardly a sample is: nothing can be shown.
        (0.6, 300, 0.98, 0.985, (0.0, 0.0), (0.0, 0.1)),
        (0.6, 300, 0.98, 0.975, (0.0, 0.1), (0.0, 0.1)),
        (1.5, 300, 0.98, 0.985, (0.0, 0.0), (0.0, 0.1)),
        (3.0, 50, 0.5, 0.6, (0.0, 0.0), (0.0, 0.1)),
        # Enough samples, and a margin.
        (0.6, 2000, 0.999, 0.98, (0.9, 1.0), (0.0, 0.0)),
        (0.6, 2000, 0.9, 0.95, (0.0, 0.0), (0.9, 1.0)),
        (0.6, 300, 0.9999, 0.95, (0.9, 1.0), (0.0, 0.0)),
    ],
)
def test_verdicts_of_campaigns_with_unbounded_weights_err_on_the_safe_side(
    shift, samples, true, required, met, not_met
):
    """Kish's count of all weights said "met" in 34 of 100 campaigns of the first case."""
    cap, limit, campaigns = Cap(shifted(shift), samples, 0.1), shift + norm.ppf(true), 400
    rng, counts, held = np.random.default_rng(0), np.zeros(2), np.zeros(2)
    for _ in range(campaigns):
        x = rng.standard_normal(samples)
        ends = cap.bounds(x > limit, np.exp(shift * x - shift**2 / 2), None)
        held += ends[0] <= 1 - true, 1 - true <= ends[1]
        verdict = verdict_of(1 - ends[1], 1 - ends[0], required)
        counts += verdict == Verdict.MET, verdict == Verdict.NOT_MET
    assert (held >= 0.9 * campaigns).all()
    for (least, most), share in zip((met, not_met), counts / campaigns, strict=True):
        assert least <= share <= most, counts


def test_a_verdict_of_few_samples_is_not_yet_shown_and_what_they_decide_is_marked():
    """Campaigns whose lower bound lay above the truth while Kish's count was taken."""
    law = {"kind": "normal", "mean": 0.0, "standard_deviation": 1.0}
    limit = {"max": 0.6 + norm.ppf(0.98), "probability": 0.985, "confidence": 0.9}
    for seed in range(8):
        x = np.random.default_rng(seed).standard_normal(300)
        made = campaign(x)
        made["x"] = "sample", x, {"role": "input", "path": "x", "distribution": json.dumps(law)}
        found = analyse(made, {"asynchrony_max": limit}, {"x": law | {"mean": 0.6}})
        assert found.reweighted_verdict.item() == Verdict.NOT_YET_SHOWN
        low, high = found.reweighted_bounds.values[0]
        assert low < 0.98 < high
        assert np.isnan(found.asynchrony_max_reweighted_interval.values[3]).all()
        assert (found.reweighted_share_interval.sel(bound="lower") < 0.98).all()
        assert (found.reweighted_share_interval.sel(bound="upper") > 0.98).all()
        text = [line.split() for line in told(found)]
        marked = [line for line in text if "(few)" in line[:-1]]
        assert ["quantile", "95"] in [line[3:5] for line in marked]
        assert ["deployed", "(few)"] in [line[:2] for line in marked]
        assert ["mean"] not in [line[2:3] for line in marked]
        assert [line for line in text if line[0:1] == ["(few):"]]


def test_a_mean_that_few_samples_decide_is_marked():
    """The cube's mean comes from the tail: its intervals held it in 87 of 100 campaigns."""
    law = {"kind": "normal", "mean": 0.0, "standard_deviation": 1.0}
    x = np.random.default_rng(0).standard_normal(300)
    for power, few in ((1, False), (3, True)):
        made = campaign(x**power)
        made["x"] = "sample", x, {"role": "input", "path": "x", "distribution": json.dumps(law)}
        found = analyse(made, None, {"x": law | {"mean": 0.6}})
        weights = np.exp(0.6 * x)
        apart = np.abs(weights * (x**power - np.average(x**power, weights=weights)))
        decisive = found.asynchrony_max_decisive_samples.sel(reweighted_statistic="mean").item()
        assert decisive == pytest.approx(apart.sum() ** 2 / (apart**2).sum())
        assert (decisive < reweighting.LEAST_OF_MEAN) == few
        lines = [line.split() for line in told(found)]
        (row,) = (
            line for line in lines
            if line[:1] == ["asynchrony_max"] and line[2 + ("(few)" in line)] == "mean"
        )  # fmt: skip
        assert ("(few)" in row) == few


def test_bounds_with_equal_weights_are_hardly_wider_than_those_of_plain_samples():
    alike, own = shifted(0.0), np.arange(100) < 5
    for confidence in (0.5, 0.9, 0.999):
        low, high = Cap(alike, 100, 1 - confidence).bounds(own, np.ones(100), None)
        exact = intervals.share_bounds(5, 100, confidence)
        assert low <= exact[0] <= exact[1] <= high
        assert high - low < 1.6 * (exact[1] - exact[0]) + 0.05
    none = Cap(alike, 100, 0.1).bounds(own & False, np.ones(100), None)
    assert none == (0.0, pytest.approx(1 - 0.1 ** (1 / 100), abs=1e-3))


def test_draws_tell_what_lies_beyond_the_cap():
    """Of weights exp(m x - m^2 / 2) in closed form: those above W are beyond ln(W) / m + m / 2."""
    for mean in (0.6, 1.2):
        cap = Cap(shifted(mean), 300, 0.1)
        place = np.log(cap.weight) / mean + mean / 2
        exact = norm.sf(place - mean) - cap.weight * norm.sf(place)
        assert exact <= cap.beyond <= 1.2 * exact + 5e-4
    old = read_distributions({"word": {"kind": "discrete", "values": ["a", "b"]}})["word"]
    new = old.model_copy(update={"probabilities": (0.9, 0.1)})
    two = Cap({"word": Pair(old, new, 2)}, 300, 0.1)
    assert two.weight == pytest.approx(1.8**2)  # both places "a"


def test_a_law_within_a_law_is_named():
    made = drawn_campaign(RandomDesign(samples=400), linear, 2, 1)
    inner = {"kind": "normal", "mean": 0.5, "standard_deviation": 0.2}
    law = {"kind": "truncated", "low": 0.1, "high": 0.9, "of": inner}
    lines = told(analyse(made, {}, {"x1": law}), full=False)
    words = "reweighted to x1 truncated, of (normal, mean 0.5, standard deviation 0.2), low 0.1"
    assert any(line.startswith(words) for line in lines)


def test_an_input_that_is_not_reweighted_keeps_its_distribution():
    made = drawn_campaign(RandomDesign(samples=4000), lambda x: x[:, 0] + x[:, 1], 2, 1)
    found = analyse(made, None, {"x2": {"kind": "uniform", "low": 0.0, "high": 0.5}})
    mean = found.asynchrony_max_reweighted.sel(reweighted_statistic="mean").item()
    assert mean == pytest.approx(0.75, abs=0.03)
    # Half of the samples have no weight.
    assert found.effective_samples.item() == pytest.approx(2000, rel=0.05)


@pytest.mark.parametrize("case", SOME)
@pytest.mark.parametrize("kind", ["random", "latin-hypercube", "sobol"])
def test_intervals_of_weighted_estimates_cover(kind, case):
    campaigns, least, most = case
    samples, replicates = (256, 16) if kind == "sobol" else (512, 8)
    grid = (np.arange(4000) + 0.5) / 4000
    ends = 0.5 / 0.12
    normal = truncnorm(-ends, ends, 0.5, 0.12).ppf(grid)
    fine = np.stack(np.meshgrid(normal, (np.arange(200) + 0.5) / 200), axis=-1)
    value = lambda x: np.exp(x[..., 0]) + 0.2 * x[..., 1]  # noqa: E731
    truth = value(fine).ravel()
    exact = {"mean": truth.mean(), "share": np.mean(truth > 1.9)}
    exact |= {level: np.quantile(truth, level) for level in (0.05, 0.5, 0.95)}
    hits = dict.fromkeys(exact, 0)
    for seed in range(campaigns):
        x = points(kind, samples, replicates, seed)
        y, weights = value(x), TRUE.pdf(x[:, 0])
        replicate = None if kind == "random" else np.arange(samples) % replicates
        found = {
            "mean": reweighting.mean_interval(y, weights, replicate),
            "share": reweighting.share_interval(y > 1.9, weights, replicate),
        } | {
            level: reweighting.quantile_interval(y, weights, level, replicate)
            for level in (0.05, 0.5, 0.95)
        }  # fmt: skip
        for name, (low, high) in found.items():
            hits[name] += bool(low <= exact[name] <= high)
    for name, count in hits.items():
        assert least <= count / campaigns <= most, (name, count / campaigns)


def test_equal_weights_change_nothing():
    values = np.random.default_rng(1).random(200)
    one = np.full(200, 0.3)
    assert reweighting.effective(one) == pytest.approx(200)
    assert reweighting.mean(values, one) == pytest.approx(values.mean())
    assert reweighting.quantile(values, one, 0.3) == pytest.approx(
        np.quantile(values, 0.3), abs=0.01
    )
    assert reweighting.share_interval(values < 2, one, None)[1] == 1.0


def test_blocks_are_reweighted_by_the_samples_that_stand_for_the_population():
    found = analyse(drawn_campaign(Saltelli(samples=256), linear, 3, 1), None, {"x1": NARROW})
    assert found.reweighted_samples.item() == 512
    low, high = found.asynchrony_max_reweighted_interval.sel(reweighted_statistic="mean").values
    assert low < 5.0 < high
    assert np.isnan(found.reweighted_share_interval).all()
    assert any("need design.replicates = 16" in line for line in told(found))
    many = drawn_campaign(Saltelli(samples=256, replicates=16), linear, 3, 1)
    assert (analyse(many, None, {"x1": NARROW}).reweighted_share_interval[0] > 0.9).all()


def test_words_and_lists_of_places_have_weights():
    made = drawn_campaign(RandomDesign(samples=300), linear, 1, 1)
    old = {"kind": "discrete", "values": ["a", "b"], "probabilities": [0.5, 0.5]}
    word = np.where(made.x1 < 0.5, "a", "b").astype(object)
    made["word"] = (
        "sample",
        word,
        {"role": "input", "path": "word", "distribution": json.dumps(old)},
    )
    weights, _ = weights_of(made, read_distributions({"word": old | {"probabilities": [0.9, 0.1]}}))
    np.testing.assert_allclose(weights, np.where(word == "a", 1.8, 0.2))
    friction = np.random.default_rng(2).random((300, 2))
    says = {"role": "input", "path": "friction", "distribution": UNIT}
    made["friction"] = ("sample", "pulley"), friction, says
    weights, pairs = weights_of(made, read_distributions({"friction": NARROW}))
    np.testing.assert_allclose(weights, TRUE.pdf(friction).prod(axis=1))
    assert pairs["friction"].places == 2


@for_each(
    ("reweighted", "words"),
    [
        ({"x3": NARROW}, "is not a drawn input of this campaign"),
        ({"x1": NARROW | {"standard_deviation": 0.3}}, "where no value was drawn"),
        (
            {"x1": {"kind": "uniform", "low": 0.5, "high": 1.5}},
            "50 % of the new distribution lie below 0 or above 1",
        ),
        (
            {"x1": {"kind": "uniform", "low": 0.5, "high": 0.51}},
            "effective ones, and at least 10 are needed",
        ),
        ({"x1": {"kind": "discrete", "values": [0.5]}}, "run a new campaign"),
        ({"x1": {"kind": "normal", "mean": 0.5}}, "standard_deviation is missing"),
        ({"tail": {"kind": "normal", "mean": 3.2, "standard_deviation": 0.5}}, "hardly any of"),
        ({"word": {"kind": "discrete", "values": ["a", "c"]}}, '"c" was never drawn'),
        ({"x1": NARROW | {"each_section": True}}, "each_section = true: the samples were drawn"),
        ({"x1": NARROW | {"unit": "m"}}, 'unit = "m": the samples were drawn without it'),
        ({"listed": NARROW}, "has no distribution"),
        ({"pair": NARROW}, "correlated with x1"),
        ({"learnt": NARROW}, "was learnt from a test"),
    ],
)
def test_what_samples_do_not_cover_is_refused(reweighted, words):
    made = drawn_campaign(RandomDesign(samples=100), linear, 2, 1)
    law = {"kind": "normal", "mean": 0.0, "standard_deviation": 1.0}
    learnt = {"kind": "calibrated", "of": law, "shift": 0.5, "remaining_scatter": 0.1}
    for path, values, words_of in (
        ("tail", norm.ppf(made.x1), json.dumps(law)),
        ("word", np.full(100, "a", dtype=object), '{"kind": "discrete", "values": ["a", "b"]}'),
        ("listed", made.x1.values, "listed in a file"),
        ("pair", made.x1.values, UNIT),
        ("learnt", made.x1.values, json.dumps(learnt)),
    ):
        made[path] = "sample", values, {"role": "input", "path": path, "distribution": words_of}
    made.attrs["campaign"] = '[[correlations]]\nbetween = ["x1", "pair"]\ncoefficient = 0.5\n'
    if next(iter(reweighted)) == "x1":
        made.attrs["campaign"] = ""
    with pytest.raises(InputError, match=words):
        analyse(made, None, reweighted)


def test_samples_that_have_not_run_cover_nothing():
    """200 samples hardly reach beyond 0.9975, where more than 1 % of the new law lies."""
    made = drawn_campaign(RandomDesign(samples=4000), linear, 1, 3)
    beyond = {"x1": {"kind": "uniform", "low": 0.91, "high": 0.9985}}
    assert int(analyse(made, None, beyond)["reweighted_samples"]) == 4000
    part = made.assign(status=made["status"].where(made["sample"] < 200, -1))
    for few in (made.isel(sample=slice(200)), part):
        with pytest.raises(InputError, match="where hardly any of 200 samples lie"):
            analyse(few, None, beyond)


def test_designs_without_a_population_are_refused():
    with pytest.raises(InputError, match="do not represent a population"):
        analyse(drawn_campaign(Morris(samples=20), linear, 2, 1), None, {"x1": NARROW})


def test_the_command_line_takes_inputs_as_campaign_files_write_them(tmp_path):
    made = drawn_campaign(RandomDesign(samples=500), linear, 2, 1)
    made.to_netcdf(tmp_path / "campaign.nc")
    text = 'x1 = { kind = "normal", mean = 0.5, standard_deviation = 0.12 }'
    call = [str(tmp_path), "--reweight", text, "--out", str(tmp_path / "out.nc")]
    done = CliRunner().invoke(analyse_command, call, catch_exceptions=False)
    assert done.exit_code == 0
    assert "500 samples worth 2" in done.output
    assert any(line.split()[:3] == ["asynchrony_max", "deg", "mean"] for line in
               done.output.splitlines())  # fmt: skip
    assert (tmp_path / "out.nc").exists()
    for wrong in ("x1", "x1 = normal", "= {}"):
        with pytest.raises(InputError, match="must read PATH = DISTRIBUTION"):
            parse_reweighted([wrong])
    with pytest.raises(InputError, match="given twice"):
        parse_reweighted([text, text])


def test_failed_runs_count_among_all_that_ran_as_in_the_campaign_as_drawn():
    """40 of 200 failed: a scatter of 2 % less changes no share by more, and their intervals reach
    from none of the failed runs to all.
    """
    rng, law = np.random.default_rng(0), {"kind": "normal", "mean": 1.0, "standard_deviation": 0.1}
    for stalled in (8, 12):
        status, outcome = np.zeros(200, int), np.full(200, int(Fate.DEPLOYED))
        status[:40], outcome[:40] = Status.DIVERGED, int(Fate.NONE)
        outcome[40 : 40 + stalled] = int(Fate.STALLED)
        made = campaign(rng.normal(size=200), status=status, outcome=outcome)
        says = {"role": "input", "path": "a", "distribution": json.dumps(law)}
        made["a"] = "sample", rng.normal(1.0, 0.1, 200), says
        found = analyse(made, reweighted={"a": law | {"standard_deviation": 0.098}})
        for word in ("deployed", "stalled"):
            other, drawn = found.sel(event=word), found.sel(kind=word)
            assert float(other.reweighted_share) == pytest.approx(
                float(drawn.outcome_share), abs=0.01
            )
            ends = drawn.outcome_share_interval.values
            assert other.reweighted_share_interval.values == pytest.approx(ends, abs=0.03)


@pytest.mark.parametrize(
    "between",
    [("PATH", "OTHER"), ("PATH[5]", "rods.young_modulus"),
     ('PATH["section 2 V"]', "rods.young_modulus")],
)  # fmt: skip
def test_a_place_that_is_correlated_by_any_of_its_names_is_not_reweighted(between):
    path, other = (f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower"))
    own = f'{path}["section 2 V"]'
    pair = [name.replace("PATH", path).replace("OTHER", other) for name in between]
    scene = tomllib.loads(load_scene("ring18-cable").to_toml())
    tied = partners([{"between": pair}], scene, [path, own, other, "rods.young_modulus"])
    assert tied[own] == pair[1]
    assert (path in tied) == (between[0] == "PATH")
    assert tied[pair[1]] == pair[0]
