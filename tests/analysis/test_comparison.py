"""Two campaigns are compared in pairs where samples have equal seeds or inputs."""

from __future__ import annotations

import itertools
import json
import re

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from scipy.stats import multinomial, spearmanr, ttest_ind

from made import campaign, drawn_campaign, ishigami, response
from ringsim.analysis import intervals
from ringsim.analysis.comparison import compare
from ringsim.analysis.comparison_text import compared
from ringsim.analysis.design import population_of
from ringsim.analysis.intervals import difference_of_pairs, difference_of_shares
from ringsim.cli.results import compare_command
from ringsim.refusal import InputError
from ringsim.sampling.designs.blocks import Saltelli
from ringsim.variables import Fate, Status

RANDOM = np.random.default_rng(0)
COUNT = 200
VALUES = response(RANDOM.random((COUNT, 3)))
SHIFTED = VALUES + 0.01 + 0.001 * RANDOM.normal(size=COUNT)


def seeded(values, seed=0, **more):
    seeds = np.random.default_rng(seed).integers(0, 2**62, len(values))
    return campaign(values, sample_seed=seeds, **more)


def with_input(made, values, path="loads.force"):
    variable = ("sample", np.asarray(values), {"role": "input", "path": path})
    return made.assign({path.replace(".", "_"): variable})


def difference(found):
    low, high = found.asynchrony_max_difference_interval.values
    return low, found.asynchrony_max_difference.item(), high


def test_pairs_show_what_scatter_hides():
    low, middle, high = difference(found := compare(seeded(VALUES), seeded(SHIFTED)))
    assert low < 0.01 < high
    assert high - low < 0.001
    assert middle == pytest.approx((SHIFTED - VALUES).mean())
    assert found.attrs["pairs"] == COUNT
    assert found.asynchrony_max_difference.attrs["units"] == "degree"
    worst = np.abs(SHIFTED - VALUES).argmax()
    assert found.asynchrony_max_largest_difference_sample.item() == worst
    low, middle, high = difference(found := compare(seeded(VALUES), seeded(SHIFTED, seed=1)))
    assert low < 0.0 < 0.01 < high
    assert "not paired" in compared(found)[2]


@pytest.mark.quick
def test_a_difference_is_told_in_percent_of_what_is_not_zero():
    """Also where the other is zero, and of outputs of which neither end is worse; not of what has
    other signs, nor of where something was.
    """
    size, seeds = np.linspace(1.0, 3.0, 20), np.arange(20)
    more = {
        "longest_motor_lag": (size, 0.0 * size), "peak_tension": (0.0 * size, size),
        "prestress_energy": (2.0 * size, size), "least_drive_margin": (size, -size),
        "least_drive_margin_angle": (2.0 * size, size), "least_plane_margin": (size, 2.0 * size),
    }  # fmt: skip
    sides = (campaign(size, sample_seed=seeds, **{n: both[k] for n, both in more.items()})
             for k in (0, 1))  # fmt: skip
    table = {x.split()[0]: re.split(r"  +", x) for x in compared(compare(*sides)) if x}
    column = next(cells for cells in table.values() if "in %" in cells).index("in %")
    margins = "least_drive_margin", "least_plane_margin"  # without a unit's cell
    told = {name: table[name][column] for name in more if name not in margins}
    assert told == {
        "longest_motor_lag": "-100", "peak_tension": "-", "prestress_energy": "-50",
        "least_drive_margin_angle": "-",
    }  # fmt: skip
    assert [table[name][column - 1] for name in margins] == ["-", "-"]


@pytest.mark.parametrize(("share", "worse"), [(5e-4, False), (5e-3, True)])
def test_less_than_a_thousandth_is_worse_in_neither(share, worse):
    """However sure the difference is: nobody would design otherwise for it."""
    found = compare(seeded(VALUES), seeded(VALUES * (1.0 + share)))
    low, _, high = difference(found)
    assert 0.0 < low < high
    row = next(line for line in compared(found) if line.startswith("asynchrony_max "))
    assert ("  second  " in f"{row}  ") == worse, row


def test_differences_within_the_numerical_errors_are_named():
    """Of either or both, by root mean squares; without any bar that is said."""
    bars = np.where(np.arange(COUNT) % 5 == 0, 0.3, np.nan)
    own, other = seeded(VALUES), seeded(VALUES + 0.35)
    (line,) = (x for x in compared(compare(own, other)) if "numerical errors are not" in x)
    assert "error_bars_every" in line
    both = [each.assign(asynchrony_max_error=("sample", bars)) for each in (own, other)]
    assert compare(*both).asynchrony_max_numerical_error.values == pytest.approx([0.3, 0.3])
    told = [compared(compare(*pair)) for pair in (both, (both[0], other))]
    said = (
        "differences within the numerical errors (root sum of squares of the error bars of both): "
    )
    said += "asynchrony_max (0.42"
    assert [any(x.startswith(said) for x in lines) for lines in told] == [True, False]
    # One that has none adds nothing, which is said.
    lines = compared(compare(both[0], seeded(VALUES + 0.1)))
    assert any(x.startswith(f"{said[:-5]}(0.3 deg, of first alone)") for x in lines)
    lacks = "second has no error bars (error_bars_every): its numerical errors are not counted"
    assert lacks in lines
    assert lacks in told[1]
    assert not any("no error bars" in x for x in told[0])
    # What the bars of both may have made is worse in neither; beyond one bar alone it is.
    rows = [next(x for x in lines if x.startswith("asynchrony_max ")) for lines in told]
    assert ["  second  " in f"{row}  " for row in rows] == [False, True], rows
    # Beyond them the interval of sampling alone, 0.003 wide, would look too sure.
    random = 0.05 * np.random.default_rng(5).normal(size=COUNT)
    far = both[1].assign(asynchrony_max=both[1]["asynchrony_max"] + 0.3 + random)
    wider = "differences that numerical errors leave more uncertain than sampling: asynchrony_max "
    assert any(x.startswith(f"{wider}(0.42 deg)") for x in compared(compare(both[0], far)))
    assert not any("leave more uncertain" in x for x in told[0])
    # Alike outputs have no row, and their bars are measured all the same.
    same = compared(compare(both[0], both[0]))
    assert not any("numerical errors are not measured" in line for line in same)


def test_outputs_that_one_has_alone_are_named():
    own = seeded(VALUES).assign(peak_tension=("sample", 30.0 + VALUES))
    lines = compared(compare(own, seeded(SHIFTED)))
    assert (
        sum(line.startswith("in first alone: ") and "peak_tension" in line for line in lines) == 1
    )
    assert not any("alone" in line for line in compared(compare(own, own)))


def test_outputs_that_are_the_same_in_all_samples_are_one_row():
    """In both: where one sample differs, both rows stand."""
    names = "least_drive_margin", "least_drive_margin_started"
    one, other = (
        seeded(each).assign(dict.fromkeys(names, ("sample", 3.0 - each)))
        for each in (VALUES, SHIFTED)
    )
    told = "least_drive_margin_started is least_drive_margin"
    lines = compared(compare(one, other))
    assert sum(line.startswith("least_drive_margin_started ") for line in lines) == 0
    assert f"in all samples of both {told}" in lines
    other[names[1]] = other[names[1]] + 0.1 * (np.arange(COUNT) == COUNT // 2)
    lines = compared(compare(one, other))
    assert sum(line.startswith("least_drive_margin_started ") for line in lines) == 1
    assert not any(told in line for line in lines)


def test_what_is_constant_in_campaigns_that_are_not_paired_is_one_row():
    counts = {"locked_joints": ("sample", np.full(COUNT, 24))}
    one, other = (seeded(VALUES, seed=k).assign(counts) for k in (0, 1))
    lines = compared(compare(one, other))
    assert not any(line.startswith("locked_joints ") for line in lines)
    assert "the same in all samples of both: locked_joints 24" in lines
    rounded = [
        each.isel(sample=slice(n)).assign(peak_tension=("sample", np.full(n, 0.1)))
        for each, n in ((one, 30), (other, 37))
    ]
    assert not any(line.startswith("peak_tension ") for line in compared(compare(*rounded)))
    other["locked_joints"][3] = 23
    lines = compared(compare(one, other))
    assert any(line.startswith("locked_joints ") for line in lines)


def test_settings_of_the_solver_are_no_inputs_that_differ():
    bars = np.arange(COUNT) % 2.0
    first, second = seeded(VALUES), seeded(SHIFTED)
    for path, told in (("solver.error_bars", False), ("loads.force", True)):
        both = with_input(first, bars, path), with_input(second, 1.0 - bars, path)
        assert ("inputs differ in" in compare(*both).attrs["pairing"]) == told


def test_seeds_pair_samples_of_campaigns_of_other_lengths_also_with_other_inputs():
    force = np.linspace(0.01, 0.02, COUNT)
    one = with_input(seeded(VALUES), force)
    other = with_input(seeded(SHIFTED), 2 * force).isel(sample=slice(50, None))
    found = compare(one, other)
    assert found.attrs["pairs"] == 150
    assert found.attrs["pairing"].endswith("their inputs differ in loads.force")
    assert difference(found)[1] == pytest.approx((SHIFTED - VALUES)[50:].mean())


def test_seeds_pair_nothing_where_other_inputs_have_moved_the_draws():
    """An input with a value for each pulley before it, of which one campaign has more: the same
    distribution then has other values, and sample k is another antenna."""
    law = '{"kind": "uniform", "low": 0.0, "high": 1.0}'
    draws, pulleys = RANDOM.random((3, COUNT)), RANDOM.random((COUNT, 6))
    both = []
    for count, own, values in ((5, draws[0], VALUES), (6, draws[1], SHIFTED)):
        made = with_input(seeded(values), own).assign(
            friction=(("sample", f"pulley_{count}"), pulleys[:, :count])
        )
        for name, path in (("loads_force", "loads.force"), ("friction", "friction")):
            made[name].attrs |= {"role": "input", "path": path, "distribution": law}
        both.append(made)
    told = compare(*both).attrs
    assert told["pairs"] == 0
    assert told["pairing"].startswith(
        "samples are not paired, although their seeds are equal: another input, its places, a "
    )
    # Behind nothing whose number of places changes it keeps its values; the pulleys are named.
    both[1]["loads_force"][:] = draws[0]
    told = compare(*both).attrs
    assert told["pairs"] == COUNT
    assert told["pairing"].endswith("; their inputs differ in friction (5 and 6 places)")
    # A distribution of its own, or what follows an input, is another value of the same draw.
    both[1]["loads_force"][:] = 2.0 * draws[0]
    follows = '{"kind": "function", "input": "x", "table": [[0.0, 1.0], [1.0, 2.0]]}'
    for laws in ((law, law.replace("1.0", "2.0")), (follows, follows)):
        for each, own in zip(both, laws, strict=True):
            each["loads_force"].attrs["distribution"] = own
        assert compare(*both).attrs["pairs"] == COUNT


def test_one_place_with_a_distribution_of_its_own_leaves_samples_paired():
    law, values = '{"kind": "uniform", "low": 0.0, "high": 1.0}', RANDOM.random((COUNT, 4))
    both = []
    for factor, outputs in ((1.0, VALUES), (3.0, SHIFTED)):
        own = values * np.array([1.0, factor, 1.0, 1.0])
        says = {"role": "input", "path": "friction", "distribution": law}
        both.append(seeded(outputs).assign(friction=(("sample", "pulley"), own, says)))
    told = compare(*both).attrs
    assert told["pairing"] == "samples are paired by their seeds; their inputs differ in friction"


def test_inputs_pair_samples_where_seeds_do_not():
    order, force = RANDOM.permutation(COUNT), np.linspace(0.01, 0.02, COUNT)
    one = with_input(seeded(VALUES), force)
    other = with_input(seeded(SHIFTED[order], seed=1), force[order])
    found = compare(one, other)
    assert found.attrs["pairing"] == "samples are paired by their inputs"
    assert difference(found)[1] == pytest.approx((SHIFTED - VALUES).mean())


def test_why_nothing_is_paired_is_told():
    for kind, why in (("random", "seeds"), ("grid", "designs")):
        other = seeded(SHIFTED, seed=1).assign_attrs(design=json.dumps({"kind": kind}))
        told = compare(seeded(VALUES), other).attrs["pairing"]
        assert told.startswith(f"samples are not paired, because neither their {why} nor ")


def test_equal_seeds_of_other_designs_pair_nothing():
    other = seeded(SHIFTED, design={"kind": "sobol", "samples": COUNT})
    found = compare(seeded(VALUES), other)
    assert found.attrs["pairs"] == 0
    assert np.isnan(found.asynchrony_max_difference_interval).all()
    assert "no intervals" in found.attrs["intervals"]


def test_differences_that_are_not_paired_are_covered():
    """Samples of other numbers and spreads; 95 % within 92 to 98 of 100."""
    random, true = np.random.default_rng(4), 0.5
    one = random.normal(0.0, 1.0, (1000, 40))
    other = random.normal(true, 3.0, (1000, 25))
    low, high = intervals.of_difference(one, other)
    assert 0.92 <= np.mean((low <= true) & (true <= high)) <= 0.98
    which = np.arange(40) % 8, np.arange(25) % 5
    low, high = intervals.of_difference(one, other, which)
    assert 0.92 <= np.mean((low <= true) & (true <= high)) <= 0.98


def test_outcomes_that_changed_are_told_by_sample():
    one = np.full(30, Fate.DEPLOYED)
    other, status = one.copy(), np.full(30, Status.OK)
    other[7], other[12], status[12] = Fate.STALLED, Fate.NONE, Status.TIMEOUT
    values = np.where(status == Status.OK, 2.0, np.nan)
    found = compare(
        seeded(np.full(30, 1.0), outcome=one), seeded(values, outcome=other, status=status)
    )
    assert found.changed_sample_first.values.tolist() == [7, 12]
    assert found.changed_outcome_second.values.tolist() == ["stalled", "failed: timeout"]
    lines = compared(found)
    assert "the outcome differs in 2 of 30" in lines
    rows = [line.split() for line in lines]
    assert ["deployed", "failed:", "timeout", "1", "12"] in rows
    # Pairs that changed alike share a row, which names the first of them.
    other[8:29], status[12] = Fate.STALLED, Status.OK
    told = compared(compare(seeded(values, outcome=one), seeded(values, outcome=other)))
    named = ", ".join(map(str, range(7, 19)))
    assert any(re.fullmatch(rf"deployed +stalled +22 +{named}, \.\.\.", line) for line in told)
    assert found.asynchrony_max_samples.values.tolist() == [29, 29]
    counts = dict(zip(found.kind.values, found.kind_samples.values.tolist(), strict=True))
    assert counts == {"deployed": [30, 28], "failed: timeout": [0, 1], "stalled": [0, 1]}
    # Where no pair holds on both sides each has its count, of none that are compared.
    status[:], outcome = Status.TIMEOUT, np.full(30, Fate.NONE)
    gone = seeded(np.full(30, np.nan), outcome=outcome, status=status)
    told = compared(compare(gone, seeded(values, outcome=one)))
    assert any(re.fullmatch(r"deployed +0 +30 +- +-", line) for line in told)


@pytest.mark.parametrize(
    ("first", "second", "ends"),
    [
        ((48, 80), (56, 70), (0.0524, 0.3339)),
        ((3, 10), (9, 10), (0.1705, 0.8090)),
        ((2, 7), (6, 7), (0.0582, 0.8062)),
        ((0, 29), (5, 56), (-0.0381, 0.1926)),
        ((0, 20), (0, 10), (-0.1611, 0.2775)),
        ((0, 10), (10, 10), (0.6075, 1.0000)),
    ],
)
def test_differences_of_shares_are_those_of_the_source(first, second, ends):
    """Newcombe, Statistics in Medicine 17 (1998) 873, table II, method 10."""
    assert difference_of_shares(first, second) == pytest.approx(ends, abs=6e-5)


@pytest.mark.parametrize(
    "kinds",
    [(0.5, 0.2, 0.1, 0.2), (0.9, 0.05, 0.03, 0.02), (0.85, 0.0, 0.1, 0.05), (0, 0.4, 0.4, 0.2)],
)
def test_differences_of_paired_shares_hold_the_truth(kinds):
    """In 92 to 99.9 of 100 campaigns of 20 pairs, by the probability of all their outcomes."""
    pairs, held = 20, 0.0
    for both, first, second in itertools.product(range(pairs + 1), repeat=3):
        if (neither := pairs - both - first - second) >= 0:
            counts = both, first, second, neither
            if probability := multinomial.pmf(counts, pairs, kinds):
                low, high = difference_of_pairs(*counts)
                held += probability * (low <= kinds[2] - kinds[1] <= high)
    assert 0.92 <= held <= 0.999


def test_paired_shares_know_more_than_independent_ones_and_turn_with_their_order():
    low, high = difference_of_pairs(40, 2, 12, 6)
    assert difference_of_pairs(40, 12, 2, 6) == pytest.approx((-high, -low))
    alone = difference_of_shares((42, 60), (52, 60))
    assert alone[0] < low < 10 / 60 < high < alone[1]


REQUIRED = {"asynchrony_max": {"max": 1.5, "probability": 0.9, "confidence": 0.9}}


def test_shares_of_outcomes_and_of_requirements_differ_by_an_interval():
    other = np.where(np.arange(COUNT) % 8 == 0, Fate.STALLED, Fate.DEPLOYED)
    told = {"requirements": json.dumps(REQUIRED)}
    one, two = seeded(VALUES).assign_attrs(told), seeded(SHIFTED, outcome=other).assign_attrs(told)
    found = compare(one, two).sel(kind="stalled", requirement="asynchrony_max <= 1.5 deg")
    assert found.kind_share.values.tolist() == [0.0, 0.125]
    expected = difference_of_pairs(0, 0, COUNT // 8, COUNT - COUNT // 8)
    assert found.kind_share_difference_interval.values == pytest.approx(expected)
    kept = VALUES <= 1.5, SHIFTED <= 1.5
    apart = kept[1].mean() - kept[0].mean()
    assert found.kept_share_difference.item() == pytest.approx(apart)
    kinds = (kept[0] & kept[1]), (kept[0] & ~kept[1]), (~kept[0] & kept[1]), (~kept[0] & ~kept[1])
    expected = difference_of_pairs(*(int(each.sum()) for each in kinds))
    assert found.kept_share_difference_interval.values == pytest.approx(expected)
    assert "samples that meet" in "\n".join(compared(compare(one, two)))
    # Without pairs, and with another limit in one of them.
    found = compare(one, seeded(SHIFTED, 1, outcome=other)).sel(kind="stalled")
    expected = difference_of_shares((0, COUNT), (COUNT // 8, COUNT))
    assert found.kind_share_difference_interval.values == pytest.approx(expected)
    assert "requirement" not in found.dims


def test_a_verdict_that_changes_is_told():
    """All keep to it in one, none in the other; of one that both meet nothing is said."""
    wanted = REQUIRED | {"peak_tension": {"max": 9.0, "probability": 0.9, "confidence": 0.9}}
    told = {"requirements": json.dumps(wanted)}
    tension = np.linspace(1.0, 2.0, COUNT)
    one, two = (
        seeded(values, peak_tension=tension).assign_attrs(told)
        for values in (VALUES / VALUES.max(), 2.0 + VALUES)
    )
    found = compare(one, two)
    assert found.kept_verdict.sel(requirement="asynchrony_max <= 1.5 deg").values.tolist() == [2, 0]
    lines = compared(found)
    assert [line for line in lines if "->" in line] == ["asynchrony_max <= 1.5 deg: met -> not met"]
    (row,) = (line for line in lines if line.startswith("peak_tension <= 9 N"))
    assert row.split()[-2:] == ["met", "met"]


def test_verdicts_on_requirements_whose_limits_differ_are_told():
    """No sample of 200 is above the second limit, and all are above the first."""
    share = {"probability": 0.9, "confidence": 0.9}
    one, two = (
        seeded(2.0 + VALUES / VALUES.max()).assign_attrs(
            requirements=json.dumps({"asynchrony_max": {"max": most} | share})
        )
        for most in (1.0, 5.0)
    )
    lines = compared(compare(one, two))
    told = "asynchrony_max <= 1 deg: not met -> asynchrony_max <= 5 deg: met"
    assert f"limits differ: {told}" in lines
    assert not any("limits differ" in line for line in compared(compare(one, one)))


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (VALUES**3, ""),
        (9.0 - VALUES, "turn round"),
        (
            np.random.default_rng(3).random(COUNT),
            "hardly go together: which samples are bad in one tells little of the other",
        ),
        (-0.5 * VALUES + 2.0 * np.random.default_rng(4).random(COUNT), "tend to turn round"),
        (  # beyond chance, and a tenth of the variance of ranks
            0.35 * VALUES / VALUES.std() + 9.0 + np.random.default_rng(6).normal(size=COUNT),
            "go together weakly",
        ),
        (5.0 + 1e-4 * VALUES, ""),  # all the same to the digits that are told
        (5.0 - 1e-2 * VALUES, "say little of asynchrony_max"),  # they turn round by 0.2 %
    ],
)
def test_the_ranks_of_pairs_are_told_to_turn_round(other, words):
    found = compare(seeded(VALUES), seeded(other))
    expected = spearmanr(VALUES, other).statistic if np.ptp(other) > 1e-2 else np.nan
    assert found.asynchrony_max_rank_correlation.item() == pytest.approx(expected, nan_ok=True)
    told = [line for line in compared(found) if "ranks of pairs" in line]
    assert len(told) == bool(words)
    assert all(words in line for line in told)
    if "little" not in words:
        assert all(line.endswith(f"asynchrony_max ({expected:+.2f})") for line in told)
    # Draws of another distribution stand at the same place of it, and rank alike.
    own = np.linspace(0.01, 0.02, COUNT)
    colder = compare(with_input(seeded(VALUES), own), with_input(seeded(other), 2.0 * own))
    assert "inputs differ in loads.force" in colder.attrs["pairing"]
    assert [line for line in compared(colder) if "ranks of pairs" in line] == told


def test_an_output_that_one_of_two_does_not_have_is_told_as_none():
    """The other one never deploys."""
    one, other = (campaign([2.0], deployment_time=np.array([t])) for t in (25.0, np.nan))
    runs = [each.isel(sample=0, drop=True) for each in (one, other)]
    lacking = "numerical errors are not measured in either (solver.error_bars), and not counted"
    assert lacking in compared(compare(*runs))
    for both in (runs, (one, other)):
        (row,) = (line for line in compared(compare(*both)) if line.startswith("deployment_time"))
        assert row.split()[:4] == ["deployment_time", "s", "25", "none"]
    (row,) = (line for line in compared(compare(*runs[::-1])) if line.startswith("deployment"))
    assert row.split()[2:4] == ["none", "25"]


def test_shares_of_replicates_scatter_as_these_do():
    """Welch's interval of the shares in the replicates."""
    design = {"kind": "sobol", "samples": COUNT, "replicates": 8}
    shares = [0.4 + 0.02 * (np.arange(COUNT) % 8), 0.6 + 0.02 * (np.arange(COUNT) % 8)]
    fates = [
        np.where(np.arange(COUNT) // 8 < 25 * each, Fate.STALLED, Fate.DEPLOYED) for each in shares
    ]
    one, two = (seeded(VALUES, k, design=design, outcome=fates[k]) for k in (0, 1))
    found = compare(one, two).sel(kind="stalled")
    means = [(each == Fate.STALLED).reshape(25, 8).mean(axis=0) for each in fates]
    welch = ttest_ind(means[1], means[0], equal_var=False).confidence_interval()
    assert found.kind_share_difference_interval.values == pytest.approx([welch.low, welch.high])


@pytest.mark.parametrize("seeds", [(0, 0), (0, 1)])
def test_shares_whose_replicates_agree_are_not_exact(seeds):
    """None of 200 against all: Newcombe's interval of the pairs, or of independent samples."""
    design = {"kind": "latin-hypercube", "samples": COUNT, "replicates": 8}
    fates = np.full(COUNT, Fate.STALLED), np.full(COUNT, Fate.DEPLOYED)
    one, two = (
        seeded(VALUES, s, design=design, outcome=f) for s, f in zip(seeds, fates, strict=True)
    )
    found = compare(one, two).sel(kind="deployed")
    ends = difference_of_shares((0, COUNT), (COUNT, COUNT))
    if seeds[0] == seeds[1]:
        ends = difference_of_pairs(0, 0, COUNT, 0)
    assert found.kind_share_difference_interval.values == pytest.approx(ends)
    assert ends[0] < 1.0


def test_laws_that_differ_behind_a_long_beginning_are_told():
    """Faults of which the times differ alone."""
    laws = [
        {"kind": "discrete", "values": [[{"kind": "cut-cable", "cable": "lower", "span": 1,
         "time": time}], [{"kind": "stuck-vjoint", "plane": "upper", "section": 3, "time": 1.0}]]}
        for time in (13.0, 400.0)
    ]  # fmt: skip
    one, two = (with_input(seeded(VALUES), VALUES, "faults") for _ in laws)
    for made, law in zip((one, two), laws, strict=True):
        made["faults"].attrs["distribution"] = json.dumps(law)
    lines = [line for line in compared(compare(one, two)) if "input faults" in line]
    (line,) = "\n".join(lines).splitlines()
    assert "time = 13.0" in line
    assert "time = 400.0" in line
    many = [
        {"kind": "stuck-vjoint", "plane": "upper", "section": k, "time": 1.0} for k in range(20)
    ]
    for made, time in ((one, 1.0), (two, 400.0)):
        law = {"kind": "discrete", "values": [[*many[:-1], many[-1] | {"time": time}], []]}
        made["faults"].attrs["distribution"] = json.dumps(law)
    (line,) = "\n".join(li for li in compared(compare(one, two)) if "input f" in li).splitlines()
    assert "time = 400.0" in line


def test_inputs_that_follow_others_or_share_their_values_are_told_as_such():
    """And not by the value of the scene, which no sample has."""
    one, two = with_input(seeded(VALUES), VALUES, "loads.force"), seeded(VALUES)
    law = {"kind": "function", "input": "lot", "table": [["A", 0.02], ["B", 0.06]]}
    lot = {"kind": "discrete", "values": ["A", "B"]}
    shared = {"kind": "uniform", "low": 0.0, "high": 1.0, "shared": ["rods.damping", "net.gap"]}
    columns = (("lot", "", "lot", lot), ("joints_c", "joints.c", "lot", law),
               ("loads_force", "loads.force", "lot", law),
               ("rods_damping", "rods.damping", "mu", shared))  # fmt: skip
    for name, path, leader, words in columns:
        says = {"role": "input", "path": path, "input": leader, "distribution": json.dumps(words)}
        two[name] = "sample", VALUES, says
    scene = "rods.damping = 0.5\nloads.force = 3.0\njoints.c = 1.0\nnet.gap = 0.1\n"
    for made in (one, two):
        made.attrs["scene"] = scene
    found = compare(one, two)
    told = {str(name): (str(a), str(b)) for name, a, b in zip(
        found.setting.values, found.setting_first.values, found.setting_second.values, strict=True
    )}  # fmt: skip
    follows = "follows lot: 0.02 at A, 0.06 at B"
    assert told["input joints.c"] == ("1.0, not drawn", follows)
    assert told["input loads.force"][1] == follows
    assert told["input rods.damping"] == ("0.5, not drawn", "that of mu")
    assert told["input net.gap"] == ("0.1, not drawn", "that of mu")
    assert told["input lot"][0] == "none"
    assert not any(each[1].endswith("not drawn") for each in told.values())


def test_of_blocks_the_samples_that_stand_for_the_population_are_compared():
    design = Saltelli(samples=16, replicates=8)
    made = drawn_campaign(design, ishigami, 3, 1)
    found = compare(made, made)
    assert found.kind_samples.values.tolist() == [[32, 32]]
    stand = population_of(made).asynchrony_max
    assert found.asynchrony_max_mean.values == pytest.approx(float(stand.mean()))


def test_samples_of_subset_simulation_have_no_means():
    made = seeded(
        VALUES, design={"kind": "subset-simulation", "of": "asynchrony_max", "above": 3.0}
    )
    found = compare(made, seeded(SHIFTED))
    assert np.isnan(found.asynchrony_max_mean).all()
    assert np.isnan(found.kind_share).all()
    assert not [line for line in compared(found) if line.startswith("asynchrony_max")]
    # Equal seeds are not equal points there: these depend on results.
    moved = seeded(
        SHIFTED, design={"kind": "subset-simulation", "of": "asynchrony_max", "above": 3.0}
    )
    assert compare(made, moved).attrs["pairs"] == 0


def test_two_runs_are_compared(tmp_path):
    for name, value in (("a", 2.0), ("b", 2.5)):
        run = campaign([value]).isel(sample=0, drop=True)
        run.to_netcdf(tmp_path / f"{name}.nc")
    arguments = [str(tmp_path / name) for name in ("a.nc", "b.nc", "c.nc")]
    done = CliRunner().invoke(
        compare_command, [*arguments[:2], "--out", arguments[2]], catch_exceptions=False
    )
    assert done.exit_code == 0
    assert xr.load_dataset(arguments[2]).asynchrony_max_difference.item() == 0.5
    line = next(line for line in done.output.splitlines() if line.startswith("asynchrony_max"))
    assert line.split() == ["asynchrony_max", "deg", "2", "2.5", "0.5", "+25", "b"]


@pytest.mark.parametrize(
    ("sections", "before", "worse"),
    [(12, 24, ["second"]), (6, 24, []), (6, 20, ["first"]), (9, 24, ["second"])],
)
def test_all_of_fewer_v_joints_are_not_fewer(sections, before, worse):
    """Those are worse that lack a larger share of theirs."""
    runs = []
    for count, locked in ((12, before), (sections, 12)):
        run = campaign([2.0], locked_joints=np.array([locked]))
        angles = ("sample", "plane", "section"), np.zeros((1, 2, count))
        runs.append(run.assign(opening=angles).isel(sample=0, drop=True))
    row = next(line.split() for line in compared(compare(*runs)) if line.startswith("locked"))
    assert row[:3] == ["locked_joints", str(before), "12"]
    assert row[5:] == worse


def test_numbers_of_what_did_not_open_are_said_to_be_such():
    ends = {0: np.full(30, Fate.DEPLOYED), 9: np.repeat([Fate.STALLED, Fate.DEPLOYED], [9, 21])}
    made = {n: seeded(np.linspace(1.0, 2.0, 30) + n, outcome=own) for n, own in ends.items()}
    told = "of second a larger share of the samples ended before their goal: the numbers of these"
    assert any(line.startswith(told) for line in compared(compare(made[0], made[9])))
    told = told.replace("second", "first")
    assert any(line.startswith(told) for line in compared(compare(made[9], made[0])))
    assert "before their goal" not in str(compared(compare(made[9], made[9])))
    # What failed has no numbers.
    lost = {"status": np.full(30, Status.TIMEOUT), "outcome": np.full(30, Fate.NONE)}
    gone = seeded(np.full(30, np.nan), **lost)
    assert "before their goal" not in str(compared(compare(made[0], gone)))
    runs = [each.isel(sample=0, drop=True) for each in made.values()]
    assert any(
        line == "second ended before its goal: its numbers tell only how far it came"
        for line in compared(compare(*runs))
    )


def test_a_run_and_a_campaign_are_not_compared(tmp_path):
    campaign([1.0]).to_netcdf(tmp_path / "campaign.nc")
    campaign([1.0]).isel(sample=0, drop=True).to_netcdf(tmp_path / "run.nc")
    with pytest.raises(InputError, match="a run and the other a campaign"):
        CliRunner().invoke(
            compare_command, [str(tmp_path), str(tmp_path / "run.nc")], catch_exceptions=False
        )


@pytest.mark.parametrize("moved", [1, 3, 5, 6, 12])
def test_few_pairs_that_differ_tell_no_direction(moved):
    """As of the shares of outcomes that moved so: five of one sign are chance in 1 of 16."""
    counts = np.full(60, 24.0)
    fewer = counts - 12.0 * (np.arange(60) < moved)
    # Round-off, or a change that moves all a little, gives no direction either.
    noise = 1e-3 * np.random.default_rng(moved).standard_normal(60)
    for more in (0.0, noise):
        low, middle, high = difference(compare(seeded(counts), seeded(fewer + more)))
        assert middle == pytest.approx(-12.0 * moved / 60, abs=1e-3)
        assert (high >= 0.0) == (moved < 6)
        assert low < middle


def test_one_pair_far_off_does_not_hide_what_all_pairs_say():
    more = np.full(60, 0.05)
    more[7] = 12.0
    low, _, _ = difference(compare(seeded(np.full(60, 24.0)), seeded(24.0 + more)))
    assert low > 0.0
