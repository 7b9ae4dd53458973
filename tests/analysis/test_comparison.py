"""Two campaigns are compared in pairs where samples have equal seeds or inputs."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from made import campaign, response
from ringsim.analysis import intervals
from ringsim.analysis.comparison import compare
from ringsim.analysis.comparison_text import compared
from ringsim.cli.compare import command
from ringsim.refusal import InputError
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


def test_seeds_pair_samples_of_campaigns_of_other_lengths_also_with_other_inputs():
    force = np.linspace(0.01, 0.02, COUNT)
    one = with_input(seeded(VALUES), force)
    other = with_input(seeded(SHIFTED), 2 * force).isel(sample=slice(50, None))
    found = compare(one, other)
    assert found.attrs["pairs"] == 150
    assert found.attrs["pairing"].endswith("their inputs differ in loads.force")
    assert difference(found)[1] == pytest.approx((SHIFTED - VALUES)[50:].mean())


def test_inputs_pair_samples_where_seeds_do_not():
    order, force = RANDOM.permutation(COUNT), np.linspace(0.01, 0.02, COUNT)
    one = with_input(seeded(VALUES), force)
    other = with_input(seeded(SHIFTED[order], seed=1), force[order])
    found = compare(one, other)
    assert found.attrs["pairing"] == "samples are paired by their inputs"
    assert difference(found)[1] == pytest.approx((SHIFTED - VALUES).mean())


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
    assert found.changed_outcome_second.values.tolist() == ["stalled", "lost: timeout"]
    lines = compared(found)
    assert "the outcome differs in 2 of 30:" in lines
    assert "  sample 12: deployed, then lost: timeout" in lines
    assert found.asynchrony_max_samples.values.tolist() == [29, 29]
    counts = dict(zip(found.kind.values, found.kind_samples.values.tolist(), strict=True))
    assert counts == {"deployed": [30, 28], "lost: timeout": [0, 1], "stalled": [0, 1]}


def test_two_runs_are_compared(tmp_path):
    for name, value in (("a", 2.0), ("b", 2.5)):
        run = campaign([value]).isel(sample=0, drop=True)
        run.to_netcdf(tmp_path / f"{name}.nc")
    arguments = [str(tmp_path / name) for name in ("a.nc", "b.nc", "c.nc")]
    done = CliRunner().invoke(
        command, [*arguments[:2], "--out", arguments[2]], catch_exceptions=False
    )
    assert done.exit_code == 0
    assert xr.load_dataset(arguments[2]).asynchrony_max_difference.item() == 0.5
    line = next(line for line in done.output.splitlines() if line.startswith("asynchrony_max"))
    assert line.split() == ["asynchrony_max", "degree", "2", "2.5", "0.5"]


def test_a_run_and_a_campaign_are_not_compared(tmp_path):
    campaign([1.0]).to_netcdf(tmp_path / "campaign.nc")
    campaign([1.0]).isel(sample=0, drop=True).to_netcdf(tmp_path / "run.nc")
    with pytest.raises(InputError, match="a run and the other a campaign"):
        CliRunner().invoke(
            command, [str(tmp_path), str(tmp_path / "run.nc")], catch_exceptions=False
        )
