"""A campaign of subset simulation that ends short of its event says so, and bounds it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from made import drawn_campaign
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import sections, told
from ringsim.analysis.tails import approach, tail_table
from ringsim.plots.campaign.tornado import explained
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.variables import Status

pytestmark = pytest.mark.quick

FACTORS = dict.fromkeys(("x1", "x2"))


def linear(points):
    """Standard normal if the inputs are uniform in the unit interval."""
    return norm.ppf(points).sum(axis=1) / 2**0.5


def campaign(above, most_levels, lost=None):
    """A campaign that has grown as far as its levels go; ``lost`` takes its points."""
    design = SubsetSimulation(
        of="asynchrony_max", above=above, samples=100, share=0.1, replicates=4,
        most_levels=most_levels,
    )  # fmt: skip
    while not design.ended:
        points = design.points(FACTORS, 3)
        gone = np.zeros(len(points), dtype=bool) if lost is None else lost(points)
        design = design.knowing(design.responses(linear(points), gone))
    made = drawn_campaign(design, linear, 2, 3, lost)
    made["asynchrony_max"].attrs["units"] = "degree"
    return made


@pytest.mark.parametrize(("above", "short"), [(7.0, 4), (3.2, 2)])
def test_an_event_that_is_not_reached_is_bounded_and_never_told_as_zero(above, short):
    made = campaign(above, 1)
    found = analyse(made)
    each = found.tail_replicate_probability.values
    assert (each == 0.0).sum() == short
    high = found.tail_reached_probability_interval.values[1]
    assert norm.sf(above) < high < 0.5
    table = tail_table(found)
    assert table.head[1] == f"asynchrony_max > {above:g} deg"
    told_of = dict(table.rows)["probability"]
    below, _, words = told_of.partition(": ")
    assert high <= float(below.removeprefix("below ")) < 1.1 * high  # two digits, rounded up
    assert words == f"{short} of 4 replicates did not reach the event"
    assert (
        f"the run nearest to the event has {made.asynchrony_max.values.max():.6g} deg"
    ) in table.notes
    assert {*table.notes, table.lines()[0]} <= {*told(found)}


def test_of_equal_responses_the_first_samples_bound_the_event():
    """As of rings none of which is ever slack."""
    design = SubsetSimulation(
        of="longest_slack", above=0.2, samples=100, share=0.1, replicates=4, most_levels=3
    )

    def never(points):
        return np.zeros(len(points))

    while not design.ended:
        design = design.knowing(never(design.points(FACTORS, 3)))
    made = drawn_campaign(design, never, 2, 3)
    made = made.rename(asynchrony_max="longest_slack")
    made["longest_slack"].attrs["units"] = "s"
    table = tail_table(analyse(made))
    assert made.sizes["sample"] == 400
    assert dict(table.rows)["probability"] == (
        "below 0.0092: 4 of 4 replicates did not reach the event"  # 1 - 0.025^(1 / 400)
    )
    assert (
        "the bound is the probability of longest_slack > 0 s by the first 400 samples, which are "
        "independent"
    ) in table.notes


def test_failed_runs_that_the_full_engine_finds_in_the_event_are_told():
    def lost(points):
        return points[:, 0] < 0.05

    made = campaign(2.5, 8, lost)
    gone = made["status"].values == Status.DIVERGED
    made["status_checked"] = "sample", np.where(gone, 0, -1)
    again = np.where(gone, 99.0, np.nan)
    made["asynchrony_max_checked"] = "sample", again, made.asynchrony_max.attrs
    rows, count = dict(tail_table(analyse(made)).rows), int(gone.sum())
    assert count > 10
    told_of = rows["in the event with the full engine only"]
    assert told_of.startswith(f"{count} of {count} repeated runs outside the event")


def test_an_event_that_all_reached_has_its_probability():
    found = analyse(campaign(2.5, 8))
    assert "tail_reached_probability" not in found
    assert found.tail_probability_interval.values[0] < norm.sf(2.5)
    (probability,) = [text for what, text in tail_table(found).rows if what == "probability"]
    assert float(probability) == pytest.approx(found.tail_probability.item(), rel=5e-3)


def test_a_probability_is_that_of_the_samples_in_any_order_and_none_of_a_part():
    made = campaign(2.5, 8)
    right = analyse(made)
    count = made.sizes["sample"]
    order = np.random.default_rng(1).permutation(count)
    for selected in (made.isel(sample=slice(None, None, -1)), made.isel(sample=order)):
        found = analyse(selected)
        assert found.tail_probability.item() == right.tail_probability.item()
        np.testing.assert_array_equal(
            found.tail_probability_interval, right.tail_probability_interval
        )
        assert [each[0].tolist() for each in approach(selected)] == [
            each[0].tolist() for each in approach(made)
        ]
    event = np.flatnonzero(made.asynchrony_max.values > 1.0)
    for part in (event, np.delete(np.arange(count), count // 2), np.arange(1, count)):
        table = tail_table(analyse(made.isel(sample=part)))
        assert dict(table.rows) == {"runs": str(len(part))}
        assert "samples are left out from which others were drawn" in table.notes[0]
    unfinished = tail_table(analyse(made.isel(sample=slice(0, 450))))
    assert unfinished.notes == ["not all levels have run yet: no probability"]


def test_samples_of_chains_are_not_judged_as_independent():
    made = campaign(2.5, 8)
    found = analyse(made)
    assert not [name for name in found if "correlation" in str(name)]
    assert "no sensitivity to inputs is given: samples of" in "\n".join(told(found))
    assert not explained(made)
    # The same samples of a list of values have correlations.
    listed = analyse(made.assign_attrs(design='{"kind": "list"}'))
    assert "asynchrony_max_rank_correlation" in listed


def test_the_sentences_on_top_tell_the_event_and_no_share_of_chains():
    wanted = {"asynchrony_max": {"max": 1.0, "probability": 0.9, "confidence": 0.9}}
    for levels, begins in ((8, "probability 0.01"), (1, "probability below ")):
        found = analyse(campaign(2.5 if levels == 8 else 7.0, levels), wanted)
        first, *notes = sections(found, full=False)["short"].tables[0].notes
        assert first.split(": ", 1)[1].startswith(begins)
        assert first.startswith("asynchrony_max > ")
        assert not [line for line in (first, *notes) if "violate" in line]
