"""What a merged campaign says of its largest values."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy
import xarray as xr
from made_campaign import made_campaign
from matplotlib.text import Text

from ringsim.analysis.campaign_notes import (
    late_line,
    open_outcomes,
    peak_lines,
    plane_line,
    remark_lines,
    rigid_line,
)
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import not_met, statistics_table
from ringsim.analysis.study_text import told as all_told
from ringsim.analysis.verdicts import verdict_table
from ringsim.analysis.worst import margin_table
from ringsim.outputs.base import SMOOTHED
from ringsim.plots.figures import figures_of
from ringsim.refusal import InputError
from ringsim.report.dossier import reached_by_words
from ringsim.variables import Fate, Status

pytestmark = pytest.mark.quick


def test_the_numerical_error_of_a_sample_that_is_named_stands_beside_its_value() -> None:
    """Its own where it states one, else the largest of the others, else how to get one."""
    made, name = made_campaign(5), "peak_tension_error"
    where = {"time": [5.0] * 5, "plane": ["upper"] * 5, "span": [1] * 5}
    made = made.assign({f"peak_tension_{k}": ("sample", v) for k, v in where.items()})

    def told(bars: list[float]) -> list[str]:
        lines = peak_lines(made.assign({name: ("sample", bars)}))
        return [line for line in lines if "tension in sample" in line]

    (line,) = told([0.1, np.nan, 0.3, np.nan, 0.25])
    assert "in sample 4: 24" in line
    assert " N +- 0.25 at 5 s" in line
    (line,) = told([0.1, np.nan, 0.3, np.nan, np.nan])
    assert line.endswith("; largest error bar of 2 other samples: 0.3 N")
    assert "nan" not in line
    assert sum("error_bars_every" in line for line in peak_lines(made)) == 1


def test_a_largest_value_is_rounded_once() -> None:
    """15.065022 is 15.07 in four digits, and 15.065 in five would be 15.06."""
    where = {"time": [5.0] * 5, "plane": ["upper"] * 5, "span": [1] * 5}
    made = made_campaign(5)
    made = made.assign({f"peak_tension_{k}": ("sample", v) for k, v in where.items()})
    made["peak_tension"] = "sample", [1.0, 15.065022, 2.0, 3.0, 4.0], {"units": "N"}
    for bars in ([np.nan] * 5, [0.31, np.nan, np.nan, np.nan, np.nan]):
        lines = peak_lines(made.assign(peak_tension_error=("sample", bars)))
        (line,) = (line for line in lines if "tension in sample 1" in line)
        assert "15.07 N" in line


def test_another_worst_value_by_the_full_engine_stands_beside_it() -> None:
    made = made_campaign(5)
    where = {"time": [5.0] * 5, "plane": ["upper"] * 5, "span": [1] * 5}
    made = made.assign({f"peak_tension_{k}": ("sample", v) for k, v in where.items()})
    own = float(made["peak_tension"][4])
    for other, told in ((1.5 * own, f"; {1.5 * own:.3g} N by the full engine"), (1.04 * own, "")):
        checked = np.array([np.nan, 1.0, np.nan, np.nan, other])
        lines = peak_lines(made.assign(peak_tension_checked=("sample", checked)))
        (line,) = (line for line in lines if "tension in sample 4" in line)
        assert line.endswith(told)
        assert ("by the full engine" in line) == bool(told)


def test_remarks_of_runs_are_counted_and_the_first_is_quoted() -> None:
    """Alike but for numbers and places; failed runs have reasons, and no remarks that count."""
    made = made_campaign(12, failed=(4,))
    reached = "all V-joints have reached 180 deg"
    steps = "steps of {} ms at the lock at {} s are too long for shocks in the rods (period 1 ms)"
    latch = "whether the latch of {} catches is uncertain, as another joint locked in the same step"
    reasons = [reached] * 12
    for sample, numbers in {1: (2.5, 9.1), 4: (1.0, 9.2), 7: (1.2e-3, 30.25), 9: (3, 9)}.items():
        reasons[sample] += "; " + steps.format(*numbers)
    reasons[9] += "; " + latch.format("upper 3, lower 5 and 2 more")
    reasons[10] += "; " + latch.format("lower 1")
    reasons[11] += "; " + latch.format("upper 2, 4")
    made["reason"] = "sample", np.array(reasons, dtype=object)
    first, second = remark_lines(made)
    assert first == f"in 3 of 11 samples, for example in sample 1: {steps.format(2.5, 9.1)}"
    assert second.startswith(
        "in 3 of 11 samples, for example in sample 9: whether the latch of upper 3"
    )
    lines = "\n".join(all_told(analyse(made)))
    assert " ".join(first.split()) in " ".join(lines.split())
    assert remark_lines(made_campaign(3)) == []
    # A selection keeps the numbers of its samples.
    assert ["sample 9:" in line for line in remark_lines(made.isel(sample=[9]))] == [True, True]
    # Also where it is the reason itself, and of rings of which only half came so far.
    one = "1 of 24 latches did not catch: upper 5"
    half = "2 of the 12 latches that were met did not catch: upper 5, lower 6"
    reasons = [reached, f"{one}; stalled", f"came to rest; {half}"]
    caught = made_campaign(3).assign(reason=("sample", np.array(reasons, dtype=object)))
    assert f"in 2 of 3 samples, for example in sample 1: {one}" in remark_lines(caught)
    again = "reached (start 2 with solver.step = 0.1 s; start 1: too much energy (10 %): reduce it)"
    once_more = made.assign(reason=("sample", np.array([again] + [reached] * 11, dtype=object)))
    assert remark_lines(once_more) == [
        "in 1 of 11 samples, sample 0: first attempt, not used: too much energy (10 %): reduce it"
    ]
    made["reason"] = "sample", np.array([f"{reached}; {latch}"] * 12, dtype=object)
    assert remark_lines(made) == [f"in all 11 samples, for example in sample 0: {latch}"]


REACHED = "all V-joints have reached 180 deg"
LONG = "steps of {} ms at the lock at 9 s are too long for shocks in the rods (period 1 ms)"


def with_doubts(made: xr.Dataset, names: dict[int, str]) -> xr.Dataset:
    """By sample the outputs that its run calls uncertain; the finest cure is that of the last."""
    reasons = np.full(made.sizes["sample"], REACHED, dtype=object)
    for k, of in names.items():
        cure = f"set solver.tolerance = {1e-4 / (k + 1):.1e} (2 to 3 times the steps)"
        reasons[k] += f"; {LONG.format(k)}, so {of} may be off: {cure}"
    return made.assign(reason=("sample", reasons))


def test_what_runs_call_uncertain_is_marked_wherever_it_is_told() -> None:
    """With one line that counts the samples of each output and has what cures all of them."""
    lists = {0: "peak_tension, asynchrony_max", 2: "peak_tension", 3: "peak_tension", 5: "nothing"}
    where = {"time": [5.0] * 9, "plane": ["upper"] * 9, "span": [1] * 9}
    made = with_doubts(made_campaign(9, failed=(3,)), lists)
    made = made.assign({f"peak_tension_{k}": ("sample", v) for k, v in where.items()})
    found = analyse(made)
    text = "\n".join(all_told(found))
    line = (
        "? may be off, since steps are too long at locks: peak_tension in 2 of 8 "
        "samples, asynchrony_max in 1, nothing in 1; set solver.tolerance = 1.7e-05 (2 to 3 times "
        "the steps)"
    )
    assert text.count(line) == 1
    assert line in peak_lines(made)
    assert not remark_lines(made)
    for name in ("peak_tension", "asynchrony_max"):
        marked = re.findall(rf"\b{name}\b(?! in [12])(.?.?)", text.replace(line, ""))
        assert set(marked) == {" ?"}
        assert len(marked) >= 2
    assert "deployment_time ?" not in text
    assert "largest tension ? in sample 8" in "\n".join(peak_lines(made))
    assert found["peak_tension"].attrs["may_be_off"] == "2 of 8 samples"
    assert "may_be_off" not in analyse(made_campaign(9)).attrs


def test_friction_that_is_smoothed_away_is_told_beside_steps_that_are_too_long() -> None:
    """Each with its own cure; of two cures of one kind the finer one."""
    made = with_doubts(made_campaign(6), {0: "peak_tension"})
    reasons = made["reason"].to_numpy()
    for sample, slip in ((2, 4e-7), (4, 5e-6)):
        reasons[sample] += (
            f"; {SMOOTHED}: tensions are up to 40 % too high, so peak_tension may be off: set "
            f"cables.upper.slip_speed = {slip:.1e} m/s"
        )
    (told,) = (line for line in peak_lines(made) if line.startswith("?"))
    since, _, more = told.partition(": ")
    slow = "much of the pulley friction is smoothed away"
    assert since == f"? may be off, since steps are too long at locks or {slow}"
    assert more == (
        "peak_tension in 3 of 6 samples; where steps are too long at locks, set solver.tolerance = "
        f"1.0e-04 (2 to 3 times the steps); where {slow}, set cables.upper.slip_speed = 4.0e-07 m/s"
    )
    assert not remark_lines(made)
    found = analyse(made, {"peak_tension": {"max": 100.0, "probability": 0.5, "confidence": 0.6}})
    (row,) = verdict_table(found).rows
    assert row[1] == "met, if its numbers hold: may be off in 3 of 6 samples"


def test_an_outcome_may_be_off_by_smoothed_friction_without_a_latch_in_doubt() -> None:
    """The verdict hangs on it, and no line says that latches decide it."""
    made = with_doubts(made_campaign(6), {})
    reasons = made["reason"].to_numpy()
    reasons[:4] += f"; {SMOOTHED}: it moves too easily, so outcome may be off: set a.slip_speed = 1"
    wanted = {"outcome": {"is": "deployed", "probability": 0.5, "confidence": 0.6}}
    found = analyse(made, wanted)
    (row,) = verdict_table(found).rows
    assert row[1] == "met, if its numbers hold: may be off in 4 of 6 samples"
    assert found["samples_unsure"].item() == 0
    assert "latches catch" not in "\n".join(all_told(found))


def test_a_requirement_before_any_sample_holds_says_so() -> None:
    made = made_campaign(3, failed=(0, 1, 2)).drop_vars("peak_tension")
    with pytest.raises(InputError, match="peak_tension: no sample has numbers that hold yet"):
        analyse(made, {"peak_tension": {"max": 1.0, "probability": 0.5, "confidence": 0.6}})


def test_a_verdict_says_so_if_what_may_be_off_could_change_it() -> None:
    """Met by all of 30 samples, or by none: it stands as long as Clopper and Pearson's bound with
    those samples on the other side decides it, too.
    """
    made, seen = made_campaign(30), set()
    for most, sound in ((100.0, "met"), (10.0, "not met")):
        wanted = {"peak_tension": {"max": most, "probability": 0.8, "confidence": 0.9}}
        for count in range(0, 31, 3):
            doubtful = with_doubts(made, dict.fromkeys(range(count), "peak_tension"))
            found = analyse(doubtful, wanted)
            (row,) = verdict_table(found).rows
            kept = 30 - count if most > 50.0 else count
            low = scipy.stats.beta.ppf(0.1, kept, 31 - kept) if kept else 0.0
            high = scipy.stats.beta.ppf(0.9, kept + 1, 30 - kept) if kept < 30 else 1.0
            stands = low >= 0.8 if most > 50.0 else high < 0.8
            told = f"{sound}, if its numbers hold: may be off in {count} of 30 samples"
            assert row[1] == (sound if stands else told)
            gate = not_met(found)
            assert gate == ([] if stands and most > 50.0 else [f"{row[0]}: {row[1]}"])
            seen.add((most, stands))
    assert len(seen) == 4
    every = with_doubts(made, dict.fromkeys(range(30), "peak_tension"))  # of 20 to 49 N
    hold = "if its numbers hold: may be off in"
    for most, told in ((475.0, f"met, {hold} 2 of 30 samples"), (500.0, "met"),
                       (4.45, f"not met, {hold} 25 of 30 samples"), (1.9, "not met")):  # fmt: skip
        wanted = {"peak_tension": {"max": most, "probability": 0.9, "confidence": 0.9}}
        (row,) = verdict_table(analyse(every, wanted)).rows
        assert row[1] == told


def test_a_verdict_says_so_if_numerical_errors_could_change_it() -> None:
    """Tensions of 20 to 49 N; two samples have error bars, whose root mean square the others take.
    The verdict stands if it is the same with all close samples on either side.
    """
    made, seen = made_campaign(30), set()
    for bars in ((0.3, 0.4), (3.0, 4.0), (9.0, 12.0)):
        error = np.full(30, np.nan)
        error[[0, 20]] = bars
        made["peak_tension_error"] = "sample", error
        own = np.where(np.isfinite(error), error, np.hypot(*bars) / np.sqrt(2.0))
        for limit in (44.5, 48.6, 53.0, 60.0, 30.5):
            wanted = {"peak_tension": {"max": limit, "probability": 0.8, "confidence": 0.9}}
            found = analyse(made, wanted)
            values = 20.0 + np.arange(30.0)
            ends = []
            for kept in (values + own < limit, values - own < limit):
                n = int(kept.sum())
                low = scipy.stats.beta.ppf(0.1, n, 31 - n) if n else 0.0
                high = scipy.stats.beta.ppf(0.9, n + 1, 30 - n) if n < 30 else 1.0
                ends.append(2 if low >= 0.8 else 0 if high < 0.8 else 1)
            table = verdict_table(found)
            verdict, stands = found.verdict.item(), ends[0] == ends[1]
            close = int((np.abs(values - limit) < own).sum())
            assert found.samples_close.item() == close
            told = f"if its numbers hold: may be off in {close} of 30 samples"
            assert (told in table.rows[0][1]) == (not stands and verdict != 1)
            (note,) = [n for n in table.notes if "closer to the limit" in n] or [""]
            assert bool(note) == (close > 0 and (not stands or verdict == 1))
            if note and verdict != 1:
                assert f"in {close} sample" in note
                assert f"one at most {np.hypot(*bars) / np.sqrt(2.0):.2g} N, the root" in note
                assert not_met(found) == [f"{table.rows[0][0]}: {table.rows[0][1]}"]
            seen.add((verdict, stands))
    assert {(2, True), (2, False), (0, True)} <= seen


def test_an_outcome_says_so_if_latches_may_not_have_caught() -> None:
    made = made_campaign(30)
    wanted = {"outcome": {"is": "deployed", "probability": 0.8, "confidence": 0.9}}
    words = "; whether the latch of upper 3 catches is uncertain, as another joint locked"
    for count, stands in ((1, True), (2, True), (3, False), (30, False)):
        made["reason"] = "sample", np.array([REACHED + words * (k < count) for k in range(30)])
        found = analyse(made, wanted)
        low = scipy.stats.beta.ppf(0.1, 30 - count, 1 + count) if count < 30 else 0.0
        assert (low >= 0.8) == stands
        table = verdict_table(found)
        told = f"met, if its numbers hold: may be off in {count} of 30 samples"
        assert table.rows[0][1] == ("met" if stands else told)
        assert any("uncertain whether all latches catch" in n for n in table.notes) != stands
    # A ring is not deployed for certain if another latch of it has missed, as one that has failed.
    for certain, count in ((0, 30), (1, 29), (3, 27)):
        latched = np.ones((30, 2, 4), dtype=int)
        latched[:certain, 1, 0], latched[:, 0, 2] = 0, 0  # lower 1, and upper 3, which is in doubt
        fate = np.where(np.arange(30) < 10, Fate.NOT_LATCHED, Fate.DEPLOYED)
        unsure = made.assign(
            outcome=("sample", fate), latched=(("sample", "plane", "section"), latched),
            latch_rate=(("sample", "plane", "section"), np.full((30, 2, 4), 0.4)),
        )  # fmt: skip
        # That a latch which has caught is in doubt, too, makes no other one's miss uncertain.
        also = unsure.assign(latched=(("sample", "plane", "section"), np.where(
            np.arange(4) == 2, 1, latched)))  # fmt: skip
        assert open_outcomes(also).sum() == 30 - certain
        # Past its stops a ring is overloaded by the latch that did not catch, and by nothing else.
        past = np.where(np.arange(30) < 20, Fate.OVERLOADED, fate)
        assert open_outcomes(unsure.assign(outcome=("sample", past))).sum() == 30 - certain
        both = np.where(np.arange(30) < max(certain, 20), Fate.OVERLOADED, fate)
        assert open_outcomes(also.assign(outcome=("sample", both))).sum() == 10
        notes = verdict_table(analyse(unsure, wanted)).notes
        (note,) = (each for each in notes if "uncertain whether" in each)
        assert note.startswith(f"outcome: in {count} samples it is uncertain")
    # Of four latches, the second of which is in doubt, three may be all there are or four: a latch
    # that has missed can only be won, and one that has caught only be lost.
    for caught, least, open_ in ((1, 4.0, True), (1, 3.0, False), (0, 4.0, True), (0, 5.0, False)):
        latched = np.ones((30, 2, 4), dtype=int)
        latched[:, 0, 2] = caught
        counted = unsure.assign(
            latched=(("sample", "plane", "section"), latched),
            latched_joints=("sample", np.full(30, 3.0 + caught)),
        )
        so_many = {"latched_joints": {"min": least, "probability": 0.8, "confidence": 0.9}}
        found = analyse(counted, so_many)
        assert found["samples_unsure"].item() == 30 * open_
        told = "latched_joints: in 30 samples it is uncertain whether so many latches catch"
        assert any(n.startswith(told) for n in verdict_table(found).notes) == open_
    # No latch of a ring that stalled before its stops is in doubt.
    made["outcome"].values[:3] = Fate.STALLED
    (note,) = [n for n in verdict_table(analyse(made, wanted)).notes if "uncertain whether" in n]
    assert note.startswith("outcome: in 27 samples it is uncertain")
    made["outcome"].values[:3] = Fate.DEPLOYED
    # A rate of 0.30 rad/s, known to 0.06, may have been below the 0.25 at which latches catch.
    made["reason"] = "sample", np.array([REACHED] * 30)
    rates = np.full((30, 2, 4), 0.40)
    rates[:4, 1, 2] = 0.30
    made["latch_rate"] = ("sample", "plane", "section"), rates
    made["least_latch_rate_error"] = "sample", np.array([0.06, *[np.nan] * 29])
    wanted = {"outcome": {"is": "deployed", "probability": 0.8, "confidence": 0.9}}
    assert verdict_table(analyse(made, wanted)).rows[0][1] == "met"
    made.attrs["scene"] += "\n[latch]\nmin_rate = 0.25\n"
    told = "met, if its numbers hold: may be off in 4 of 30 samples"
    assert verdict_table(analyse(made, wanted)).rows[0][1] == told
    made.attrs["scene"] = made_campaign(2).attrs["scene"]
    law = '{"kind": "uniform", "low": 0.0, "high": 1.0}'
    says = {"role": "input", "path": "latch.min_rate", "units": "rad/s", "distribution": law}
    for dims, least, count in (
        ("sample", np.where(np.arange(30) < 2, 0.25, 0.1), 0),  # two can change no verdict
        ("sample", np.where(np.arange(30) < 4, 0.25, 0.1), 4),
        (("sample", "section"), np.tile([0.1, 0.1, 0.25, 0.1], (30, 1)), 4),
        (("sample", "section"), np.tile([0.25, 0.25, 0.1, 0.25], (30, 1)), 0),
        (("sample", "section"), np.tile([0.1, 0.1, 0.0, 0.1], (30, 1)), 0),  # always catches
    ):
        drawn = made.assign(latch_min_rate=(dims, least, says))
        drawn["latch_peak_torque"] = "sample", np.arange(30.0), says | {"path": "latch.peak_torque"}
        rates[5:8, 0, 2] = 0.02
        drawn["latch_rate"] = ("sample", "plane", "section"), rates
        (row,) = verdict_table(analyse(drawn, wanted)).rows
        assert row[1] == (f"met, if its numbers hold: may be off in {count} of 30 samples"
                          if count else "met")  # fmt: skip
    made["reason"] = "sample", np.array([REACHED + words] * 30)
    # One latch cannot decide where seven may be spared, and none makes a ring stall.
    made["latched_joints"] = "sample", np.full(30, 8.0)
    for least, sure in ((7.0, True), (7.5, False), (8.0, False)):
        wanted = {"latched_joints": {"min": least, "probability": 0.8, "confidence": 0.9}}
        (row,) = verdict_table(analyse(made, wanted)).rows
        assert (row[1] == "met") == sure
    wanted = {"outcome": {"is": "stalled", "probability": 0.8, "confidence": 0.9}}
    assert verdict_table(analyse(made, wanted)).rows[0][1] == "not met"


def test_drive_margins_before_a_winch_starts_are_told_beside_the_margin() -> None:
    """With the worst sample from then on."""
    made = made_campaign(4)
    words = "the least drive margin is that of 0 s, before cables.lower.winch starts at 1 s"
    made["reason"] = "sample", np.array([REACHED, *[f"{REACHED}; {words}"] * 3], dtype=object)
    made["least_drive_margin"] = "sample", np.array([0.1, -0.5, -0.6, -0.7])
    assert late_line(made) == ""  # of a result that does not tell the other
    made["least_drive_margin_started"] = "sample", np.array([0.1, 0.3, -0.2, 0.1])
    made["least_drive_margin_started_angle"] = "sample", np.full(4, 14.0)
    line = (
        "in 3 of 4 samples the least drive margin is that of a time before the last winch "
        "starts; counted from then on the least of all samples is -0.2 (sample 2, at 14 deg)"
    )
    table = margin_table(analyse(made))
    assert not table.notes  # it is a margin already
    name = "least_drive_margin_started"
    assert table.rows[-1] == (f"{name} >= 0", name, "-0.2", "-0.2: NOT enough", "2", "1 of 4")
    assert late_line(made) == line
    wanted = {"least_drive_margin": {"min": 0.0, "probability": 0.9, "confidence": 0.9}}
    assert f"least_drive_margin: {line}" in verdict_table(analyse(made, wanted)).notes
    assert not remark_lines(made)
    made[name] = made["least_drive_margin"]
    assert late_line(made) == ""
    assert name not in str(margin_table(analyse(made)).rows)


def test_a_plane_whose_own_cable_has_less_is_told_beside_the_margin_of_both() -> None:
    """Of all samples: the one with the least margin of both need not be the one with the least of
    a plane.
    """
    made = made_campaign(5, failed=(4,))
    made["least_drive_margin"] = "sample", np.array([0.3, 0.172, 0.5, 0.4, -0.9])
    made["least_plane_margin"] = "sample", np.array([0.2, 0.120, -0.006, 0.4, -1.0])
    line = "the least drive margin of one plane's own cable is -0.006 (sample 2): "
    assert plane_line(made) == f"{line}NOT enough in 1 of 4 samples"
    analysis = analyse(
        made, {"least_drive_margin": {"min": 0.0, "probability": 0.5, "confidence": 0.5}}
    )
    assert f"least_drive_margin: {plane_line(made)}" in verdict_table(analysis).notes
    rows = {row[0]: row[1:] for row in margin_table(analysis).rows}
    assert rows["least_drive_margin >= 0"][1:] == ("0.172", "+0.172", "1", "0 of 4")
    assert rows["least_plane_margin >= 0"][1:] == ("-0.006", "-0.006: NOT enough", "2", "1 of 4")
    assert plane_line(made) in peak_lines(made)
    made["least_plane_margin"] = made["least_drive_margin"] - 4e-3
    assert plane_line(made) == ""
    assert "least_plane_margin >= 0" not in str(margin_table(analyse(made)).rows)
    made["least_plane_margin"] = made["least_drive_margin"] - 0.1
    assert plane_line(made).endswith("is 0.072 (sample 1): enough")
    # The worst of both may be alike, where a plane alone falls short in more samples.
    made["least_drive_margin"][1] = made["least_plane_margin"][1] = -0.9
    made["least_plane_margin"][3] = -0.4
    assert plane_line(made).endswith("is -0.900 (sample 1): NOT enough in 2 of 4 samples")
    made["least_drive_margin"][1] = 0.172
    # Before the last winch starts one plane has no drive, which is nothing wrong.
    made["least_plane_margin"] = made["least_drive_margin"] * 0.0 - 0.957
    made["least_drive_margin_started"] = made["least_drive_margin"] + 2.0
    made["least_plane_margin_started"] = made["least_drive_margin_started"]
    made["least_drive_margin_started_angle"] = made["least_drive_margin"] * 0.0 + 14.0
    assert plane_line(made) == ""
    assert not any("one plane" in line for line in peak_lines(made))
    assert "least_plane_margin" not in str(margin_table(analyse(made)).rows)
    made["least_plane_margin_started"] = made["least_drive_margin_started"] - 2.2
    assert "own cable from the start of the last winch on is -0.028 (sample 1): NOT" in (
        plane_line(made)
    )
    rows = {row[0]: row[1:] for row in margin_table(analyse(made)).rows}
    assert rows["least_plane_margin_started >= 0"][-1] == "1 of 4"


def test_a_margin_that_is_enough_of_a_ring_that_did_not_open_says_for_what() -> None:
    """As behind a jammed pulley: its margin is that of a rigid ring."""
    made = made_campaign(6, failed=(5,), stalled=(1, 2, 3))
    wanted = {"least_drive_margin": {"min": 0.0, "probability": 0.5, "confidence": 0.5}}
    made["least_drive_margin"] = "sample", np.array([0.3, 0.2, -0.1, 0.4, 0.9, 0.9])
    course = np.ones((6, made.sizes["time"]))
    course[:, -1] = np.nan
    course[3, -2] = -1.0  # its winches were switched off
    made["drive_margin"] = ("sample", "time"), course
    assert rigid_line(made).startswith("in 1 of 5 samples the least drive margin is enough and ")
    analysis = analyse(made, wanted)
    assert f"least_drive_margin: {rigid_line(made)}" in verdict_table(analysis).notes
    assert rigid_line(made) not in margin_table(analysis).notes
    assert rigid_line(made) in margin_table(analyse(made)).notes
    assert rigid_line(made) in peak_lines(made)
    made["least_plane_margin"] = made["least_drive_margin"] - 0.05
    wanted = {"least_plane_margin": wanted["least_drive_margin"]}
    assert f"least_plane_margin: {rigid_line(made)}" in verdict_table(analyse(made, wanted)).notes
    made["least_plane_margin"] = made["least_drive_margin"] = abs(made["least_drive_margin"])
    made["least_plane_margin"] = made["least_plane_margin"] - 0.1 * (made["sample"] == 2)
    assert plane_line(made).endswith("is 0.000 (sample 2): enough for a rigid ring")
    made["outcome"] = made["outcome"] * 0 + int(Fate.DEPLOYED)
    assert rigid_line(made) == ""
    assert plane_line(made).endswith(": enough")


def test_an_output_that_another_repeats_is_named_instead_of_told_twice() -> None:
    made = made_campaign(12)
    made["least_drive_margin"] = "sample", np.linspace(0.1, 0.5, 12)
    made["least_drive_margin_started"] = made["least_drive_margin"] * (1.0 + 1e-12)
    found = analyse(made)
    table, name = statistics_table(found), "least_drive_margin_started"
    assert name not in [row[0] for row in table.rows]
    assert f"in all samples {name} is least_drive_margin" in table.notes
    assert name in [row[0] for row in statistics_table(found, every=True).rows]
    made[name] = made["least_drive_margin"] + 1e-3
    assert name in [row[0] for row in statistics_table(analyse(made)).rows]
    # The same numbers in other samples, or in another unit, are another output.
    made[name] = "sample", made["least_drive_margin"].values[::-1].copy()
    made["asynchrony_max"] = made["deployment_time"] = "sample", np.linspace(1.0, 2.0, 12)
    rows = [row[0] for row in statistics_table(analyse(made)).rows]
    assert {name, "asynchrony_max", "deployment_time"} <= {*rows}


def test_how_many_reach_their_goal_with_each_drawn_fault() -> None:
    made = made_campaign(8)
    words = ["jam", "none", "none", "jam", "none", "none", "none", "jam"]
    law = {"role": "input", "path": "faults", "distribution": '{"kind": "discrete"}'}
    made["faults"] = "sample", np.array(words, dtype=object), law
    made["outcome"] = "sample", np.where(np.array(words) == "jam", 3, 1)
    told = ["deployed without faults: 5 of 5", "deployed with jam: 0 of 3"]
    assert reached_by_words(made, "faults") == told
    made["status"][0] = Status.DIVERGED
    assert reached_by_words(made, "faults")[1] == "deployed with jam: 0 of 3, 1 failed run"
    made["faults"] = "sample", np.array([*"abcdefgh"], dtype=object) + "xyz", law
    assert len(reached_by_words(made, "faults")) == 8
    assert not reached_by_words(made, "boom")


def test_figures_mark_the_panels_of_what_may_be_off() -> None:
    """In the caption, too; nothing of that where runs doubt nothing."""
    for names in ({}, dict.fromkeys(range(3), "peak_tension")):
        made = with_doubts(made_campaign(8), names)
        drawn = {picture.name: figure for picture, figure in figures_of(made)}
        figure = drawn["distributions"]
        labels = [axes.get_xlabel() for axes in figure.axes]
        assert [each for each in labels if each.endswith(" ?")] == [
            each for each in labels if names and "tension" in each
        ]
        titles = [axes.get_title(loc="left") for axes in drawn["tornado"].axes]
        assert [each for each in titles if each.endswith(" ?")] == [
            each for each in titles if names and "tension" in each
        ]
        texts = " ".join(" ".join(each.get_text().split()) for each in figure.findobj(Text))
        assert ("peak_tension in 3 of 8 samples" in texts) == bool(names)
