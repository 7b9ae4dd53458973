"""Requirements are read from files and command lines; wrong ones are told with the cure."""

from __future__ import annotations

import math

import numpy as np
import pytest
from loops import for_each
from made_campaign import made_campaign

from ringsim.analysis import requirements
from ringsim.analysis.requirements import Kind, parse_requirements, read_requirements
from ringsim.campaign.specification import load_campaign
from ringsim.refusal import InputError

pytestmark = pytest.mark.quick

SHOWN = {"probability": 0.99, "confidence": 0.9}


def test_both_ways_of_writing_read_alike():
    table = {"outcome": {"is": "deployed", **SHOWN}, "asynchrony_max": {"max": 10, **SHOWN}}
    texts = [
        "outcome: is deployed, probability 0.99, confidence 0.9",
        "asynchrony_max=max=10, probability = 0.99, confidence=0.9",
    ]
    assert parse_requirements(texts) == read_requirements(table, "file")


def test_more_joints_than_a_campaign_has_cannot_be_required():
    made = made_campaign()
    for name in requirements.COUNTS:
        made[name] = "sample", np.full(8, 8)
        (of_all,) = parse_requirements([f"{name}: min 8, probability 0.9, confidence 0.9"]).values()
        requirements.require_values(made, name, of_all)
        more = of_all.model_copy(update={"min": 9.0})
        with pytest.raises(InputError, match=rf"on {name}\.min = 9: must be at most 8, the V-jo"):
            requirements.require_values(made, name, more)


@for_each(
    ("table", "words"),
    [
        ({"asynchrony_mx": {"max": 1.0, **SHOWN}}, r"did you mean asynchrony_max\?"),
        ({"drive_margin_min": {"min": 0.0, **SHOWN}}, r"did you mean least_drive_margin\?"),
        ({"asynchrony": {"max": 1.0, **SHOWN}}, "value for each time.*asynchrony_max"),
        ({"latch_rate": {"max": 0.45, **SHOWN}}, "use its largest, peak_latch_rate"),
        ({"latch_rate": {"min": 0.3, **SHOWN}}, "use its least, least_latch_rate"),
        ({"latched": {"min": 1, **SHOWN}}, "latched_joints is another number of it"),
        ({"lock_impulse": {"max": 1.0, **SHOWN}}, "use its largest, peak_lock_impulse"),
        ({"peak_acceleration": {"max": 1.0, **SHOWN}}, "use its largest, peak_acceleration_max"),
        ({"motor_torque": {"max": 1.0, **SHOWN}}, "use its largest, peak_motor_torque"),
        ({"motor_power": {"max": 1.0, **SHOWN}}, "use its largest, peak_motor_power"),
        ({"motor_energy": {"max": 8.0, **SHOWN}}, "total_motor_energy is another number of it"),
        ({"peak_tension": {"max": 1.0, "probability": 0.9}}, "confidence is missing"),
        ({"peak_tension": SHOWN}, "give max or min, in N"),
        ({"peak_tension": {"maximum": 1.0, **SHOWN}}, r"did you mean max\?"),
        ({"peak_tension": {"max": 1.0, "min": 2.0, **SHOWN}}, "min = 2 must be below max = 1"),
        ({"peak_tension": {"is": "deployed", **SHOWN}}, "only the requirement on outcome takes is"),
        ({"peak_tension": {"max": "much", **SHOWN}}, "must be a finite number"),
        ({"peak_tension": {"max": 1.0, "probability": 1.0, "confidence": 0.9}}, "must be below 1"),
        ({"peak_tension": {"max": 1.0, "probability": 0.9, "confidence": 9}}, "must be below 1"),
        ({"outcome": {"max": 1.0, **SHOWN}}, 'for example is = "deployed"'),
        ({"outcome": {"is": "deplyed", **SHOWN}}, r"did you mean deployed\?"),
        ({"peak_tension": {"max": "0.2 kN", **SHOWN}}, "in N, without quotes: write 200$"),
        ({"asynchrony_max": {"max": "0.2 rad", **SHOWN}}, "in deg, .* write 11.4592$"),
        ({"deployment_time": {"max": "1 min", **SHOWN}}, "in s, .* write 60$"),
        ({"deployment_time": {"max": "1 N", **SHOWN}}, "in s, .* write the number alone$"),
        ({"peak_tension": 5.0}, r"must be a table: write requirements.peak_tension = \{ max = "),
        ({"outcome": {"is": 3, **SHOWN}}, "must be text in quotes"),
    ],
)
def test_wrong_requirements_are_told_with_the_cure(table, words):
    with pytest.raises(InputError, match=rf"study\.toml: requirements\..*{words}"):
        read_requirements(table, "study.toml")


@for_each(
    ("texts", "words"),
    [
        (["asynchrony_max"], "must read NAME: KEY VALUE"),
        (["asynchrony_max: 10"], "must read NAME: KEY VALUE"),
        (["outcome: is deployed", "outcome: is folded"], "given twice"),
        (["latch_rate[upper,2]: max 3"], r"latch_rate\[upper,2\]: .*its largest, peak_latch_rate"),
        (["latch_rate: min 0.1"], "require latch_rate: .*its least, least_latch_rate"),
        (["peak_tension[1]: max 3"], r"peak_tension\[1\]: a sample has one value: leave out \[1\]"),
        (["asynchrony_max: max 10 N, probability 0.9"], "max = 10 N: give it in deg"),
        (["asynchrony_max: max 1, probability 9 %"], "probability = 9 %: give it without"),
        (
            ["deployment_time: max 5, max 6, probability 0.5, confidence 0.9"],
            "--require deployment_time: max is given twice: leave out one of the two",
        ),
        (["locked_joints: min 3 s, probability 0.9"], "min = 3 s: give it as a number without"),
    ],
)
def test_wrong_texts_are_told_with_an_example(texts, words):
    with pytest.raises(InputError, match=words):
        parse_requirements(texts)


@for_each(
    ("text", "bound"),
    [
        ("peak_rod_stress: max 5 MPa", 5e6),
        ("peak_tension: max 0.1 kN", 100.0),
        ("deployment_time: max 2 min", 120.0),
        ("asynchrony_max: max 0.1 rad", math.degrees(0.1)),
        ("least_latch_rate: min 3 deg/s", math.radians(3.0)),
    ],
)
def test_bounds_in_other_units_are_taken_over(text, bound):
    (found,) = parse_requirements([f"{text}, probability 0.99, confidence 0.9"]).values()
    assert (found.max if found.min is None else found.min) == pytest.approx(bound, rel=1e-12)


def test_degrees_have_three_names():
    for unit in "deg", "degree", "degrees":
        text = f"asynchrony_max: max 10 {unit}, probability 0.99, confidence 0.9"
        assert parse_requirements([text])["asynchrony_max"].max == 10.0


def test_a_campaign_refuses_what_its_scene_does_not_tell(tmp_path):
    file = tmp_path / "study.toml"
    text = """
        name = "study"
        scene = "ring18"
        design = { kind = "random", samples = 2 }
        [requirements]
        peak_tension = { max = 10.0, probability = 0.99, confidence = 0.9 }
        """
    file.write_text(text)
    with pytest.raises(InputError, match=r"requirements\.peak_tension: .* the scene has no cables"):
        load_campaign(file)
    file.write_text(text.replace("peak_tension", "asynchrony_max"))
    assert load_campaign(file).specification.requirements["asynchrony_max"].max == 10.0


def test_a_kind_is_a_record_and_a_field(monkeypatch: pytest.MonkeyPatch) -> None:
    size = Kind("size", "of size <=", lambda values, bound: np.abs(values) - bound)
    monkeypatch.setattr(requirements, "KINDS", (*requirements.KINDS, size))

    class Sized(requirements.Requirement):
        size: float | None = None

    wanted = Sized(size=2.0, max=1.5, **SHOWN)
    assert wanted.told("peak_tension") == "peak_tension <= 1.5 N and of size <= 2 N"
    assert wanted.beyond(np.array([-3.0, 1.0, 1.75])).tolist() == [1.0, -0.5, 0.25]
    assert np.isnan(wanted.beyond(np.array([np.nan]))).all()
    assert wanted.limits == [("max", 1.5), ("size", 2.0)]
